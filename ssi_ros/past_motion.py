"""Velocity and displacement of accelerations by their past alone, and the level of inputs."""
from itertools import combinations

import numpy as np
from scipy.fft import irfft

from ssi_ros.windows import slow

VELOCITY, DISPLACEMENT = 1, 2   # integrals of an acceleration
DAMPING = 0.7           # of the integrals, which forget
PAIRED = 8              # channels of which every two are taken
LARGE = 3.0             # rms of the motion beyond which it counts as that: few large values


def points_of(width):
    """Return channels, and every two of them where they are few, as tuples of numbers."""
    return [(i,) for i in range(width)] + [
        p for p in combinations(range(width), 2) if width <= PAIRED]


def integrated(spectra, rows, rate_hz, corner_hz, integrals):
    """
    Return integrals of accelerations, (rows,) or (rows, q), above a corner.

    Parameters
    ----------
    spectra : ndarray, complex, shape (rows + 1,) or (rows + 1, q)
        Of the accelerations and as many zeros, so that what is later does not come round.
    rows : int
        Of the accelerations.
    rate_hz, corner_hz : float
        Of the samples, and below which motion is forgotten.
    integrals : int
        VELOCITY or DISPLACEMENT.

    """
    turn = np.exp(-1j * np.pi * np.arange(rows + 1) / rows)
    s = 2 * rate_hz * (1 - turn) / np.where(np.abs(1 + turn) > 0, 1 + turn, 1e-9)
    corner = 2 * np.pi * corner_hz
    transfer = s ** (2 - integrals) / (s ** 2 + 2 * DAMPING * corner * s + corner ** 2)
    return irfft((spectra.T * transfer).T, axis=0)[:rows]


def level_of_inputs(errors):
    """Return the slow level of the inputs, (n,): the rms of what is new around, (n, l)."""
    return np.sqrt(slow(np.mean(errors ** 2, axis=1)))


def over_level(motion):
    """Return motion (n,) over its rms around, at most LARGE."""
    return np.clip(motion / np.sqrt(np.maximum(slow(motion ** 2), 1e-300)), -LARGE, LARGE)
