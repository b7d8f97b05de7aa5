"""
What lightly damped modes correlate: bins and segments that a likelihood takes for independent.

A resonance narrower than a bin has one random height, which all bins that it leaks into share; and
what a mode does in one segment rings on into the next. Of a mode of 0.36 Hz and half a per cent of
damping the likelihood (97) counts five times what a record of ten segments of a minute holds. So
the heights of such modes in a record are unknown numbers of their own, of known variance, that are
fitted beside all else, eq. (192) of docs/theory-gap.md. How channels move in proportion is another
matter: that is in the noise, which is independent.
"""
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ssi_ros.effects.base import lateness
from ssi_ros.effects.statistical_linearisation import linearise
from ssi_ros.gap.candidate import Candidate
from ssi_ros.hermitian import inverse_root, real_vectors
from ssi_ros.model.disturbances import Chirp, Sine
from ssi_ros.model.excitation import colour_of, source
from ssi_ros.model.statespace import stationary_divisor
from ssi_ros.updating.heights import Heights
from ssi_ros.updating.model_uncertainty import ModelUncertainty

AROUND = 12             # bins on both sides of a mode that are followed
FASTEST = 16.0          # decay of the amplitude in a segment beyond which bins are independent
LEAST = 0.1             # variance beyond that of independent bins, over it, that is followed


@dataclass(frozen=True, eq=False)
class Correlation:
    """Bins in which the height of a mode varies by more than that of independent ones."""

    bins: np.ndarray        # (m,), of those of the frame
    root: np.ndarray        # (m, s), orthogonal, of their covariance beyond that
    shapes: np.ndarray      # (m, l), of the mode at the channels, complex

    def __bool__(self):
        """Return whether any height varies more."""
        return self.root.shape[1] > 0

    @cached_property
    def variances(self):
        """Return the variances of the heights, over those of independent bins, (s,)."""
        return np.sum(self.root ** 2, axis=0)

    def of(self, each, lower):
        """Return products of whitened directions in the bins, (p, m, l l), with heights (p, s)."""
        return np.einsum('pki,ki->pk', each, self._along(lower)) @ self.root

    def heights(self, lower, weight):
        """Return the Heights around a model; `weight` of all periodograms, as in `Whitened`."""
        return Heights(self.bins, self.root / np.sqrt(weight), self._along(lower))

    def _along(self, lower):
        """Return what a height changes of whitened periodograms, (m, l l), of unit norm."""
        along = np.einsum('kij,kj->ki', lower[self.bins], self.shapes)
        along /= np.linalg.norm(along, axis=1)[:, None]
        return real_vectors(along[:, :, None] * along.conj()[:, None, :])


def heights_of(simulator, candidate, levels, errors, known=None):
    """
    Return the heights of a model side with a candidate at levels, a ModelUncertainty.

    `errors` counts those of the model's numbers; `known` is the Correlation if that is known.
    """
    known = known or correlation(simulator, candidate, levels)
    model, frame = simulator.expected_there(candidate, levels).at(levels), simulator.frame
    lower = inverse_root(model.mean(axis=0))
    heights = known.heights(lower, frame.segments / frame.inflation)
    return ModelUncertainty(tuple(f'height {i + 1}' for i in range(len(heights))),
                            heights.vectors(len(lower)).astype(np.float32),
                            np.zeros(len(heights)),
                            np.zeros((len(heights), errors)), heights)


def correlation(simulator, candidate=Candidate(), levels=None):
    """
    Return the Correlation of a model side with a candidate, at levels, nominal ones if not given.

    The covariance of the heights of two bins is the sum of their squared coherences over all
    segments, by the shares that a mode has of the power of both, less that of white noise.
    """
    frame, known = simulator.frame, simulator.known
    expected = simulator.expected_there(candidate, levels)
    levels = np.ones(len(expected.names)) if levels is None else levels
    power = np.trace(expected.at(levels).mean(axis=0)[:, known:, known:], axis1=1, axis2=2).real
    system = linearise(simulator.setup(candidate, levels)).system
    sampled = system.state_space.discrete(system.rate_hz)
    count = frame.last - frame.first
    found, largest, shapes = [], np.zeros(count), np.zeros((count, len(sampled.c)), complex)
    powers = _modal_powers(sampled, system, dict(zip(expected.names, levels)))
    for pole, shape, own in zip(sampled.poles, sampled.c.T, powers):
        centre = round(np.angle(pole) / (2 * np.pi) * frame.rows)
        bins = np.arange(centre - AROUND, centre + AROUND + 1)
        bins = bins[(bins >= frame.first) & (bins < frame.last)]
        if len(bins) and 0.0 < -np.log(np.abs(pole)) * frame.rows < FASTEST:
            periodogram, beyond = _of_mode(pole, bins, frame)
            at = bins - frame.first
            share = np.clip(own * periodogram / power[at], 0.0, 1.0)
            strongest = share > largest[at]
            shapes[at[strongest]], largest[at] = shape, np.maximum(largest[at], share)
            found.append((at, np.outer(share, share) * beyond))
    bins = np.flatnonzero(largest)
    total = np.zeros((len(bins), len(bins)))
    for at, covariance in found:
        total[np.ix_(*2 * (np.searchsorted(bins, at),))] += covariance
    values, vectors = np.linalg.eigh(total)
    kept = values > LEAST
    if simulator.late:
        shapes = shapes * lateness(simulator.late, frame.cycles)
    return Correlation(bins, vectors[:, kept] * np.sqrt(values[kept]),
                       np.pad(shapes[bins], ((0, 0), (known, 0))))


def _modal_powers(sampled, system, levels):
    """Return the power that all channels have of every mode, at its positive frequency, (n,)."""
    frequency_hz = np.abs(np.angle(sampled.poles)) * system.rate_hz / (2 * np.pi)
    total = np.zeros(len(sampled.poles))
    for part in system.excitation:
        inner = source(part)
        if not isinstance(inner, (Sine, Chirp)):
            covariance = inner.covariance(system.rate_hz, system.inputs)
            total += levels.get(inner.name, 1.0) * colour_of(part, frequency_hz) * np.einsum(
                'im,mn,in->i', sampled.b, covariance, sampled.b.conj()).real
    settled = np.diag(stationary_divisor(sampled.poles, system.rate_hz)).real
    return np.sum(np.abs(sampled.c) ** 2, axis=0) * total / settled


def _of_mode(pole, bins, frame):
    """Return the periodogram of a mode of unit power, (k,), and what its heights covary more."""
    rows, (turns, lagged) = np.arange(frame.rows), _tables(frame.taper.tobytes())
    at = bins - bins[len(bins) // 2]
    turns, middle = turns[at + AROUND], np.exp(-2j * np.pi / frame.rows * (bins - at)[0] * rows)
    decay = np.exp(np.log(pole) * rows)
    # E x(n) x(m)* = p^(n - m): in a segment, by the lags n - m, and from one to later ones
    real, imag = ((turns * (decay * middle)) @ part.T for part in (lagged.real, lagged.imag))
    apart = np.subtract.outer(bins, bins).T
    i, d = np.arange(len(bins))[:, None], np.abs(apart)
    half = real[i, d] + 1j * np.sign(apart) * imag[i, d]
    alone = lagged[d, 0].real + 1j * np.sign(apart) * lagged[d, 0].imag
    inside = half + half.conj().T - alone
    power = np.real(np.diag(inside))
    later = turns @ (frame.taper * middle * decay)
    before = turns @ (frame.taper * middle / decay.conj())
    begins = np.array(frame.begins, float)
    apart = (begins[:, None] - begins)[np.tril_indices(len(begins), -1)]
    pairs = np.sum(np.abs(pole) ** (2 * apart)) / len(begins)
    across = pairs * np.outer(np.abs(later) ** 2, np.abs(before) ** 2)
    coherence = (np.abs(inside) ** 2 + across + across.T) / np.outer(power, power)
    # of white noise, whose sum is the inflation that all bins have
    white = np.abs(np.fft.fft(frame.taper ** 2)) ** 2
    return power, (coherence - white[d]) / frame.inflation


@lru_cache(maxsize=2)
def _tables(taper):
    """
    Return what all modes share, of a taper (n,) as bytes.

    e^(-j omega m) at bins up to AROUND on both sides, and, by the bins that two are apart, the sum
    over n of taper(n + m) taper(n) e^(j omega n), (2 AROUND + 1, n) each.
    """
    taper = np.frombuffer(taper)
    rows, count = np.arange(len(taper)), 2 * AROUND + 1
    turns = np.exp(-2j * np.pi / len(taper) * np.outer(np.arange(count), rows))
    tapered = np.fft.fft(taper, 2 * len(taper)) * np.fft.fft(
        taper * turns, 2 * len(taper)).conj()
    return (turns * turns[AROUND].conj(), np.fft.ifft(tapered)[:, :len(taper)])
