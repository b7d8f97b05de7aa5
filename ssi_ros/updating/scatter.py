"""
By how much the errors of a model differ from one healthy recording to the next, eq. (164a).

Of two or three recordings the variance of one error says little: it is twice that of chance in one
of seven cases where nothing differs. What a temperature or a mounting changes it changes in all
modes, so errors of one kind share a variance (Paule and Mandel, J. Research NBS 87, 1982), and one
counts by its own where chance and that do not explain it.
"""
import numpy as np

from ssi_ros.scipy_later import brentq
from ssi_ros.tails import chi2

OWN = 0.01              # chance of a variance so large, below which an error has one of its own


def between_recordings(names, spread, chance, recordings):
    """
    Return the standard deviation of errors from recording to recording, beyond chance.

    Parameters
    ----------
    names : sequence of str
        Of the errors, the kind first, such as 'frequency E1 2'.
    spread, chance : ndarray, shape (m,)
        Variance of the fits to one recording each, and what their covariances say of it.
    recordings : int
        How many there are, 2 or more.

    Returns
    -------
    ndarray, shape (m,)

    """
    kinds, found = np.array([n.split()[0] for n in names]), np.zeros(len(names))
    for kind in np.unique(kinds):
        at = kinds == kind
        found[at] = common_variance(spread[at], chance[at])
    freedoms = recordings - 1
    alone = chi2.sf(freedoms * spread / (chance + found), freedoms) < OWN
    return np.sqrt(np.where(alone, np.maximum(spread - chance, found), found))


def common_variance(spread, chance):
    """Return the variance that n quantities share beside that of chance; both (n,)."""
    def excess(variance):
        return np.sum(spread / (chance + variance)) - len(spread)
    if excess(0.0) <= 0.0:
        return 0.0
    return brentq(excess, 0.0, np.sum(spread))
