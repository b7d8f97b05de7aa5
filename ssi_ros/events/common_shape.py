"""The shape that events of one place have in common in white errors, and where it comes."""
import numpy as np

from ssi_ros.events.level_around import over_mean
from ssi_ros.scipy_later import maximum_filter1d, uniform_filter1d
from ssi_ros.windows import AROUND, WINDOWS

SHAPE = 96              # samples of a pulse, at most
BURST = 16              # samples in which the loudest places are searched
BEGUN = 4               # of them, with which shapes begin
ALIKE = 24              # of the best matches, of which the next shape is the mean
TURNS = 6               # of learning
MOST = 400              # events that are counted


def steady(residual):
    """Return residuals over their level around: crests of a modulated level are no pulses."""
    return over_mean(residual, max(AROUND, len(residual) // WINDOWS))


def learn(residual):
    """Return the shape that the loudest events have in common, (SHAPE, l)."""
    # Each of the loudest places begins one: it is searched everywhere, and the mean of the best
    # matches, turned to one sign, is the next.
    half = SHAPE // 2
    burst = uniform_filter1d((residual ** 2).sum(axis=1), BURST)[half:-half]
    best = (-1.0, None)
    for start in places(burst, BEGUN):
        shape = residual[start:start + SHAPE]
        for _ in range(TURNS):
            match = matched(residual, shape)
            at = places(np.abs(match), ALIKE)
            shape = np.mean([np.sign(match[k]) * residual[k:k + SHAPE] for k in at], axis=0)
        best = max(best, (float(np.abs(match[at]).mean()), shape), key=lambda b: b[0])
    return best[1]


def matched(residual, shape):
    """Return how much of a shape begins at each row, of unit variance in white noise."""
    from scipy.signal import fftconvolve
    return fftconvolve(residual, shape[::-1], 'valid', axes=0).sum(axis=1) / np.linalg.norm(shape)


def places(sizes, most):
    """Return the places of the largest values, each the largest within a shape."""
    tops = np.flatnonzero(sizes == maximum_filter1d(sizes, 2 * SHAPE + 1))
    return tops[np.argsort(-sizes[tops])][:most]
