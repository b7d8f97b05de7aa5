"""Halves that hold as much of either recording: the scatter without a cause, eq. (144)."""
import numpy as np

from ssi_ros.gap.inference.goodness_of_fit import divergence

SPLITS = 100            # of the groups into two mixed halves


def mixed_halves(weights, split, count):
    """Yield sides (2, g) that hold the weights (g,) of half of each recording's groups, else 0."""
    rng = np.random.default_rng(0)
    for _ in range(count):
        sides = np.zeros((2, len(weights)))
        for groups in np.split(np.arange(len(weights)), [split]):
            order = rng.permutation(groups)
            half = len(order) // 2 + (len(order) % 2 and rng.integers(2))
            for side, part in zip(sides, np.split(order, [half])):
                side[part] = weights[part]
        yield sides


def floor_of_halves(one, two, trust=1.0):
    """Return mean and standard deviation of the mean of D between mixed halves, eq. (144)."""
    # Both hold as much of either recording, brought to one level, so what distinguishes the
    # recordings does not distinguish them; periodic, bursting or slowly varying excitation enters
    # with its own scatter.
    groups = np.concatenate([one.groups, two.groups])
    weights = np.concatenate([one.weights, two.weights])
    flat, n = groups.reshape(len(groups), -1), one.cut.freedom(1.0)
    target = 1.0 / (n * one.weights.sum()) + 1.0 / (n * two.weights.sum())
    draws = []
    for sides in mixed_halves(weights, len(one), SPLITS):
        totals = sides.sum(axis=1)
        means = ((sides / totals[:, None]) @ flat).reshape(2, *groups.shape[1:])
        bands = divergence(*means, *(n * totals))
        draws.append(np.mean(bands * trust) * target / np.sum(1.0 / (n * totals)))
    return float(np.mean(draws)), float(np.std(draws))
