"""
Numbers of which only simulations say what they make: a synthetic likelihood, eq. (108a).

Statistics of simulated records are Gaussian about a quadratic function of the numbers, near those
that make what was observed (Wood, Nature 466, 2010): each round is drawn nearer to them.
"""
import numpy as np

ANYWHERE = 80           # numbers of the first round, of all that are possible,
NEAREST = 5             # of which one in so many says where the second is drawn
SIMULATED = 50          # numbers of each round after it
WIDER = 1.5             # than what the round before leaves possible, in standard deviations
LEAST_STDS = 0.15, 0.03     # of a logarithm, that the points of a round have at least
FARTHEST, POINTS = 2.5, 41  # deviations of them that are possible, and points of each axis there


def posterior(simulate, goal, grid, possible, generator):
    """
    Return points near the most probable numbers, and the probability of each.

    Parameters
    ----------
    simulate : callable
        Statistics (s,) of a simulated record of the numbers (p,) of a point.
    goal : ndarray, shape (s,)
        The same of the record.
    grid : ndarray, shape (g, p)
        Numbers that are possible, logarithms of sizes, alike probable.
    possible : callable
        Which of some points (n, p) are possible, bool, (n,).
    generator : numpy.random.Generator
        Which points are simulated.

    Returns
    -------
    ndarray, shape (n, p)
    ndarray, shape (n,)

    """
    points = grid[generator.integers(len(grid), size=ANYWHERE)]
    found = np.array([simulate(p) for p in points])
    off = (found - goal) / np.maximum(found.std(axis=0), 1e-12)
    points = points[np.argsort((off ** 2).sum(axis=1))[:ANYWHERE // NEAREST]]
    chances = np.full(len(points), 1 / len(points))
    axis = np.linspace(-FARTHEST, FARTHEST, POINTS)
    units = np.stack(np.meshgrid(*[axis] * grid.shape[1]), -1).reshape(-1, grid.shape[1])
    drawn = np.exp(-(units ** 2).sum(axis=1) / 2)
    for least in LEAST_STDS:
        mean = chances @ points
        covariance = (chances * (points - mean).T) @ (points - mean)
        local = mean + WIDER * units @ np.linalg.cholesky(
            covariance + least ** 2 * np.eye(len(mean))).T
        kept = possible(local) & np.all(
            (local >= grid.min(axis=0)) & (local <= grid.max(axis=0)), axis=1)
        if not kept.any():
            break
        points, weights = local[kept], drawn[kept]
        some = points[generator.choice(len(points), SIMULATED, p=weights / weights.sum())]
        chances = _beside(some, np.array([simulate(p) for p in some]), goal, points)
    return points, chances


def _beside(simulated, found, goal, points):
    """Return the probability of points by the statistics that were found at simulated ones."""
    centre = simulated.mean(axis=0)
    terms = _quadratic(simulated - centre)
    slopes, *_ = np.linalg.lstsq(terms, found, rcond=None)
    rest = found - terms @ slopes
    covariance = rest.T @ rest / (SIMULATED - terms.shape[1]) + 1e-6 * np.eye(len(goal))
    off = goal - _quadratic(points - centre) @ slopes
    squares = np.einsum('gs,st,gt->g', off, np.linalg.inv(covariance), off)
    # where no numbers make the statistics of a record, it scatters by more than simulated ones
    squares /= max(1.0, squares.min() / max(len(goal) - points.shape[1], 1))
    chances = np.exp(-(squares - squares.min()) / 2)
    return chances / chances.sum()


def _quadratic(x):
    """Return 1, numbers and their products, (g, 1 + p + p (p + 1) / 2)."""
    i, j = np.triu_indices(x.shape[1])
    return np.column_stack([np.ones(len(x)), x, x[:, i] * x[:, j]])
