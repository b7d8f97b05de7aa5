"""
Tail probabilities of the usual distributions, under the names that `scipy.stats` gives them.

They are those of `scipy.special`: an import of `scipy.stats` takes half a second, a sixth of a
diagnosis of ten minutes.
"""
from types import SimpleNamespace

import numpy as np
from scipy.special import chdtri, fdtrc, fdtri, gammaincc, log_ndtr, ndtr, ndtri, stdtr


def _of_gamma(x, shape, scale=1.0):
    # of no degree of freedom there is no distribution
    shape = np.where(np.greater(shape, 0), shape, np.nan)
    return gammaincc(shape, np.maximum(x, 0.0) / scale)


def _density(x, mean=0.0, std=1.0):
    return np.exp(-((x - mean) / std) ** 2 / 2) / np.sqrt(2 * np.pi) / std


def _log_of_gamma(x, shape, scale=1.0):
    with np.errstate(divide='ignore'):
        return np.log(_of_gamma(x, shape, scale))


norm = SimpleNamespace(sf=lambda x: ndtr(-x), isf=lambda p: -ndtri(p), pdf=_density,
                       logsf=lambda x: log_ndtr(-x))
chi2 = SimpleNamespace(sf=lambda x, freedom: _of_gamma(x, freedom / 2, 2.0),
                       isf=lambda p, freedom: chdtri(freedom, p))
gamma = SimpleNamespace(sf=_of_gamma, logsf=_log_of_gamma)
student = SimpleNamespace(sf=lambda x, freedom: stdtr(freedom, -x))
fisher = SimpleNamespace(sf=lambda x, above, below: fdtrc(above, below, x),
                         isf=lambda p, above, below: fdtri(above, below, 1 - p))


def tail_of_highest(power, cells):
    """Return the chance of so large an exponential variable in so many cells."""
    return float(-np.expm1(cells * np.log1p(-min(np.exp(-power), 1 - 1e-16))))


def tail_of_highest_in_plane(power, cells):
    """Return a bound of the chance of so large a maximum of a field over a plane."""
    # there are so many more maxima than independent cells
    return float(min(1.0, cells * max(power, 1.0) * np.exp(-power)))


def tail_of_largest(found, largest, least=0.0):
    """Return the chance of a largest score by draws of it, (n,), of `least` independent scores."""
    share = np.mean(largest >= found)
    if share > 20 / len(largest):
        return float(share)
    # beyond their resolution: the number of independent scores that gives their median
    effective = max(np.log(0.5) / np.log1p(-2 * norm.sf(np.median(largest))), least)
    return float(-np.expm1(effective * np.log1p(-2 * norm.sf(found))))
