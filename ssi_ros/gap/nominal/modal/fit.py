"""Fit forms of effects to two recordings by scores around both, eq. (150) to (152)."""
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ssi_ros.fisher_scoring import covariance, held_inside, maximise
from ssi_ros.gap.inference.goodness_of_fit import divergence
from ssi_ros.gap.inference.thresholds import LIMITS
from ssi_ros.gap.nominal.forms.candidate import slices_of
from ssi_ros.gap.nominal.modal.prediction import (
    Averages, bands_between, changes_of, filtered_by, predict, Prediction)
from ssi_ros.gap.spectra.band_averages import level_of
from ssi_ros.hermitian import filtered, hermitian, inverse_root, least_share, white, white_vectors
from ssi_ros.levels.forces import bounded, turning

STEPS = 12
NODES = 6               # of the integral of a score
LEVEL_STEPS = 0.01, 0.05        # of level and noise, on both sides
PROBE = 1e-2            # share of a way for a difference quotient
LITTLE = 0.05           # of the noise floor, more of it; at none the distance has a kink
NEARLY_ALL = 0.9        # of the noise: with none there is no spectrum
MOST_TURN = 4.0         # power by which levels may differ from those that a fit began at


@dataclass(frozen=True, eq=False)
class Fitted:
    """Forms at their best coordinates."""

    forms: tuple            # what acts, one after the other
    x: np.ndarray           # (2 + p,), log level, change of all noise in floors, coordinates
    covariance: np.ndarray  # (2 + p, 2 + p), inverse of the information
    likelihood: float       # logarithm over that of the level alone, by its slopes, eq. (151)
    far: float              # by the distances, where slopes around both mean little
    prediction: Prediction  # what the reference becomes
    turn: np.ndarray = None         # (b, l, l), filter by which its levels are those of the record


def whitener(factor, trust):
    """Return L^-1 of a Cholesky factor L, smaller in a band of less weight, (b, l, l)."""
    return np.linalg.inv(factor) * np.power(trust, 0.25)[:, None, None]


def whitened(matrices, lower):
    """Return L^-1 M L^-H as real vectors with the same inner product, (b l l,)."""
    return white_vectors(lower, matrices).ravel()


class _Place:
    """
    Where a fit stands: prediction, pooled estimate of both spectra, whitened residual.

    Both recordings scatter. Templates around the reference alone would repeat its scatter, and a
    form that makes the prediction smoother would win by that; around the pooled estimate they
    do not. So only slopes of the likelihood are known; but `far` from the record these may point
    away from it, and the distance counts. LinAlgError where no such spectrum exists.
    """

    def __init__(self, nominal, forms, x, record, bounds=None, far=False):
        self.nominal, self.forms, self.x, self.record = nominal, forms, x, record
        self.bounds, self.far = bounds, far
        self.prediction = predict(nominal, forms, x)
        mean = self.prediction.mean
        part = record.n_one / (record.n_one + record.n_two)
        factor = np.linalg.cholesky(part * mean + (1 - part) * record.mean)
        if not self.prediction.possible:
            raise np.linalg.LinAlgError('the prediction is not positive definite')
        self.root, self.factor = np.sqrt(record.weight), factor
        self.lower = whitener(factor, nominal.trust)
        self.raw = self.root * whitened(record.mean - mean, self.lower)
        self.residual = self.without_levels(self.raw)
        self.value = ratio(self.levelled, record, nominal.trust) if far else None

    def at(self, x):
        """Return the place at other coordinates, kept inside their ranges, or None."""
        try:
            return _Place(self.nominal, self.forms, np.clip(x, *self.bounds), self.record,
                          self.bounds, self.far)
        except np.linalg.LinAlgError:
            return None

    def without_levels(self, vector):
        """Return what of a whitened change no level makes, eq. (150a)."""
        basis = self.nominal.levels
        return vector if basis is None else vector - basis.T @ (basis @ vector)

    @property
    def levelled(self):
        """Return the prediction at the levels of the record."""
        return self.prediction.turned(self.turn)

    @cached_property
    def turn(self):
        """Return the filter (b, l, l) that brings the prediction to the levels of the record."""
        basis = self.nominal.levels
        if basis is None:
            return None
        change = hermitian((basis.T @ (basis @ self.raw) / self.root).reshape(self.lower.shape))
        mean, back = self.prediction.mean, np.linalg.inv(self.lower)
        return turning(mean, bounded(mean + white(back, change), mean, 1 / MOST_TURN, MOST_TURN))

    @cached_property
    def around(self):
        """Return the reference that would become the pooled estimate, its changes and the mean."""
        bend, gain = self.factor @ inverse_root(self.prediction.mean), self.prediction.gain
        if gain is not None:        # filters act after it
            bend = np.linalg.solve(gain, bend @ gain)
        there = self.nominal.with_spectrum(filtered(bend, self.nominal.spectrum))
        changes = changes_of(there, self.forms, self.x)
        return there, changes, filtered_by(there, self.forms, changes, self.x).mean

    def slope(self, direction, step):
        """Return the change of the prediction along a direction of x."""
        around, _, base = self.around
        moved = predict(around, self.forms, self.x + step * direction).mean
        return self._as_slope((moved - base) / step)

    def _as_slope(self, change, bands=slice(None)):
        """Return a change of the prediction, in some bands, as what the residual is of."""
        found = np.zeros((len(self.lower), self.lower.shape[-1] ** 2))
        if len(change):
            found[bands] = self.root * white_vectors(self.lower[bands], change)
        return self.without_levels(found.ravel())

    def _slopes(self):
        """Return the changes along all coordinates, (2 + p, b l l)."""
        around, changes, base = self.around
        noise = np.diag(self.nominal.floor)
        yield self._as_slope(base - self.x[1] * noise)
        yield self._as_slope(np.broadcast_to(noise, base.shape))
        for k, (form, at) in enumerate(zip(self.forms, slices_of(self.forms))):
            for number, step in zip(np.eye(len(form.numbers)), form.steps):
                there = form.change(around, self.x[2:][at] + step * number)
                bands = bands_between(changes[k], there)
                moved = filtered_by(around, self.forms, [
                    *changes[:k], there, *changes[k + 1:]], self.x, bands).mean
                yield self._as_slope((moved - base[bands]) / step, bands)

    def gradient(self):
        """Return score and information, eq. (152)."""
        return self._gradient

    @cached_property
    def _gradient(self):
        rows = np.array(list(self._slopes()))
        steps = np.concatenate([LEVEL_STEPS, *(f.steps for f in self.forms)])
        score = [self._rise(e) for e in np.diag(steps)] if self.far else rows @ self.residual
        return held_inside(self.x, self.bounds, np.array(score), rows @ rows.T)

    def _rise(self, step):
        """Return the slope of the value along a coordinate, by places on both sides of a step."""
        one, two = (self.at(self.x + s) or self for s in (step, -step))
        return (one.value - two.value) / max(np.sum(one.x - two.x), 1e-300)


def fit(nominal, record, forms=(), start=None, steps=STEPS, origin=None, far=False):
    """
    Solve for level, noise and coordinates of forms by damped Fisher scoring, (152), a `Fitted`.

    From `start` (2 + p,), in `steps` at most, to a record (Averages). The likelihood is counted
    from `origin` (2,), level and noise alone; without, it is 0. `far`, it climbs by the distance.
    """
    forms, numbers = tuple(forms), [n for f in forms for n in f.numbers]
    level = level_of(nominal.spectrum, record.mean)[0]
    # noise may vanish, or grow within reason: as a nuisance it shall not stand in for anything
    most = np.array([LIMITS.level_range.value, LIMITS.noise_growth.value * np.exp(level)])
    low = np.array([level - most[0], -LIMITS.noise_loss.value * np.exp(level)]
                   + [n.low for n in numbers])
    high = np.array([level + most[0], most[1]] + [n.high for n in numbers])
    caps = high - low
    low[1] = max(low[1], -NEARLY_ALL * np.exp(level) * least_share(
        nominal.spectrum, nominal.floor))
    if nominal.levels is not None:      # its noise is that of the record, and so is its level
        low[:2] = high[:2] = 0.0
    start = [level, 0.0] + [n.start for n in numbers] if start is None else start
    start = np.clip(np.array(start, float), low, high)
    # of other groups a start may take away more noise than there is: then without numbers
    for x in (start, np.append(start[0], np.zeros(len(start) - 1))):
        try:
            here = _Place(nominal, forms, x, record, (low, high), far)
            break
        except np.linalg.LinAlgError:
            continue
    else:
        return Fitted(forms, x, np.eye(len(x)), -np.inf, -np.inf, predict(nominal, forms, x))
    here, information = maximise(here, caps, steps)
    gain = far = 0.0
    if origin is not None:
        gain, far = _likelihood(nominal, here, np.append(origin, np.zeros(len(numbers))))
    return Fitted(forms, here.x, covariance(information, caps), gain, far, here.levelled,
                  here.turn)


def residual_of(nominal, record, fitted=None):
    """Return the whitened residual of a Fitted, or of the nominal itself, and its whitener."""
    here = _Place(nominal, *((fitted.forms, fitted.x) if fitted else ((), np.zeros(2))), record)
    return here.raw, here.lower


def _likelihood(nominal, here, base):
    """Return the likelihood over that of the level alone, by slopes and by distances."""
    usual = _Place(nominal, (), base[:2], here.record)
    ratios = [ratio(p, here.record, nominal.trust) for p in (
        usual.prediction, predict(nominal, here.forms, base), usual.levelled, here.levelled)]
    far = ratios[3] - ratios[2]
    # what a form adds at x = 0, as clipping does, has no way along which to integrate
    gain = _gain(nominal, here, base) + ratios[1] - ratios[0]
    # a way through spectra that cannot exist gives none; distances know of no other levels
    limit = LIMITS.smoothing.value if nominal.levels is None else np.inf
    return (float(np.clip(gain, far - limit, far + limit)) if np.isfinite(gain) else far), far


def ratio(prediction, record, trust):
    """Return the likelihood ratio of one common spectrum against two, eq. (141) with (150)."""
    if not prediction.possible:
        return -np.inf
    n_one, n_two = record.n_one, record.n_two
    bands = divergence(prediction.mean, record.mean, n_one, n_two) * record.weight
    # a smoother prediction is nearer to anything, by as much as it scatters less;
    # one that scatters more gains nothing by that
    share = np.maximum(1 - n_one / prediction.freedom(n_one), 0.0)
    smooth = record.mean.shape[-1] ** 2 / 2 * n_two / (n_one + n_two) * share
    return -float(np.sum(trust * (bands + smooth)))


def masking_gain(nominal, base, one, two, form):
    """Return the likelihood that the level alone gains where a form leaves cells out."""
    if form.masked is None:
        return 0.0
    before, after = (ratio(base.prediction, Averages(s.mean, one.freedom, two.freedom),
                           nominal.trust) for s in (two, two.without(form.masked)))
    # what remains of a band scatters more
    kept = ~form.masked.T @ two.weights / two.weights.sum()
    scatter = two.mean.shape[-1] ** 2 / 2 * one.freedom / (one.freedom + two.freedom)
    return after - before + float(np.sum(nominal.trust * scatter * (1 / kept - 1)))


def _gain(nominal, here, base):
    """Return the integral of the score from the level alone to a fit, eq. (151)."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    way, total = here.x - base, 0.0
    for node, weight in zip((nodes + 1) / 2, weights / 2):
        try:
            place = _Place(nominal, here.forms, base + node * way, here.record)
        except np.linalg.LinAlgError:
            return -np.inf
        total += weight * float(place.slope(way, PROBE) @ place.residual)
    return total
