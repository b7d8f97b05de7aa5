"""Score all forms at once, with the scatter that the recordings themselves have, eq. (158)."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.comparison import ScoreTest
from ssi_ros.gap.nominal.modal.fit import LEVEL_STEPS, whitened, whitener
from ssi_ros.gap.nominal.modal.mixed_halves import mixed_halves
from ssi_ros.gap.nominal.modal.prediction import predict
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.tails import norm, student, tail_of_largest

SPLITS = 1000           # mixed halves
MOST_ALIKE = 0.8        # correlation of neighbouring groups
LEAST_OWN = 0.31        # of a template that no level makes: cosine 0.95 with what one makes


@dataclass(frozen=True, eq=False)
class ModalScoreTest(ScoreTest):
    """
    Scores of every coordinate of every form; a label is the form, once for each coordinate.

    `tracks`, shape (t, g), are the scores in every group of the record against the mean of the
    reference, in standard deviations of a group.
    """

    tracks: np.ndarray = None

    @property
    def forms(self):
        """Forms that were scored, each once."""
        return tuple(dict.fromkeys(self.labels))


def score_forms(nominal, base, one, two, forms, repeats=False):
    """
    Score forms around `base`, the fitted level, a `ModalScoreTest`.

    z is standardised by the larger of theoretical and observed scatter; a gain is the likelihood
    that one step of all coordinates of a form would gain, less their number. `repeats` says that a
    periodic excitation makes groups resemble each other.
    """
    n_one, n_two = one.freedom, two.freedom
    pooled = (n_one * base.prediction.mean + n_two * two.mean) / (n_one + n_two)
    lower = whitener(np.linalg.cholesky(pooled), nominal.trust)
    level, noise = np.exp(base.x[0]), base.x[1] * np.diag(nominal.floor)
    # around the reference itself its own scatter would be in the templates
    around = nominal.with_spectrum((pooled - noise) / level)
    templates, owner = _templates(around, base.x, forms, lower)
    usable = np.any(templates, axis=1)
    parts = [templates @ whitened(level * g + noise, lower) for g in one.groups]
    parts += [templates @ whitened(g, lower) for g in two.groups]
    scores = np.array(parts).T                      # (p, groups of both)
    weights, split = np.concatenate([one.weights, two.weights]), len(one)
    before = _mean(scores[:, :split], weights[:split])
    difference = _mean(scores[:, split:], weights[split:]) - before
    theory, law = np.sqrt(1 / n_one + 1 / n_two), np.sqrt(nominal.law)
    spread = _spread(scores, weights, split, (n_one, theory))
    # the scatter of a template of few bands is known from few groups only: Student's tail
    power = np.square(templates).reshape(len(templates), one.cut.bands, -1).sum(axis=2)
    freedom = (len(weights) - 2) / np.maximum(np.square(power).sum(axis=1), 1e-12)

    def standard(difference):
        raw = np.abs(difference / spread)
        return np.where(usable, np.minimum(norm.isf(student.sf(raw, freedom)), raw), 0.0)
    # mixed halves differ less than the sides where neighbours are alike, or levels a little off
    alike = np.sqrt(_alike(scores[:, :split])) if repeats else 1.0
    z = np.sign(difference) * standard(difference / alike / np.sqrt(
        1 + (nominal.law - 1) * np.square(theory / spread)))
    largest = _largest_by_chance(scores, weights, split, standard)
    gains = np.array([_gain(templates[owner == k], difference[owner == k] / theory / law)
                      for k in range(len(forms))])[owner]
    tracks = (scores[:, split:] - before[:, None]) * np.sqrt(
        weights[split:] * two.cut.freedom(1.0))
    labels = tuple(forms[k] for k in owner)
    return ModalScoreTest(
        labels, tuple((f.effect, *f.equivalents) for f in labels), z, np.zeros(len(z), bool),
        gains, tail_of_largest(np.abs(z).max(), largest, _independent(templates[usable])),
        tracks=tracks)


def _spread(scores, weights, split, expected):
    """Return the standard deviation of a difference of sides, with a reference that varies."""
    (n_one, theory), sides = expected, (np.s_[:split], np.s_[split:])
    observed = np.sqrt(sum(_variance(scores[:, side], weights[side]) for side in sides))
    walk = _random_walk(scores[:, :split], weights[:split], n_one)
    return np.sqrt(np.maximum(observed, theory) ** 2 + walk)


def _largest_by_chance(scores, weights, split, standard):
    """Return the largest scores between mixed halves, where nothing distinguishes the sides."""
    sides = [s / s.sum(axis=1, keepdims=True) for s in mixed_halves(weights, split, SPLITS)]
    return np.array([standard(scores @ (s[1] - s[0])).max() for s in sides])


def _templates(nominal, x, forms, lower):
    """Return the unit changes of the spectrum by every coordinate, nuisances projected out."""
    predicted = predict(nominal, (), x).mean
    rows = [_row(nominal, (), x, predicted, j, s, lower) for j, s in enumerate(LEVEL_STEPS)]
    rows = rows if nominal.levels is None else [*nominal.levels, *rows]
    nuisance = np.linalg.qr(np.array(rows).T)[0].T
    templates, owner, whole = [], [], []
    for k, form in enumerate(forms):
        for j, number in enumerate(form.numbers):
            start = np.append(x, np.zeros(len(form.numbers)))
            row = _row(nominal, (form,), start, predicted, 2 + j, number.start, lower)
            templates.append(row - nuisance.T @ (nuisance @ row))
            whole.append(np.linalg.norm(row))
            owner.append(k)
    templates = np.array(templates)
    sizes = np.linalg.norm(templates, axis=1)
    usable = (sizes > 1e-9 * sizes.max()) & (sizes > LEAST_OWN * np.array(whole))
    templates[usable] /= sizes[usable, None]
    templates[~usable] = 0.0
    return templates, np.array(owner)


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
    """Return by what factor neighbours that resemble each other raise a variance, eq. (158a)."""
    # Noise of a joint under a periodic excitation is much the same in the next period.
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


def _random_walk(scores, weights, freedom):
    """Return the variance that a random walk of the reference adds, by that of its halves."""
    # Between two recordings a random walk goes twice as far as between two halves of one.
    middle = len(weights) // 2
    if middle < 2:
        return 0.0
    parts = (scores[:, :middle], weights[:middle]), (scores[:, middle:], weights[middle:])
    way = _mean(*parts[1]) - _mean(*parts[0])
    chance = np.maximum(sum(_variance(*p) for p in parts), 4 / freedom)
    certain = LIMITS.halves_of_reference.value ** 2 * chance
    return LIMITS.random_walk.value * np.maximum(way ** 2 - certain, 0.0)


def _independent(templates):
    """Return how many independent tests the scores of some templates are at least."""
    values = np.linalg.eigvalsh(templates @ templates.T)
    return float(values.sum() ** 2 / np.sum(values ** 2))
