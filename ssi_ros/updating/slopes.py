"""
Derivatives of an expected spectrum by the errors of a model's numbers, eq. (166) and (167).

A plain spectrum is a sum over the poles of the system, R(lag) = sum_i res_i p_i^(lag - 1), and so
are its derivatives: the transforms of p^(lag - 1) serve all errors at once. What is not plain (a
drift, a filter, jitter) is differentiated by difference quotients.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects.base import lateness
from ssi_ros.gap.candidate import Candidate
from ssi_ros.hermitian import real_vectors, white_vectors
from ssi_ros.model.disturbances import Chirp, Nutation, Sine
from ssi_ros.model.excitation import layers, source, Varying, White
from ssi_ros.model.spectrum import gains_of
from ssi_ros.model.statespace import powers_of, settling, stationary_divisor
from ssi_ros.model.structure import numbers_with_errors
from ssi_ros.model.tangent import tangent

PROBE = 1e-3            # of a size, for a difference quotient
EXACT_PROBE = 1e-6      # for matrices, which are simple functions of the errors
MATRICES = 'mass', 'damping', 'stiffness', 'sensor', 'input'
TOGETHER = 16           # errors that are whitened at a time
LEAST_NEAR, WIDTHS = 6, 6.0         # bins, and half-power half-widths, that are near a resonance
STRIDE = 8              # bins apart, elsewhere


def slopes(simulator, base, levels, sizes, candidate=Candidate()):
    """
    Yield the change of an expected spectrum by a size of every error, (a, k, l, l) each.

    `base` is the spectrum of a candidate at `levels`, `sizes` (m,) in the units of the errors.
    """
    values = np.array(simulator.spacecraft.calibration.values)
    for step in np.diag(PROBE * sizes):
        there = simulator.at_errors(values + step).expected(candidate, levels)
        yield (there.at(levels) - base) / PROBE


@dataclass(frozen=True, eq=False)
class PlainSlopes:
    """
    Derivatives of a spectrum that is a sum over poles, in the modal coordinates of the system.

    The spectrum is S = G (X + X^H) G^H, X(k) = sum_j transforms(k, j) terms_j, and what no
    error changes: noise of the sensors, lines. Channels that an effect mixes before their gains
    count to first order.
    """

    transforms: np.ndarray  # (k, j), of every pole, of its derivative, and of R(0) / 2
    terms: np.ndarray       # (l l, j), real
    of_terms: np.ndarray    # (p, l l, j), their derivatives
    outputs: np.ndarray     # G, (1 or k, l, l): gains, cross-talk, delays
    of_gains: np.ndarray    # (p, l), relative, of the channels before all that
    changes: tuple          # of the matrices and of the gains, for places near by
    poles: np.ndarray       # of the sampled system

    def score(self, lower, excess):
        """
        Return the slopes of sum_k tr(excess white(change)), (p,).

        `lower` (k, l, l) whitens; `excess` (k, l, l) is Hermitian.
        """
        scaled = lower @ self.outputs
        pull = scaled.conj().swapaxes(-1, -2) @ excess @ scaled
        turned = pull.swapaxes(-1, -2).reshape(len(pull), -1)       # tr(A X) = A^T : X
        gathered = (turned.T @ self.transforms).real
        found = 2 * self.of_terms.reshape(len(self.of_terms), -1) @ gathered.ravel()
        return found + self.of_gains @ (2 * np.einsum('kij,kji->i', self._spectrum(), pull).real)

    def at(self, bins):
        """Return the same in some bins alone."""
        return replace(self, transforms=self.transforms[bins], outputs=self.outputs[bins] if len(
            self.outputs) > 1 else self.outputs)

    def whitened(self, lower):
        """Return the whitened derivatives as real vectors, (p, k l l), in single precision."""
        (bins, count, _), p = lower.shape, len(self.of_terms)
        of_terms = self.of_terms.reshape(-1, self.terms.shape[-1]).astype(np.float32)
        by_bin = np.ascontiguousarray(self.transforms.T, np.complex64).view(np.float32)
        scaled, own = (lower @ self.outputs).astype(np.complex64), self._spectrum().astype(
            np.complex64)
        mixed = np.any(np.triu(scaled, 1))      # by cross-talk
        out = np.empty((p, bins, count ** 2), np.float32)
        for begin in range(0, p, TOGETHER):
            part = slice(begin, begin + TOGETHER)
            half = (of_terms[count ** 2 * begin:][:count ** 2 * TOGETHER] @ by_bin).view(
                np.complex64).reshape(-1, count, count, bins).transpose(0, 3, 1, 2)
            of_gains = self.of_gains[part]
            if of_gains.any():
                half = half + of_gains[:, None, :, None].astype(np.float32) * own
            change = half + half.conj().swapaxes(-1, -2)
            vectors = (real_vectors(scaled @ change @ scaled.conj().swapaxes(-1, -2)) if mixed
                       else white_vectors(scaled, change))
            out[part] = vectors.reshape(-1, bins, count ** 2)
        return out.reshape(p, -1)

    def _spectrum(self):
        """Return X + X^H, (k, l, l)."""
        count = self.outputs.shape[-1]
        half = (self.transforms @ self.terms.T).reshape(-1, count, count)
        return half + half.conj().swapaxes(-1, -2)


def is_plain(simulator, levels, candidate=Candidate()):
    """Return whether the spectrum of a candidate is a sum over poles that `plain_slopes` takes."""
    return simulator.recorded is None and _colours(
        simulator.setup(candidate, levels), levels, simulator.frame) is not None


def plain_slopes(simulator, levels, sizes, candidate=Candidate(), changes=None, setup=None):
    """
    Return the PlainSlopes by sizes (p,) of all errors, at levels, beside a candidate.

    None for what is not plain: a drift, jitter, laws of hinges, filters, a level that varies,
    recorded inputs.
    `changes` of a place near by save the time to find out how errors change the matrices;
    `setup` takes the place of that of the candidate.
    """
    if simulator.recorded:
        return None
    setup = setup or simulator.setup(candidate, levels)
    colours = _colours(setup, levels, simulator.frame)
    if colours is None:
        return None
    system, frame = setup.system, simulator.frame
    changes = changes or _changes(simulator, candidate, system, sizes)
    *of_matrices, of_gains = changes
    found = tangent(system, *of_matrices)
    factors = settling(found.poles, system.rate_hz, frame.settles)
    found = replace(found, poles=factors * found.poles, of_poles=factors * found.of_poles)
    by_pole, by_its_change = _transforms(found, frame)
    whole = np.hstack([by_pole, by_its_change,
                       np.full((len(by_pole), 1), frame.overlap[0] / 2)])
    transforms, terms, of_terms = [], [], []
    for colour, inputs in colours:
        res, of_res, now, of_now = _residues(found, inputs, system.rate_hz)
        moved = res * found.of_poles[:, None, None]
        transforms.append(np.reshape(colour, (-1, 1)) * whole)
        terms += [_real(res), _real(np.zeros_like(res)), now[..., None]]
        of_terms += [_real(of_res), _real(moved), of_now[..., None]]
    terms, of_terms = (np.concatenate(t, axis=-1) for t in (terms, of_terms))
    return PlainSlopes(np.hstack(transforms), terms.reshape(-1, terms.shape[-1]),
                       of_terms.reshape(len(sizes), -1, terms.shape[-1]),
                       _outputs(setup, frame), of_gains, changes, found.poles)


def _real(terms):
    """Return complex terms (..., n) as real ones (..., 2 n), the parts one after the other."""
    return np.ascontiguousarray(terms).view(float)


def summed_bins(poles, frame):
    """
    Return bins (b,) at which an information is summed, and how many each stands for, (b,).

    Every bin near a resonance, where derivatives are sharp, and one of STRIDE where they are
    smooth.
    """
    bins = np.arange(frame.first, frame.last)
    near = np.zeros(len(bins), bool)
    for pole in poles[np.abs(poles) > 1e-9]:
        centre = np.abs(np.angle(pole)) * frame.rows / (2 * np.pi)
        half_width = -np.log(np.abs(pole)) * frame.rows / (2 * np.pi)
        near |= np.abs(bins - centre) < max(LEAST_NEAR, WIDTHS * half_width)
    begins = near | (bins % STRIDE == 0)
    begins[1:] |= near[:-1]
    begins[0] = True
    at = np.flatnonzero(begins)
    counts = np.diff(np.append(at, len(bins)))
    return at + counts // 2, counts


def _colours(setup, levels, frame):
    """Return pairs of a colour, (k,) or 1, and the covariance of its inputs; None: not plain."""
    system = setup.system
    if (setup.drift or setup.laws or setup.lags or setup.jitter_rms_s or system.shaping
            or system.conditioning or system.quadrature):
        return None
    found, each = {}, iter(levels)
    for part in system.excitation:
        filters, inner = tuple(layers(part)), source(part)
        if any(isinstance(f, Varying) for f in filters):
            return None
        if isinstance(inner, (Sine, Chirp, Nutation)):
            continue                # a line says nothing of the numbers of the model
        if not isinstance(inner, White):
            return None
        key = tuple(replace(f, part=None) for f in filters)
        level = next(each) if inner.free else 1.0
        inputs = level * inner.covariance(system.rate_hz, system.inputs)
        found[key] = found.get(key, 0.0) + inputs
    return [(np.prod([f.power(frame.frequencies_hz) for f in key], axis=0), inputs)
            for key, inputs in found.items()]


def _changes(simulator, candidate, system, sizes):
    """Return changes by sizes of the errors: of the MATRICES, and relative ones of the gains."""
    values = np.array(simulator.spacecraft.calibration.values)
    numbers, away = numbers_with_errors(simulator.spacecraft), simulator.shift(candidate)
    here, steps = numbers(values + away), np.diag(EXACT_PROBE * sizes)
    there = [numbers(values + away + step) for step in steps]
    of_gains = np.array([t.gains / here.gains - 1 for t in there]) / EXACT_PROBE
    if not all(np.array_equal(getattr(here, n), getattr(system, n)) for n in MATRICES):
        # an effect has changed the structure, perhaps by what the errors change as well
        here = system
        there = [simulator.at_errors(values + step).setup(candidate).system for step in steps]
    return (*matrix_changes(here, there, EXACT_PROBE), of_gains)


def matrix_changes(here, there, step):
    """Return the changes of the MATRICES from a system to others a step away, (p, ...) each."""
    return [np.array([getattr(t, n) - getattr(here, n) for t in there]) / step for n in MATRICES]


def _outputs(setup, frame):
    """Return what stages without memory, delays and low-passes make of the channels, (k, l, l)."""
    count = len(setup.system.channels)
    out = np.eye(count)[None]
    if any(setup.delays_s) or setup.corners_hz:
        stretch = setup.system.rate_hz / frame.rate_hz
        out = setup.reading(frame.frequencies_hz * stretch)[:, :, None] * out
    out = gains_of(setup.system) @ out
    return lateness(setup.late, frame.cycles)[:, :, None] * out if setup.late else out


def _residues(found, inputs, rate_hz):
    """
    Return the residues of poles and R(0), and their derivatives, eq. (167).

    They are (l, l, n), (p, l, l, n), (l, l), (p, l, l); of the state covariance the rows of the
    poles that are kept are computed, against both of each pair.
    """
    p, b, c, d = found.poles, found.b, found.c, found.d
    n, pair = len(p), found.weight > 1
    poles, all_b = (np.concatenate([x, x[pair].conj()]) for x in (p, b))
    ch = np.hstack([c, c[:, pair].conj()]).conj()
    over = 1 / stationary_divisor(poles, rate_hz)[:n]
    bq, of_bq = b @ inputs, found.of_b @ inputs
    state = bq @ all_b.conj().T * over
    moved = ch @ state.T                # of the state covariance and the channels, (l, n)
    ahead = p * moved + d @ bq.T
    # what a change of this pole's inputs and of all others' makes of the state covariance
    own = (over[:, None] * ch) @ all_b.conj()
    of_moved = (of_bq.transpose(1, 0, 2) @ own.swapaxes(1, 2)).transpose(1, 2, 0)
    of_moved = of_moved + found.of_poles[:, None] * (ch @ (poles.conj() * state * over).T)
    of_poles = np.hstack([found.of_poles.conj(), found.of_poles[:, pair]])
    others = np.hstack([found.of_b.conj(), found.of_b[:, pair]]) @ bq.T
    others += of_poles[:, :, None] * (p[:, None] * state).T
    others *= over.T
    of_ch = np.concatenate([found.of_c, found.of_c[:, :, pair].conj()], axis=2).conj()
    of_moved += ch @ others
    of_ahead = (found.of_poles[:, None] * moved + p * (of_moved + of_ch @ state.T)
                + d @ of_bq.swapaxes(1, 2) + found.of_d @ bq.T)
    now = (found.weight * c @ moved.T + d @ inputs @ d.T).real
    of_now = (found.weight * found.of_c @ moved.T + found.of_d @ inputs @ d.T).real
    of_now = of_now + of_now.swapaxes(1, 2) + (
        found.weight * c @ of_moved.swapaxes(1, 2)).real
    return (c[:, None] * ahead, found.of_c[:, :, None] * ahead + c[:, None] * of_ahead[:, None],
            now, of_now)


def _transforms(found, frame):
    """
    Return sum_lag overlap p^(lag - 1) e^(-j omega lag), lag = 1, ..., and its slope, (k, 2 n).

    Of T a + T' a* of a pole and its conjugate, that of Re a and that of Im a: transforms of real
    series. X + X^H counts R(0) twice, and so R(0) / 2 enters X.
    """
    safe = np.where(np.abs(found.poles) < 1e-300, 1e-300, found.poles)
    powers = found.weight * powers_of(safe, frame.rows - 1) * frame.overlap[1:, None]
    rows, out = np.zeros((frame.rows, 2 * len(safe))), []
    for each in (powers, powers * (np.arange(frame.rows - 1)[:, None] / safe)):
        rows[1:] = each.conj().view(float)
        out.append(np.fft.rfft(rows, axis=0)[frame.first:frame.last])
    return out
