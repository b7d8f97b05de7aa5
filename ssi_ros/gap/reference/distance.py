"""The distance of two recordings, its floor in theory and from the data, eq. (141) to (144)."""
from dataclasses import dataclass

import numpy as np
from scipy.special import digamma

SPLITS = 100            # of the groups into two mixed halves


@dataclass(frozen=True, eq=False)
class Distance:
    """
    The gap of two recordings.

    Attributes
    ----------
    value : float
        Mean over the bands of D, eq. (141) [nats].
    floor, floor_std : float
        Its mean and standard deviation where both come from one process.

    """

    value: float
    floor: float
    floor_std: float

    @property
    def deviations(self):
        """How many standard deviations the gap is above its floor."""
        return (self.value - self.floor) / self.floor_std


def divergence(one, two, n_one, n_two):
    """
    Return D of every band: the likelihood ratio of one against two matrices, eq. (141).

    Parameters
    ----------
    one, two : ndarray, shape (..., l, l)
        Mean spectra.
    n_one, n_two : float or ndarray, shape (...,)
        Independent spectra behind them.

    Returns
    -------
    ndarray, shape (...,)
        About half of the squared relative difference; 0 where they are equal.

    """
    total = n_one + n_two
    share = np.asarray(n_one / total)[..., None, None]
    pooled = share * one + (1 - share) * two
    ratio = total * _logdet(pooled) - n_one * _logdet(one) - n_two * _logdet(two)
    return ratio * total / (n_one * n_two)


def _logdet(matrices):
    return np.linalg.slogdet(matrices)[1]


def theory_floor(n_one, n_two, channels):
    """Return mean and standard deviation of D of Gaussian recordings, eq. (142), of every n."""
    total, i = n_one + n_two, np.arange(channels)
    scale = total / (n_one * n_two)

    def mean_logdet(n):
        n = np.asarray(n, float)
        return np.sum(digamma(n[..., None] - i), axis=-1) - channels * np.log(n)

    mean = scale * (total * mean_logdet(total) - n_one * mean_logdet(n_one)
                    - n_two * mean_logdet(n_two))
    # the three terms are dependent; to leading order D is chi-squared of l^2 degrees
    inflation = mean / (scale * channels ** 2 / 2)
    return mean, scale * np.sqrt(channels ** 2 / 2) * inflation


def mixed_halves(count_one, count_two, rng):
    """
    Draw two sides that hold half of each recording, so that no effect parts them.

    Returns
    -------
    weights : ndarray, shape (2, count_one + count_two)
        0 or 1.

    """
    sides = np.zeros((2, count_one + count_two))
    for first, count in ((0, count_one), (count_one, count_two)):
        order = first + rng.permutation(count)
        half = count // 2 + (count % 2 and rng.integers(2))
        sides[0, order[:half]] = 1.0
        sides[1, order[half:]] = 1.0
    return sides


def data_floor(one, two, trust=1.0, seed=0):
    """
    Return mean and standard deviation of the mean of D between mixed halves, eq. (144).

    Both halves hold as much of either recording, so whatever parts the recordings does not part
    them; periodic, bursting or slowly wandering excitation enters with the scatter that it has.

    Parameters
    ----------
    one, two : Spectra
        The recordings, already of one level.
    trust : float or ndarray, shape (b,)
        As in Nominal.
    seed : int
        Of the halves drawn.

    Returns
    -------
    floor, floor_std : float
    draws : ndarray, shape (s,)

    """
    rng = np.random.default_rng(seed)
    groups = np.concatenate([one.groups, two.groups])
    weights = np.concatenate([one.weights, two.weights])
    shape = groups.shape[1:]
    flat = groups.reshape(len(groups), -1)
    n = one.cut.freedom(1.0)
    target = 1.0 / (n * one.weights.sum()) + 1.0 / (n * two.weights.sum())
    draws = []
    for _ in range(SPLITS):
        sides = mixed_halves(len(one), len(two), rng) * weights
        totals = sides.sum(axis=1)
        means = (sides / totals[:, None]) @ flat
        bands = divergence(*means.reshape(2, *shape), n * totals[0], n * totals[1])
        draws.append(np.mean(bands * trust) * target / np.sum(1.0 / (n * totals)))
    return float(np.mean(draws)), float(np.std(draws)), np.array(draws)


def measure(one, two, prediction=None, trust=1.0):
    """
    Measure the gap between two recordings, eq. (141).

    Parameters
    ----------
    one, two : Spectra
        Reference and record.
    prediction : Prediction, optional
        What the reference becomes with an effect; its own mean if not given.
    trust : float or ndarray, shape (b,)
        As in Nominal: D is multiplied with it.

    Returns
    -------
    Distance

    """
    m = two.freedom
    mean, n = (one.mean, np.full(one.cut.bands, one.freedom)) if prediction is None else (
        prediction.mean, prediction.freedom(one.freedom))
    # in units of what is parted by reference and record themselves
    scale = (1 / one.freedom + 1 / m) / (1 / n + 1 / m)
    bands = scale * trust * divergence(mean, two.mean, n, m)
    floor, std = (scale * v for v in theory_floor(n, m, mean.shape[-1]))
    return Distance(float(bands.mean()), float(floor.mean()),
                    float(np.sqrt(np.sum(std ** 2)) / len(bands)))
