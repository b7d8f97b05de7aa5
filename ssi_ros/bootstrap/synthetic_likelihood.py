"""
Numbers of which only simulations say what they make: a synthetic likelihood, eq. (108a).

Statistics of simulated records are Gaussian about a quadratic function of the numbers, near those
that make what was observed (Wood, Nature 466, 2010).
"""
import numpy as np

SIMULATED = 80          # numbers of each of both rounds
NEAREST = 5             # one in so many of the first round says where the second is drawn
WIDER = 1.5             # than those, in standard deviations
LEAST_STD = 0.15        # of a logarithm, that the second round has at least


def posterior(simulate, goal, grid, generator):
    """
    Return the probability of each point of a grid.

    Parameters
    ----------
    simulate : callable
        Statistics (s,) of a simulated record of the numbers (p,) of a point.
    goal : ndarray, shape (s,)
        The same of the record.
    grid : ndarray, shape (g, p)
        Numbers that are possible, logarithms of sizes, alike probable.
    generator : numpy.random.Generator
        Which points are simulated.

    Returns
    -------
    ndarray, shape (g,)

    """
    points = grid[generator.integers(len(grid), size=SIMULATED)]
    found = np.array([simulate(p) for p in points])
    off = (found - goal) / np.maximum(found.std(axis=0), 1e-12)
    near = points[np.argsort((off ** 2).sum(axis=1))[:SIMULATED // NEAREST]]
    spread = WIDER ** 2 * (np.cov(near.T) + LEAST_STD ** 2 * np.eye(grid.shape[1]))
    away = grid - near.mean(axis=0)
    chances = np.exp(-np.einsum('gp,pq,gq->g', away, np.linalg.inv(spread), away) / 2)
    points = grid[generator.choice(len(grid), SIMULATED, p=chances / chances.sum())]
    found, centre = np.array([simulate(p) for p in points]), points.mean(axis=0)
    terms = _quadratic(points - centre)
    slopes, *_ = np.linalg.lstsq(terms, found, rcond=None)
    rest = found - terms @ slopes
    covariance = rest.T @ rest / (SIMULATED - terms.shape[1]) + 1e-6 * np.eye(len(goal))
    off = goal - _quadratic(grid - centre) @ slopes
    log = -np.einsum('gs,st,gt->g', off, np.linalg.inv(covariance), off) / 2
    # a quadratic function holds where it was fitted
    low, high = points.min(axis=0), points.max(axis=0)
    log[np.any((grid < low) | (grid > high), axis=1)] = -np.inf
    chances = np.exp(log - log.max())
    return chances / chances.sum()


def _quadratic(x):
    """Return 1, numbers and their products, (g, 1 + p + p (p + 1) / 2)."""
    i, j = np.triu_indices(x.shape[1])
    return np.column_stack([np.ones(len(x)), x, x[:, i] * x[:, j]])
