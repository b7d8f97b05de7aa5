"""Fit forms of effects to two recordings by scores around both, eq. (150) to (152)."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.reference.distance import divergence
from ssi_ros.gap.reference.pieces import silent

STEPS = 12
ENOUGH = 2e-2           # gain of the likelihood below which a fit has arrived
HALVINGS = 6            # of a step that goes too far
NODES = 6               # of the integral of a score
BLUNT = 30.0            # nats that distances may be wrong by, as smooth predictions go
AWAY = 1.5              # of the level from the median that tells it
QUIETER, LOUDER = 0.9, 9.0      # of the noise of the reference: what a nuisance may change
LEVEL_STEPS = 0.01, 0.05        # of level and noise, for a difference quotient
MEDIAN = np.pi / 2      # variance of a median over that of a mean
PROBE = 1e-2            # share of a way for a difference quotient
SHARES = (0.05, 1.5)    # range of the part of a prediction that scatters


@dataclass(frozen=True, eq=False)
class Prediction:
    """
    What the spectrum of a reference becomes.

    Attributes
    ----------
    mean : ndarray, shape (b, l, l)
        S' of eq. (145).
    scatters : ndarray, shape (b, l, l)
        The part of it that scatters as the reference does; the rest is smooth.

    """

    mean: np.ndarray
    scatters: np.ndarray

    def freedom(self, n_one):
        """Return how many independent spectra it is as good as, shape (b,), eq. (150)."""
        # the share in all directions, tr S'^-1 F / l
        share = np.einsum('bii->b', np.linalg.solve(self.mean, self.scatters)).real
        width = self.mean.shape[-1]
        least = min(n_one, width + 1.0)         # fewer have no determinant
        return np.maximum(n_one / np.clip(share / width, *SHARES) ** 2, least)

    @property
    def possible(self):
        """Whether it is a spectrum: positive definite in every band."""
        return bool(np.all(np.linalg.eigvalsh(self.mean)[:, 0] > 0))


@dataclass(frozen=True, eq=False)
class Fitted:
    """
    Forms at their best coordinates.

    Attributes
    ----------
    forms : tuple of Form
        What acts, one after the other.
    x : ndarray, shape (2 + p,)
        Logarithm of the level, change of all noise floors in floors, coordinates of the forms.
    covariance : ndarray, shape (2 + p, 2 + p)
        Inverse of the information.
    likelihood : float
        Logarithm over that of the level alone, by its slopes, eq. (151).
    far : float
        The same by the distances themselves, for gaps so large that slopes mean little.
    prediction : Prediction
        What the reference becomes.

    """

    forms: tuple
    x: np.ndarray
    covariance: np.ndarray
    likelihood: float
    far: float
    prediction: Prediction

    def coordinates(self, index):
        """Return the slice of x that belongs to one of the forms."""
        first = 2 + sum(len(f.numbers) for f in self.forms[:index])
        return slice(first, first + len(self.forms[index].numbers))


def predict(nominal, forms, x):
    """Return what the spectrum of a reference becomes, eq. (145), a Prediction."""
    noise = np.diag(nominal.floor)
    # filters act on all that scatters, and the noise that they should have left is put back
    spectrum, still, at = nominal.spectrum, noise, 2
    fixed = np.zeros_like(nominal.spectrum)
    for form in forms:
        numbers = x[at:at + len(form.numbers)]
        gain, added = form.change(nominal, numbers)
        if gain is not None:
            spectrum = filtered(gain, spectrum)
            still = still if form.whole else filtered(gain, still)
        if added is not None:
            fixed = fixed + added
        at += len(form.numbers)
    level = np.exp(x[0])
    return Prediction(level * (spectrum + fixed + noise - still) + x[1] * noise, level * spectrum)


def filtered(gain, spectrum):
    """Return G S G^H, averaged over the first axis of G of shape (k, b, l, l), if it has one."""
    found = gain @ spectrum @ gain.conj().swapaxes(-1, -2)
    return found.mean(axis=0) if gain.ndim == 4 else found


def whitener(factor, trust):
    """Return L^-1 of a Cholesky factor L, smaller where a band is trusted less, (b, l, l)."""
    return np.linalg.inv(factor) * np.power(trust, 0.25)[:, None, None]


def whitened(matrices, lower):
    """Return L^-1 M L^-H as real vectors with the same inner product, (b l l,)."""
    turned = lower @ matrices @ lower.conj().swapaxes(-1, -2)
    # the sum of real and imaginary part keeps tr A B: the cross terms cancel by symmetry
    return (turned.real + turned.imag).reshape(-1)


class _Place:
    """
    Where a fit stands: prediction, pooled estimate of both spectra, whitened difference.

    Both recordings scatter. Templates around the reference alone would repeat its scatter, and a
    form that makes the prediction smoother would win by that; around the pooled estimate they
    do not.
    """

    def __init__(self, nominal, forms, x, seen, n_one, n_two):
        self.forms, self.x = forms, x
        self.prediction = predict(nominal, forms, x)
        mean = self.prediction.mean
        part = n_one / (n_one + n_two)
        pooled = part * mean + (1 - part) * seen
        self.root = np.sqrt(n_one * n_two / (n_one + n_two))
        try:
            factor = np.linalg.cholesky(pooled)
            bend = factor @ np.linalg.inv(np.linalg.cholesky(mean))
        except np.linalg.LinAlgError:
            self.possible = False
            return
        self.possible = True
        self.lower = whitener(factor, nominal.trust)
        self.around = nominal.with_spectrum(filtered(bend, nominal.spectrum))
        self.base = predict(self.around, forms, x).mean
        self.rest = self.weighted(seen - mean)

    def weighted(self, matrices):
        """Return matrices as vectors whose products are those of the information."""
        return self.root * whitened(matrices, self.lower)

    def slope(self, direction, step):
        """Return the change of the prediction along a direction of x."""
        moved = predict(self.around, self.forms, self.x + step * direction)
        return self.weighted(moved.mean - self.base) / step

    def gradient(self):
        """Return score and information, eq. (152)."""
        steps = [*LEVEL_STEPS] + [n.start / 10 for f in self.forms for n in f.numbers]
        rows = np.array([self.slope(e, s) for e, s in zip(np.eye(len(self.x)), steps)])
        return rows @ self.rest, rows @ rows.T


def fit(nominal, seen, n_one, n_two, forms=(), start=None, steps=STEPS, origin=None):
    """
    Solve for level, noise and the coordinates of forms by damped Fisher scoring, eq. (152).

    Parameters
    ----------
    nominal : Nominal
        The reference.
    seen : ndarray, shape (b, l, l)
        Mean spectrum of the record.
    n_one, n_two : float
        Independent spectra behind both.
    forms : tuple of Form
        What may act.
    start : ndarray, shape (2 + p,), optional
        Where to begin.
    steps : int
        At most.
    origin : ndarray, shape (2,), optional
        Level and noise alone, from which the likelihood is counted; without, it is left at 0.

    Returns
    -------
    Fitted

    """
    numbers = [n for f in forms for n in f.numbers]
    level = level_of(nominal.spectrum, seen)[0]
    if start is None:
        start = np.array([level, 0.0] + [n.start for n in numbers])
    # noise may go, or grow within reason: as a nuisance it shall not stand in for anything
    low = np.array([level - AWAY, -QUIETER * np.exp(level)] + [n.low for n in numbers])
    high = np.array([level + AWAY, LOUDER * np.exp(level)] + [n.high for n in numbers])
    start = np.clip(start, low, high)
    problem = (seen, n_one, n_two)
    here = _Place(nominal, forms, np.array(start, float), *problem)
    if not here.possible:               # of other groups: more noise taken away than there is
        here = _Place(nominal, forms, np.append(start[0], np.zeros(len(start) - 1)), *problem)
    if not here.possible:               # nor without numbers: these forms cannot be
        return Fitted(tuple(forms), here.x, np.eye(len(start)), -np.inf, -np.inf, here.prediction)
    score, information = here.gradient()
    for _ in range(steps):
        move = _solved(information, score)
        if score @ move < ENOUGH:
            break
        for _ in range(HALVINGS):
            there = _Place(nominal, forms, np.clip(here.x + move, low, high), *problem)
            if there.possible:
                new_score, new_information = there.gradient()
                # the likelihood along the step, by its slopes at both ends
                if (score + new_score) @ (there.x - here.x) > 0:
                    break
            move = move / 3
        else:
            break
        here, score, information = there, new_score, new_information
    scale = np.sqrt(np.maximum(np.diag(information), 1e-12))
    covariance = np.linalg.pinv(information / np.outer(scale, scale)) / np.outer(scale, scale)
    gain = far = 0.0
    if origin is not None:
        base = np.append(origin, np.zeros(len(numbers)))
        ratios = [_ratio(p, problem, nominal.trust) for p in (
            predict(nominal, (), origin), predict(nominal, forms, base), here.prediction)]
        # what a form adds at x = 0, as rails do, has no way along which to go
        gain = _gain(nominal, forms, base, here.x, problem) + ratios[1] - ratios[0]
        far = ratios[2] - ratios[0]
        # a way through what cannot be tells nothing
        gain = float(np.clip(gain, far - BLUNT, far + BLUNT)) if np.isfinite(gain) else far
    return Fitted(tuple(forms), here.x, covariance, gain, far, here.prediction)


def _solved(information, score):
    scale = np.sqrt(np.maximum(np.diag(information), 1e-12))
    inner = information / np.outer(scale, scale) + 1e-4 * np.eye(len(scale))
    return np.linalg.solve(inner, score / scale) / scale


def _ratio(prediction, problem, trust):
    """Return the likelihood ratio of one common spectrum against two, eq. (141) with (150)."""
    seen, n_one, n_two = problem
    if not prediction.possible:
        return -np.inf
    bands = divergence(prediction.mean, seen, n_one, n_two) * n_one * n_two / (n_one + n_two)
    # a smoother prediction is nearer to anything, by as much as it scatters less
    # and one that scatters more has no merit of it
    share = np.maximum(1 - n_one / prediction.freedom(n_one), 0.0)
    smooth = seen.shape[-1] ** 2 / 2 * n_two / (n_one + n_two) * share
    return -float(np.sum(trust * (bands + smooth)))


def cleared(nominal, base, one, two, form):
    """Return the likelihood that the level alone gains where a form leaves cells out."""
    if form.crossed is None:
        return 0.0
    before, after = (_ratio(base.prediction, (s.mean, one.freedom, two.freedom), nominal.trust)
                     for s in (two, two.without(form.crossed)))
    # what is left of a band scatters more
    kept = ~form.crossed.T @ two.weights / two.weights.sum()
    scatter = two.mean.shape[-1] ** 2 / 2 * one.freedom / (one.freedom + two.freedom)
    return after - before + float(np.sum(nominal.trust * scatter * (1 / kept - 1)))


def _gain(nominal, forms, base, x, problem):
    """Return the integral of the score from the level alone to a fit, eq. (151)."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    total = 0.0
    for node, weight in zip((nodes + 1) / 2, weights / 2):
        place = _Place(nominal, forms, base + node * (x - base), *problem)
        if not place.possible:
            return -np.inf
        total += weight * float(place.slope(x - base, PROBE) @ place.rest)
    return total


def level_of(one, two, n_one=np.inf, n_two=np.inf):
    """
    Return the logarithm of the level of one mean spectrum over another, and its spread.

    A median over the bands that are not silent, each with one vote: where few modes hold all of
    the power, a mean by power would be that of a few bands, and scatter as they do.

    Parameters
    ----------
    one, two : ndarray, shape (b, l, l)
        Mean spectra of reference and record.
    n_one, n_two : float
        Independent spectra behind each band of them.

    Returns
    -------
    level, std : float

    """
    levels, votes = [], []
    for before, after in zip(*(np.einsum('bii->ib', s).real for s in (one, two))):
        loud = ~(silent(before) | silent(after))
        loud = loud if loud.any() else ~silent(before)
        levels.append(np.median(np.log(after[loud] / before[loud])))
        votes.append(np.count_nonzero(loud))
    std = np.sqrt((1 / n_one + 1 / n_two) * MEDIAN / np.median(votes))
    # a channel with another gain shall not decide
    return float(np.median(levels)), float(std)
