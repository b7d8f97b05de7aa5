"""Prior of numbers whose size is not known: one in common for a kind, and each its own beside."""
import numpy as np

ROUNDS = 5              # of the size that numbers of one kind have in common
LEAST_SIZE = 0.1        # of a number


def posterior_over_prior(kinds, x, covariance, nats):
    """
    Return the log of posterior over prior volume of numbers, eq. (112).

    Parameters
    ----------
    kinds : sequence of str
        Of each of the p numbers; those of one kind have a size of their own.
    x : ndarray, shape (p,)
        Estimates, in units in which 1 is a usual size.
    covariance : ndarray, shape (p, p)
        Of the estimates.
    nats : float
        By which sizes may differ, equally likely by their logarithms, to both sides of 1.

    """
    information = np.linalg.pinv(covariance, hermitian=True)
    prior, sizes = np.zeros_like(covariance), 0
    for kind in dict.fromkeys(kinds):
        at = np.flatnonzero([k == kind for k in kinds])
        own = np.mean(x[at] ** 2)
        for _ in range(ROUNDS):     # one that is known best does not stand for all of them
            weight = 1 / (np.diag(covariance)[at] + own + 1e-12)
            common = x[at] @ weight / weight.sum()
            own = (x[at] - common) ** 2 @ weight / weight.sum()
        prior[np.ix_(at, at)] = max(common ** 2, LEAST_SIZE ** 2) + own * np.eye(len(at))
        sizes += 1 + (len(at) > 1)
    inside = np.eye(len(x)) + prior @ information
    return (-0.5 * float(np.linalg.slogdet(inside)[1])
            - 0.5 * float(x @ information @ np.linalg.solve(inside, x))
            - sizes * np.log(2 * nats / np.sqrt(2 * np.pi)))
