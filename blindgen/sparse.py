# Licensed under the Apache License, Version 2.0.
"""
d' of what is rare: a line somewhere, pulses at unknown times, spikes.

A matched filter that is told the frequency or the instants sees 200 pulses of 0.3 standard
deviations each with d' = 4; nobody who must look for them sees any, for they only raise the level.
So a line pays for the cells that are searched, and events count by the symmetric divergence
between a sample's distribution with them and the Gaussian of the same power, summed over samples.
For a shift of a mean that divergence is d'^2 as well.
"""
from math import log, sqrt

import numpy as np

FALSE_ALARM = 0.05
ONE_SIDED = 1.645           # of a normal, at that rate


def searched(d, cells):
    """
    Return d' of a line that is d standard deviations high and may lie in any of many cells.

    2 |tau|^2 > 2 ln(cells / alpha) is the line's threshold; d' is that of the single test at
    alpha with the same power.
    """
    return max(0.0, d - sqrt(2 * log(cells / FALSE_ALARM)) + ONE_SIDED)


def _divergence(q, q0, weight):
    """Return the symmetric divergence of two densities on a grid, each normalised on it."""
    q, q0 = q / np.sum(q * weight), q0 / np.sum(q0 * weight)
    seen = (q > 1e-300) & (q0 > 1e-300)
    q, q0, weight = q[seen], q0[seen], weight[seen]
    return float(max(np.sum(weight * (q - q0) * np.log(q / q0)), 0.0))


def pulses(height, share, samples):
    """Return d' of pulses +-height [sd] in a share of the samples, at unknown instants."""
    if height > 30:
        height = 30.0                            # each is certain long before
    z = np.linspace(-height - 12, height + 12, 20001)
    level = 1 + share * height**2
    q = (1 - share) * np.exp(-z * z / 2) + share / 2 * (
        np.exp(-(z - height)**2 / 2) + np.exp(-(z + height)**2 / 2))
    q0 = np.exp(-z * z / 2 / level)
    return sqrt(samples * _divergence(q, q0, np.full(len(z), z[1] - z[0])))


def spikes(height, share, samples):
    """Return d' of spikes with Gaussian heights, rms `height` [sd] in each of four channels."""
    r = np.exp(np.linspace(np.log(1e-3), np.log(40 * (1 + height)), 20001))

    def density(scale):                          # chi with 4 degrees, per ln r
        return r**4 / scale**2 * np.exp(-r * r / 2 / scale)

    q = (1 - share) * density(1.0) + share * density(1 + height**2)
    return sqrt(samples * _divergence(q, density(1 + share * height**2), np.ones(len(r))))
