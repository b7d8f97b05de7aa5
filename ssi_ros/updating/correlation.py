"""
What lightly damped modes correlate: bins and segments that a likelihood takes for independent.

A resonance narrower than a bin has one random height, which all bins that it leaks into share; and
what a mode does in one segment rings on into the next. Of a mode of 0.36 Hz and half a per cent of
damping the likelihood (97) counts five times what a record of ten segments of a minute holds. An
effect of which the errors of a model leave little else, and numbers that are fitted to such bins,
scatter accordingly, eq. (192) of docs/theory-gap.md. How channels move in proportion is
another matter: that is in the noise, which is independent.
"""
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from ssi_ros.effects.statistical_linearisation import linearise
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.whittle import real_vectors
from ssi_ros.model.disturbances import Chirp, Sine
from ssi_ros.model.excitation import Coloured, layers, source
from ssi_ros.model.statespace import stationary_divisor

AROUND = 12             # bins on both sides of a mode that are followed
FASTEST = 16.0          # decay of the amplitude in a segment beyond which bins are independent
LEAST = 1e-3            # share of the largest variance, below which none is followed


@dataclass(frozen=True, eq=False)
class Correlation:
    """Bins in which the height of a mode varies by more than that of independent ones."""

    bins: np.ndarray        # (m,), of those of the frame
    root: np.ndarray        # (m, s), of their covariance beyond that of independent bins
    shapes: np.ndarray      # (m, l), of the mode at the channels, complex

    def parts(self, directions, lower):
        """
        Return the parts of whitened directions, (p, k l l), that vary more, shape (p, s).

        Their products add to those of the directions what a variance of scores has more.
        """
        each = directions.reshape(-1, len(lower), lower.shape[-1] ** 2)[:, self.bins]
        return self.parts_of(each, lower)

    def parts_of(self, each, lower):
        """Return the same of directions in the bins alone, (p, m, l l)."""
        along = np.einsum('kij,kj->ki', lower[self.bins], self.shapes)
        along /= np.linalg.norm(along, axis=1)[:, None]
        heights = real_vectors(along[:, :, None] * along.conj()[:, None, :])
        return np.einsum('pki,ki->pk', each, heights) @ self.root


def correlated(simulator):
    """Return the model side in the same frame that knows what its modes correlate."""
    return simulator.but(frame=replace(simulator.frame, correlation=correlation(simulator)))


def correlated_beside(simulator, record):
    """Return a model side as of `correlated`, and a Record in its frame."""
    simulator = correlated(simulator)
    return simulator, replace(record, spectra=replace(record.spectra, frame=simulator.frame))


def correlation(simulator):
    """
    Return the Correlation of a model side.

    The covariance of the heights of two bins is the sum of their squared coherences over all
    segments, by the shares that a mode has of the power of both, less that of white noise.
    """
    frame, known = simulator.frame, simulator.known
    expected = simulator.expected(Candidate()).at_nominal.mean(axis=0)[:, known:, known:]
    power = np.trace(expected, axis1=1, axis2=2)
    setup = linearise(simulator.setup(Candidate()))
    system = setup.system
    sampled = system.state_space.discrete(system.rate_hz)
    count = frame.last - frame.first
    found, largest, shapes = [], np.zeros(count), np.zeros((count, len(sampled.c)), complex)
    for pole, shape, own in zip(sampled.poles, sampled.c.T, _modal_powers(sampled, system)):
        centre = round(np.angle(pole) / (2 * np.pi) * frame.rows)
        bins = np.arange(centre - AROUND, centre + AROUND + 1)
        bins = bins[(bins >= frame.first) & (bins < frame.last)]
        if len(bins) and 0.0 < -np.log(np.abs(pole)) * frame.rows < FASTEST:
            periodogram, beyond = _of_mode(pole, bins, frame)
            at = bins - frame.first
            share = np.clip(own * periodogram / power[at].real, 0.0, 1.0)
            strongest = share > largest[at]
            shapes[at[strongest]], largest[at] = shape, np.maximum(largest[at], share)
            found.append((at, np.outer(share, share) * beyond))
    bins = np.flatnonzero(largest)
    total = np.zeros((len(bins), len(bins)))
    for at, covariance in found:
        total[np.ix_(*2 * (np.searchsorted(bins, at),))] += covariance
    values, vectors = np.linalg.eigh(total)
    kept = values > LEAST * values.max(initial=0.0)
    return Correlation(bins, vectors[:, kept] * np.sqrt(values[kept]),
                       np.pad(shapes[bins], ((0, 0), (known, 0))))


def _modal_powers(sampled, system):
    """Return the power that all channels have of every mode, at its positive frequency, (n,)."""
    frequency_hz = np.abs(np.angle(sampled.poles)) * system.rate_hz / (2 * np.pi)
    total = np.zeros(len(sampled.poles))
    for part in system.excitation:
        inner = source(part)
        if not isinstance(inner, (Sine, Chirp)):
            colour = np.prod([layer.power(frequency_hz) for layer in layers(part)
                              if isinstance(layer, Coloured)], axis=0)
            covariance = inner.covariance(system.rate_hz, system.inputs)
            total += colour * np.einsum(
                'im,mn,in->i', sampled.b, covariance, sampled.b.conj()).real
    settled = np.diag(stationary_divisor(sampled.poles, system.rate_hz)).real
    return np.sum(np.abs(sampled.c) ** 2, axis=0) * total / settled


def _of_mode(pole, bins, frame):
    """Return the periodogram of a mode of unit power, (k,), and what its heights covary more."""
    rows = np.arange(frame.rows)
    waves = frame.taper * np.exp(-2j * np.pi / frame.rows * np.outer(bins, rows))
    # E x(n) x(m)* = p^(n - m): in a segment, by the recursion over m, and from one to later ones
    half = waves @ lfilter([1.0], [1.0, -pole], waves.conj().T, axis=0)
    inside = half + half.conj().T - waves @ waves.conj().T
    power = np.real(np.diag(inside))
    later, before = waves @ pole ** rows, waves.conj() @ pole ** -rows
    begins = np.array(frame.begins, float)
    apart = (begins[:, None] - begins)[np.tril_indices(len(begins), -1)]
    pairs = np.sum(np.abs(pole) ** (2 * apart)) / len(begins)
    across = pairs * np.outer(np.abs(later) ** 2, np.abs(before) ** 2)
    coherence = (np.abs(inside) ** 2 + across + across.T) / np.outer(power, power)
    # of white noise, whose sum is the inflation that all bins have
    white = np.abs(np.fft.fft(frame.taper ** 2)) ** 2
    return power, (coherence - white[np.abs(np.subtract.outer(bins, bins))]) / frame.inflation
