"""Fit a candidate and the levels to a record by Fisher scoring, eq. (100)."""
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from ssi_ros.effects.base import is_log
from ssi_ros.fisher_scoring import covariance, maximise
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.whittle import whiten
from ssi_ros.gap.nominal.simulator import IMPOSSIBLE, level_prior
from ssi_ros.updating.model_uncertainty import no_uncertainty

STEPS = 12
SCAN_STEPS = 2          # of a fit at one of many sizes
PROBE = 1e-3            # share of the coordinate's scale for a difference quotient
LONGEST = 1.5           # step of a logarithm
JITTER_ROUNDS = 2       # times that jitter noise is estimated anew at the fitted motion


@dataclass(frozen=True, eq=False)
class Fit:
    """A candidate at its best values."""

    candidate: Candidate
    levels: np.ndarray      # powers over nominal: each random excitation, sensor noise
    likelihood: float       # logarithm, uncertain numbers and their prior included
    plain: np.ndarray       # (a, k, l, l), expected, uncertain numbers as the model has them
    shares: tuple           # derivatives of `plain` by the logarithms of the levels
    covariance: np.ndarray  # (p, p), of the coordinates, all else profiled out
    errors: np.ndarray      # (n,), the uncertain numbers, in deviations
    uncertainty: object     # ModelUncertainty that they are of
    known: tuple = None     # of a nonlinear one Expected and derivatives, to begin another fit

    @cached_property
    def model(self):
        """Return what is expected, uncertain numbers at their most probable, (a, k, l, l)."""
        return self.uncertainty.corrected(self.plain, self.errors)

    @property
    def without_errors(self):
        """Return the same at no errors, which take up a part of an effect not found yet."""
        return replace(self, errors=np.zeros(len(self.errors)))


def fit(simulator, evidence, candidate=Candidate(), levels=None, steps=STEPS, uncertainty=None,
        least=-np.inf):
    """
    Maximise the likelihood of an Evidence over a candidate's numbers and the levels.

    Begins at the candidate, without effects the levels alone, and at `levels`, 1 if not given. The
    numbers of a ModelUncertainty are fitted beside, eq. (117). A fit that will hardly come to a
    likelihood of `least` ends early. Returns a Fit, or None if the candidate cannot be computed
    where it begins.
    """
    for _ in range(1 + JITTER_ROUNDS):
        side = simulator.with_motion_of(evidence, candidate, levels)
        problem = _Problem(side, evidence, uncertainty, least=least)
        found = _climb(problem, candidate, levels, steps)
        if side is simulator or found is None:
            break
        candidate, levels = found.candidate, found.levels
    return found


def best_starts(simulator, evidence, candidates, levels, uncertainty=None):
    """Return the candidates, a little fitted, the most likely first."""
    fits = (fit(simulator, evidence, c, levels, SCAN_STEPS, uncertainty) for c in candidates)
    return [f.candidate for f in sorted((f for f in fits if f is not None),
                                        key=lambda f: -f.likelihood)]


def fit_again(simulator, evidence, start, steps, uncertainty, far=False):
    """Fit another record of the same length, or a part of it, from a fit: see `fit`."""
    # Near the fit its derivatives will do: where their product with the residual vanishes is as
    # good an estimate as where the likelihood is highest. `far` takes them anew after every step.
    if simulator.with_motion_of(evidence, start.candidate, start.levels) is not simulator:
        return fit(simulator, evidence, start.candidate, start.levels, steps, uncertainty)
    return _climb(_Problem(simulator, evidence, uncertainty, not far), start.candidate,
                  start.levels, steps, start.known or _derived(simulator, start))


@lru_cache(maxsize=2)
def _derived(simulator, start):
    """Return Expected and derivatives where a Fit is, or None: halves and records share them."""
    now = simulator.expected(start.candidate, start.levels)
    return now and (now, differences(simulator, start.candidate, start.levels,
                                     now.at(start.levels), now.near))


@dataclass(frozen=True, eq=False)
class _Problem:
    """What stays the same in a fit; `keep` keeps the derivatives by the candidate's numbers."""

    simulator: object
    evidence: object
    uncertainty: object
    keep: bool = False
    least: float = -np.inf


def _climb(problem, candidate, levels, steps, known=None):
    """Fit with a model side that stays as it is."""
    now, changes = known or (problem.simulator.expected(candidate, levels), None)
    if now is None:
        return None
    logs = np.zeros(len(now.names)) if levels is None else np.log(levels)
    scales = scales_of(candidate)
    here = _Place(problem, candidate, now, logs, changes)
    if not np.isfinite(here.value):
        return None
    caps = np.concatenate([np.full(len(logs), LONGEST), LONGEST * scales])
    here, information = maximise(here, caps, steps, problem.least)
    if here is None:
        return None
    return Fit(
        here.candidate, np.exp(here.logs), here.value, here.model, tuple(here.shares()),
        covariance(information, caps)[len(logs):, len(logs):], here.most, here.uncertainty,
        (here.now, here.changes) if here.now.near else None)


class _Place:
    """Where a fit stands: expected periodograms, record whitened by them, likelihood."""

    def __init__(self, problem, candidate, now, logs, changes, errors=None):
        self.problem, self.candidate, self.now, self.logs = problem, candidate, now, logs
        self.changes = changes
        self.x = np.append(logs, candidate.point())
        free = problem.uncertainty or no_uncertainty(problem.simulator.frame, now.fixed.shape[-1])
        self.uncertainty = free.shifted(problem.simulator.shift(candidate))
        self.model = now.at(np.exp(logs))
        self.prior = level_prior(len(logs))
        self.whitened = whiten(self.model, problem.evidence)
        self.value = self.whitened.likelihood
        if np.isfinite(self.value):
            self.whitened = self.uncertainty.taken_out(self.whitened)
            self.value = self.whitened.likelihood
            gain, self.most, self.inverse = self.uncertainty.profile(self.whitened, errors)
            self.value += gain - float(self.prior @ logs ** 2) / 2
            before, after = (np.sum(np.square(u.offset)) for u in (free, self.uncertainty))
            self.value += float(before - after) / 2

    def at(self, x):
        """Return the place at other coordinates; None where the candidate cannot exist."""
        count = len(self.logs)
        candidate = self.candidate.moved(x[count:])
        now = self.problem.simulator.expected(candidate, np.exp(x[:count]), self.now.near)
        return None if now is None else _Place(self.problem, candidate, now, x[:count],
                                               self.changes if self.problem.keep else None,
                                               self.most)

    def shares(self):
        """Return the derivatives of S by the logarithms of the levels."""
        return [np.exp(g) * s for g, s in zip(self.logs, self.now.shares)]

    def gradient(self):
        """Return score and information, the uncertain numbers of the model profiled out."""
        if self.changes is None:
            self.changes = differences(self.problem.simulator, self.candidate,
                                       np.exp(self.logs), self.model, self.now.near)
        slopes = self.shares() + self.changes
        if max(map(len, slopes)) > len(self.model):
            # one number makes the segments differ: all must be whitened one by one
            self.model = np.repeat(self.model, self.problem.evidence.frame.parts, axis=0)
            self.whitened = self.uncertainty.taken_out(whiten(self.model, self.problem.evidence))
        whitened, uncertainty = self.whitened, self.uncertainty
        flat = whitened.directions(slopes)
        total = flat.reshape(len(flat), -1)
        score = whitened.weight * (total @ uncertainty.seen(whitened, self.most).ravel())
        information = whitened.weight * (total @ total.T)
        mixed = uncertainty.mixed(whitened, flat)
        count = len(self.logs)
        if self.problem.simulator.compensation:
            # what a candidate moves the errors by changes how probable they are
            moves = self._moves()
            score[count:] -= moves @ (uncertainty.offset + self.most)
            information[count:, count:] += moves @ moves.T
            mixed[count:] += moves
        score[:count] -= self.prior * self.logs
        information[:count, :count] += np.diag(self.prior)
        return score, information - mixed @ self.inverse @ mixed.T

    def _moves(self):
        """Return the derivatives of the errors of the model that candidates shift, (p, n)."""
        simulator, x = self.problem.simulator, self.x[len(self.logs):]
        here = simulator.shift(self.candidate)
        moves = np.zeros((len(x), len(self.uncertainty.names)))
        for row, step in zip(moves, np.diag(PROBE * scales_of(self.candidate))):
            for sign in (1, -1):        # where `differences` has been
                try:
                    there = simulator.shift(self.candidate.moved(x + sign * step))
                except IMPOSSIBLE:
                    continue
                row[:] = self.uncertainty.moves(there - here) / (sign * step.sum())
                break
        return moves


def differences(simulator, candidate, levels, model, near=None):
    """Return the derivatives of `model`, S of a candidate at levels, by every number of it."""
    slopes, x = [], np.array(candidate.point())
    for i, step in enumerate(np.diag(PROBE * scales_of(candidate))):
        slopes.append(np.zeros_like(model))
        for at in (x + step, x - step):
            moved = candidate.moved(at)
            width = moved.point()[i] - x[i]
            there = simulator.expected(moved, levels, near) if width else None
            if there is not None:
                slopes[i] = (there.at(levels) - model) / width
                break
    return slopes


def scales_of(candidate):
    """Return the longest step of every coordinate: a unit of a logarithm, or a start, (p,)."""
    def size(i, f):
        away = candidate.effects[i].scale_of(f)
        # a start at the default gives no scale: a fifth of the value then
        return 1.0 if is_log(f) else 5.0 * (away or 0.2 * abs(f.default) or 1e-6)
    return np.array([size(i, f) for i, f in candidate.numbers()])
