# Licensed under the Apache License, Version 2.0.
"""
d' of what is rare or must be searched for: a line, pulses at unknown times, one effect of many.

A matched filter that knows the frequency or the instants detects 200 pulses of 0.3 standard
deviations each with d' = 4; without the instants none is detected: they only raise the level.
So a line pays for the cells that are searched, and events count by the symmetric divergence
between a sample's distribution with them and the Gaussian of the same power, summed over samples.
For a shift of a mean that divergence is d'^2 as well.
"""
from math import log, sqrt

import numpy as np
from scipy.stats import chi2, ncx2, norm

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
    both = (q > 1e-300) & (q0 > 1e-300)
    q, q0, weight = q[both], q0[both], weight[both]
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


def named(d, hypotheses):
    """
    Return d' of an effect of d standard deviations that is one of many two-sided hypotheses.

    It is that of the single test at FALSE_ALARM with the power of the largest of all, whose
    threshold is Bonferroni's.
    """
    return max(0.0, d - norm.isf(FALSE_ALARM / (2 * hypotheses)) + ONE_SIDED)


def omnibus(noncentralities, dimensions):
    """
    Return d' of a search over groups of statistics whose pattern in a group is not known.

    Each group is a chi-square of so many dimensions, tested at its share of FALSE_ALARM; d' is
    that of the single test with the power of the best group.

    Parameters
    ----------
    noncentralities, dimensions : (groups,) arrays
        Of each group.

    """
    limit = chi2.isf(FALSE_ALARM / len(dimensions), dimensions)
    missed = ncx2.cdf(limit, dimensions, np.maximum(noncentralities, 1e-9))
    power = norm.isf(np.clip(missed, 1e-300, 1.0))
    # far out the square root of a noncentral chi-square is normal
    far = np.sqrt(noncentralities + (dimensions - 1) / 2) - np.sqrt(limit)
    power = np.where(power > 6, np.maximum(far, 6), power)
    return float(max(0.0, np.max(power) + ONE_SIDED))
