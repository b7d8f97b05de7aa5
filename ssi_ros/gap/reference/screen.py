"""Score all forms at once, with the scatter that the recordings themselves have, eq. (158)."""
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm, t as student

from ssi_ros.gap.reference.distance import mixed_halves
from ssi_ros.gap.reference.fit import LEVEL_STEPS, predict, whitened, whitener
from ssi_ros.gap.reference.steady import WANDERS

SPLITS = 1000
MOST_ALIKE = 0.8        # correlation of neighbouring groups
SURE = 2.0              # standard deviations between the halves of a reference that are chance


@dataclass(frozen=True, eq=False)
class Screen:
    """
    Scores of every coordinate of every form around the fitted level.

    Attributes
    ----------
    forms : tuple of Form
        What was scored.
    owner : ndarray of int, shape (p,)
        Form of each coordinate.
    z : ndarray, shape (p,)
        Scores, standardised by the larger of theoretical and observed scatter.
    gains : ndarray, shape (f,)
        Likelihood that one step would gain, less the number of coordinates.
    p_value : float
        Chance of so large a score without a cause.
    tracks : ndarray, shape (p, g)
        Score of each coordinate in every group of the record against the mean of the reference,
        in standard deviations of a group.

    """

    forms: tuple
    owner: np.ndarray
    z: np.ndarray
    gains: np.ndarray
    p_value: float
    tracks: np.ndarray


def screen(nominal, base, one, two, forms, repeats=False, seed=0):
    """
    Score forms.

    Parameters
    ----------
    nominal : Nominal
        The reference.
    base : Fitted
        Level and noise alone.
    one, two : Spectra
        Reference and record.
    forms : tuple of Form
        What to score.
    repeats : bool
        Whether a periodic excitation makes groups resemble each other.
    seed : int
        Of the mixed halves.

    Returns
    -------
    Screen

    """
    n_one, n_two = one.freedom, two.freedom
    pooled = (n_one * base.prediction.mean + n_two * two.mean) / (n_one + n_two)
    lower = whitener(np.linalg.cholesky(pooled), nominal.trust)
    level, noise = np.exp(base.x[0]), base.x[1] * np.diag(nominal.floor)
    # around the reference itself its own scatter would be in the templates
    nominal = nominal.with_spectrum((pooled - noise) / level)
    predicted = predict(nominal, (), base.x).mean
    rows = [_row(nominal, (), base.x, predicted, j, s, lower) for j, s in enumerate(LEVEL_STEPS)]
    nuisance = np.linalg.qr(np.array(rows).T)[0].T
    templates, owner = [], []
    for k, form in enumerate(forms):
        for j, number in enumerate(form.numbers):
            x = np.append(base.x, np.zeros(len(form.numbers)))
            row = _row(nominal, (form,), x, predicted, 2 + j, number.start, lower)
            templates.append(row - nuisance.T @ (nuisance @ row))
            owner.append(k)
    templates, owner = np.array(templates), np.array(owner)
    sizes = np.linalg.norm(templates, axis=1)
    usable = sizes > 1e-9 * sizes.max()
    templates[usable] /= sizes[usable, None]
    parts = [templates @ whitened(level * g + noise, lower) for g in one.groups]
    parts += [templates @ whitened(g, lower) for g in two.groups]
    scores = np.array(parts).T                      # (p, groups of both)
    weights = np.concatenate([one.weights, two.weights])
    split = len(one)
    difference = (_mean(scores[:, split:], weights[split:])
                  - _mean(scores[:, :split], weights[:split]))
    theory = np.sqrt(1 / n_one + 1 / n_two)
    seen = np.sqrt(_variance(scores[:, :split], weights[:split])
                   + _variance(scores[:, split:], weights[split:]))
    spread = np.maximum(seen, theory)
    spread = np.sqrt(spread ** 2 + _wandering(scores[:, :split], weights[:split], n_one))
    # the scatter of a template of few bands is known from few groups only: Student's tail
    power = np.square(templates).reshape(len(templates), one.cut.bands, -1).sum(axis=2)
    freedom = (len(weights) - 2) / np.maximum(np.square(power).sum(axis=1), 1e-12)

    def standard(difference):
        raw = np.abs(difference / spread)
        return np.where(usable, np.minimum(norm.isf(student.sf(raw, freedom)), raw), 0.0)
    # groups of both sides in turn differ less than the sides where neighbours are alike
    alike = np.sqrt(_alike(scores[:, :split])) if repeats else 1.0
    z = np.sign(difference) * standard(difference / alike)
    # the largest score between mixed halves, where nothing parts the sides
    rng = np.random.default_rng(seed)
    largest = np.empty(SPLITS)
    for i in range(SPLITS):
        sides = mixed_halves(split, len(two), rng) * weights
        sides /= sides.sum(axis=1, keepdims=True)
        largest[i] = standard(scores @ (sides[1] - sides[0])).max()
    gains = np.array([_gain(templates[owner == k], difference[owner == k] / theory)
                      for k in range(len(forms))])
    own = scores[:, split:] - _mean(scores[:, :split], weights[:split])[:, None]
    tracks = own * np.sqrt(weights[split:] * two.cut.freedom(1.0))
    p_value = _tail(np.abs(z).max(), largest, _independent(templates[usable]))
    return Screen(tuple(forms), owner, z, gains, p_value, tracks)


def _row(nominal, forms, x, predicted, j, step, lower):
    moved = np.array(x, float)
    moved[j] += step
    return whitened(predict(nominal, forms, moved).mean - predicted, lower)


def _mean(scores, weights):
    return scores @ weights / weights.sum()


def _variance(scores, weights):
    """Return the squared spread of a weighted mean, from the scatter of the groups."""
    shares = weights / weights.sum()
    away = scores - (scores @ shares)[:, None]
    return (away ** 2 * shares).sum(axis=1) / (len(weights) - 1)


def _alike(scores):
    """
    Return how much more the mean of groups scatters that resemble their neighbours, eq. (158a).

    A rattle under a periodic excitation is much the same in the next period.
    """
    away = scores - scores.mean(axis=1, keepdims=True)
    power = np.maximum((away ** 2).sum(axis=1), 1e-300)
    first = (away[:, 1:] * away[:, :-1]).sum(axis=1) / power
    # of independent groups it is -1 / n in the mean
    first = np.clip(first + 1 / away.shape[1], 0.0, MOST_ALIKE)
    return (1 + first) / (1 - first)


def _gain(rows, z):
    """Return half of the squared length of the scores in the space of some templates."""
    values, vectors = np.linalg.eigh(rows @ rows.T)
    kept = values > 1e-3 * values.max()
    along = (vectors[:, kept].T @ z) / np.sqrt(values[kept])
    return float(np.sum(along ** 2) / 2 - kept.sum())


def _wandering(scores, weights, freedom):
    """
    Return the variance that a reference which wanders adds, from the way between its halves.

    Between two recordings a random walk goes twice as far as between two halves of one.
    """
    middle = len(weights) // 2
    if middle < 2:
        return 0.0
    parts = (scores[:, :middle], weights[:middle]), (scores[:, middle:], weights[middle:])
    way = _mean(*parts[1]) - _mean(*parts[0])
    chance = np.maximum(sum(_variance(*p) for p in parts), 4 / freedom)
    return WANDERS * np.maximum(way ** 2 - SURE ** 2 * chance, 0.0)


def _independent(templates):
    """Return how many independent tests the scores of some templates are at least."""
    values = np.linalg.eigvalsh(templates @ templates.T)
    return float(values.sum() ** 2 / np.sum(values ** 2))


def _tail(found, largest, least):
    """Return the chance of a score; beyond what the halves can tell, by the number of tests."""
    share = np.mean(largest >= found)
    if share > 20 / SPLITS:
        return float(share)
    tests = max(np.log(0.5) / np.log1p(-2 * norm.sf(np.median(largest))), least)
    return float(-np.expm1(tests * np.log1p(-2 * norm.sf(found))))
