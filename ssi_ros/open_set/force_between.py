"""A nonlinear force between two points of a model, and how it goes with their motion."""
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import rfft

from ssi_ros.model.spectrum import gains_of
from ssi_ros.open_set.families import Finding
from ssi_ros.scipy_later import uniform_filter1d
from ssi_ros.tails import norm
from ssi_ros.windows import slow

LARGE = 4.0             # rms of the motion beyond which it counts as that
AROUND = 101            # bins, over which the power of a force is compared with the expected one
MOST = 1 << 22          # responses of channels to forces that are held at once
INTEGRALS = 2, 1        # of an acceleration: displacement and velocity
LAW = 0.15              # share by which scores of one law of a joint differ from those of another
LEAST = 1e-300          # p-value: smaller ones would have no score
# standard deviations of the scores over theory, whose forces are not independent of the motion, by
# integral and by order, 2 and 3: python -m validation.gap_joint_forces
SCATTER = (1.05, 1.05), (1.05, 1.25)
SPRING, DAMPER = (f'The {what} between {{}} is not linear: ' for what in ('spring', 'damping'))
# families and what they say by integral, order and whether the force goes with the motion
KINDS = {
    (0, 0, False): ('uneven spring', SPRING + 'it is stiffer in one direction than in the other.'),
    (0, 1, False): ('hardening spring', SPRING + 'it hardens with the amplitude.'),
    (0, 1, True): ('softening spring', SPRING + 'it softens with the amplitude.'),
    (1, 0, False): ('uneven damping', DAMPER + 'one direction has more of it than the other.'),
    (1, 1, False): ('rising damping', DAMPER + 'the force grows faster than the velocity.'),
    (1, 1, True): ('falling damping', DAMPER + 'the force grows more slowly than the velocity.')}
FAMILIES = tuple(family for family, _ in KINDS.values())


@dataclass(frozen=True, eq=False)
class _Adjoint:
    """What a record of n rows holds of motion of, and of forces on, b distances in a model."""

    record: object          # RecordSpectra, of the same frequencies
    inputs: np.ndarray      # (k, m), most probable random inputs
    motion: np.ndarray      # (k, b), most probable accelerations
    force: np.ndarray       # (k, b), scores of forces, G^H S^-1 Y
    power: np.ndarray       # (k, p), expected power of forces between pairs of points

    def series(self, values, integrals=0):
        """Return the time series of integrals of spectra (k, q), (n, q)."""
        turn = 2j * np.pi * self.record.frequencies_hz[:, None]
        return self.record.series(values / turn ** integrals)

    def levels(self, kept):
        """Return a row of 1, and the slow power of every input, in rows that are kept, (.., n)."""
        counted, there = kept > 0, self.inputs.any(axis=0)
        power = [slow((u * kept) ** 2) for u in self.series(self.inputs[:, there]).T]
        return np.stack([counted, *(p / p[counted].mean() - 1.0 for p in power)]) * counted

    def powers(self, shares):
        """Return the power of forces of shares (p, b) of the distances, (k, p)."""
        expected = np.maximum(self.power, 1e-300)
        # as it is around every bin: beside a model that is wrong the residual is not white
        return expected * uniform_filter1d(
            np.abs(self.force @ shares.T) ** 2 / expected, AROUND, axis=0)


def forces_between(system, record, rows, kept):
    """
    Score nonlinear forces between points of a structure, eq. (188d).

    The score of a force between two points, G^H S^-1 Y, against Hermite polynomials of their most
    probable distance and velocity, given the record. Of Gaussian motion of a linear structure it
    is zero in the mean, whatever filters the force and the motion have.

    Parameters
    ----------
    system : System
        Linear, with freedoms whose forces reach its channels.
    record : RecordSpectra
        Of a record of n rows beside that system.
    rows : ndarray, shape (p, q)
        Distances of pairs of points, from the q freedoms.
    kept : ndarray, shape (n,)
        Weights that undo the taper of the record; 0 in rows that do not count.

    Returns
    -------
    ndarray, shape (p, 2, 2)
        Along displacement and velocity, of orders 2 and 3, of unit variance.

    """
    # few freedoms make many pairs, and many freedoms few
    basis, shares = (rows, np.eye(len(rows))) if len(rows) < rows.shape[1] else (
        np.eye(rows.shape[1]), rows)
    adjoint = _adjoint(system, record, basis, shares)
    powers, weight = adjoint.powers(shares), record.rows / np.sqrt(2)
    forces, levels = adjoint.series(adjoint.force), adjoint.levels(kept)
    z = np.zeros((len(rows), len(INTEGRALS), 2))
    for k, integrals in enumerate(INTEGRALS):
        state = adjoint.series(adjoint.motion, integrals) * kept[:, None]
        for i, share in enumerate(shares):
            curves = _curves(state @ share, levels)
            spectra = rfft(curves)[:, record.first:record.first + len(powers)]
            scatter = (spectra.real ** 2 + spectra.imag ** 2) @ powers[:, i]
            z[i, k] = curves @ (forces @ share) * weight / np.sqrt(np.maximum(scatter, 1e-300))
    return z / SCATTER


def _curves(motion, levels):
    """Return an even and an odd curve of motion (n,), no straight lines at any level, (2, n)."""
    counted = np.count_nonzero(levels[0])
    x = motion / max(np.sqrt(motion @ motion / counted), 1e-300)
    x = np.clip(x, -LARGE, LARGE)
    square = x * x
    even, odd = square - square.sum() / counted * levels[0], square * x
    # where the levels of the inputs vary, so does the line that a cube of Gaussian motion holds
    lines = levels * x
    share = np.linalg.lstsq(lines @ lines.T, lines @ odd, rcond=1e-9)[0]
    return np.stack([even - (even @ x) / square.sum() * x, odd - share @ lines])


def _adjoint(system, record, basis, shares):
    """Return the _Adjoint of a record, for b distances (b, q), and shares (p, b) of them."""
    names = tuple(map(str, range(len(basis))))
    moved = replace(system, sensor=basis, channels=names, measured='acceleration',
                    conditioning=None)
    pushed = replace(system, input=basis.T, inputs=names, excitation=(), shaping=None)
    size = max(1, MOST // len(system.channels) // len(basis))
    return _Adjoint(record, *(np.concatenate(parts) for parts in zip(*(
        _of_bins((system, moved, pushed), record, slice(k, k + size), shares)
        for k in range(0, len(record.frequencies_hz), size)))))


def _of_bins(systems, record, bins, shares):
    """Return inputs, motion, force and its power, of an _Adjoint, in a slice of the bins."""
    (system, moved, pushed), adjoint = systems, record.adjoint[bins]
    f, gains = record.frequencies_hz[bins], gains_of(system)
    heard, reach = gains @ system.transfer(f, record.rate_hz), gains @ pushed.transfer(f)
    inputs = np.einsum('klm,kl->km', heard.conj(), adjoint) @ record.covariance.T
    white = np.linalg.cholesky(record.inverse[bins]).conj().swapaxes(-1, -2) @ reach
    return (inputs, np.einsum('kbm,km->kb', moved.transfer(f, record.rate_hz), inputs),
            np.einsum('klb,kl->kb', reach.conj(), adjoint),
            sum(np.abs(white[:, i] @ shares.T) ** 2 for i in range(white.shape[1])))


def findings_between(z, pairs):
    """Return the Findings of scores (p, 2, 2) of forces between named pairs, one of each kind."""
    found = []
    for (k, order, along), (family, text) in KINDS.items():
        size = np.abs(z[:, k, order]) if not order else z[:, k, order] * (1 if along else -1)
        best = int(np.argmax(size))
        p_value = min(1.0, float(2 * z.size * norm.sf(size[best])))
        found.append(Finding(family, p_value, text.format(' and '.join(pairs[best]))))
    return found


def beside_simulated(p_values, simulated, count):
    """
    Return the p-value of what a record shows of forces, beside records of a fit that has some.

    Parameters
    ----------
    p_values : dict of float
        Of the record, by family; what it does not show is left out.
    simulated : dict of list of float
        As well, of records of the fit.
    count : int
        Of those records.

    """
    chances = []
    for family in FAMILIES:
        then = simulated.get(family, [])
        now, *then = norm.isf(np.clip([p_values.get(family, 0.5), *then, *[0.5] * (
            count - len(then))], LEAST, 0.5))
        mean = np.mean(then)
        scatter = max(1.0, np.std(then, ddof=1), LAW * mean) * np.sqrt(1 + 1 / count)
        chances.append(2 * norm.sf(abs(now - mean) / scatter))
    return min(1.0, len(chances) * float(min(chances)))
