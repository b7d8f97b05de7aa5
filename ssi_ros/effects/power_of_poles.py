"""
The spectrum of a motion by its poles, compiled by numba on first use and cached.

Imported by what computes it: the start of a node has no use for a compiler.
"""
from numba import njit
import numpy as np


@njit(cache=True, fastmath=True, error_model='numpy')
def power_of_poles(poles, weights, variance, cosine, sine):
    """Return the spectrum (n,) of R(m) = Re sum_s weight_s pole_s^(m - 1), R(0) = variance."""
    power = np.full(len(cosine), variance)
    for pole, weight in zip(poles, weights):
        twice, square = 2 * pole.real, pole.real ** 2 + pole.imag ** 2
        own, both = weight.real, weight.real * pole.real + weight.imag * pole.imag
        # line after line, so that the loop runs on vectors
        for k in range(len(power)):
            # weight / (x + jy - pole) and that of the conjugates, over one denominator
            x, y = cosine[k], sine[k]
            below = x * x - y * y - twice * x + square
            beside = (2 * x - twice) * y
            power[k] += 2 * ((own * x - both) * below + own * y * beside) / (
                below * below + beside * beside)
    return np.maximum(power, 0.0)
