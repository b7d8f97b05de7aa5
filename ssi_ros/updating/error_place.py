"""
Where a fit of a model's errors stands: likelihood, score and information of all recordings.

The coordinates are the logarithms of the levels of every recording, the errors in declared
deviations, and the numbers of the effects beside, eq. (163) of docs/theory-gap.md. Errors that
every recording has on its own stand as often as there are recordings.
"""
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import repeat

import numpy as np

from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import differences
from ssi_ros.gap.inference.whittle import Evidence, whiten
from ssi_ros.gap.nominal.simulator import level_prior, Simulator
from ssi_ros.hermitian import hermitian
from ssi_ros.updating.correlation import Correlation, correlation
from ssi_ros.updating.slopes import plain_slopes, slopes, summed_bins

REUSED = 3              # steps that an information serves; the score is always that of the place


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording cut for one stage, with the model side that goes with it."""

    simulator: Simulator
    evidence: Evidence
    correlation: Correlation = None     # None where bins are taken for independent

    def correlated(self, logs, errors, candidate):
        """Return it with what its modes correlate, the model at levels and errors."""
        return replace(self, correlation=correlation(
            self.simulator.at_errors(errors), candidate, np.exp(logs)))


@dataclass(frozen=True, eq=False)
class Problem:
    """What stays the same in a stage."""

    recordings: tuple
    stds: np.ndarray        # (n,), of the errors of all recordings
    candidate: Candidate    # where its numbers begin
    errors: tuple           # of every recording: where its errors are among all, (m,)


class ErrorPlace:
    """Where a fit stands: levels of every recording, errors in deviations, numbers of effects."""

    def __init__(self, problem, x, before=None):
        self.problem, self.x, self.before = problem, x, before
        # what a place gave that many steps ago
        self.information = before and before.information
        self.age = before.age + 1 if before else 0
        # by what errors change the matrices hardly depends on where they are
        self.changes = before.changes if before else None
        recordings, stds = problem.recordings, problem.stds
        errors = len(x) - len(problem.candidate.point()) - len(stds)
        self.unit = x[errors:errors + len(stds)]
        self.logs = x[:errors].reshape(len(recordings), -1)
        self.candidate = problem.candidate.moved(x[errors + len(stds):])
        self.prior = level_prior(self.logs.shape[1])
        self.sides = [r.simulator.at_errors((self.unit * stds)[own])
                      for r, own in zip(recordings, problem.errors)]
        self.now = [side.expected(self.candidate, np.exp(g))
                    for side, g in zip(self.sides, self.logs)]
        self.value = -np.inf
        if all(n is not None for n in self.now):
            self.white = [whiten(n.at(np.exp(g)), r.evidence)
                          for n, g, r in zip(self.now, self.logs, recordings)]
            if all(np.isfinite(w.likelihood) for w in self.white):
                self.white = [r.correlation.heights(w.lower[0], w.weight).taken_out(w)
                              if r.correlation else w for w, r in zip(self.white, recordings)]
            self.value = (sum(w.likelihood for w in self.white)
                          - float(self.unit @ self.unit) / 2
                          - float(np.sum(self.prior * self.logs ** 2)) / 2)

    def at(self, x):
        """Return the place at other coordinates, None where the model cannot exist."""
        there = ErrorPlace(self.problem, x, self)
        return there if np.isfinite(there.value) else None

    def gradient(self):
        """Return score and information of the likelihood with its priors."""
        if self.information is None or self.age == REUSED or None in self.before.plain:
            self.before = None
            self.information, self.age = self.fisher(), 0
        more = np.zeros(len(self.x) - self.logs.size - len(self.unit))
        score = self.score() - np.concatenate([(self.prior * self.logs).ravel(), self.unit, more])
        prior = np.concatenate([np.tile(self.prior, len(self.logs)), np.ones(len(self.unit)),
                                more])
        return score, self.information + np.diag(prior)

    @cached_property
    def plain(self):
        """Return the PlainSlopes of every recording, None where its spectrum is not plain."""
        problem = self.problem
        found = [plain_slopes(side, np.exp(g), problem.stds[own], self.candidate, changes)
                 for side, g, own, changes in zip(self.sides, self.logs, problem.errors,
                                                  self.changes or repeat(None))]
        self.changes = [p and p.changes for p in found]
        return found

    def score(self):
        """Return the score of the likelihood alone."""
        score = np.zeros(len(self.x))
        for i, (index, plain, white) in enumerate(zip(self._indices(), self.plain, self.white)):
            excess = hermitian(white.excess[0].reshape(white.lower[0].shape))
            levels, more = (rows @ white.excess[0] for rows in self._others[i])
            errors = (plain.score(white.lower[0], excess) if plain
                      else self._quotients[i] @ white.excess[0])
            score[index] += white.weight * np.concatenate([levels, errors, more])
        return score

    def fisher(self):
        """Return the Fisher information of the likelihood alone, (p, p)."""
        information = np.zeros((len(self.x), len(self.x)))
        for i, (index, plain, white) in enumerate(zip(self._indices(), self.plain, self.white)):
            bins, counts = summed_bins(plain.poles, self.sides[i].frame) if plain else (
                slice(None), np.ones(1))
            flat = self._directions(i, bins)
            scaled = (flat * np.sqrt(white.weight * counts)[:, None]).reshape(len(flat), -1)
            information[np.ix_(index, index)] += scaled @ scaled.T
            heights = self.problem.recordings[i].correlation
            if heights:
                mixed = heights.of(self._directions(i, heights.bins), white.lower[0])
                information[np.ix_(index, index)] -= white.weight * (
                    mixed / (1 + heights.variances)) @ mixed.T
        return information

    def _directions(self, i, bins):
        """Return the whitened derivatives by levels and all else in bins, (p, b, l l)."""
        lower, plain = self.white[i].lower[0], self.plain[i]

        def there(rows, count=len(lower)):
            return rows.reshape(-1, count, lower.shape[-1] ** 2)
        levels, more = (there(rows)[:, bins] for rows in self._others[i])
        errors = (there(plain.at(bins).whitened(lower[bins]), len(bins)) if plain
                  else there(self._quotients[i])[:, bins])
        return np.concatenate([levels, errors, more])

    def _indices(self):
        """Yield where the levels of each recording and all else are in x."""
        (many, count), size = self.logs.shape, self.logs.size
        numbers = np.arange(size + len(self.unit), len(self.x))
        for i in range(many):
            yield np.concatenate([np.arange(i * count, (i + 1) * count),
                                  size + self.problem.errors[i], numbers])

    @cached_property
    def _others(self):
        """Return whitened derivatives by levels, (c, k l l), and by effects, of each recording."""
        found = []
        for now, logs, side, white in zip(self.now, self.logs, self.sides, self.white):
            levels = [np.exp(g) * s for g, s in zip(logs, now.shares)]
            model = now.at(np.exp(logs))
            more = differences(side, self.candidate, np.exp(logs), model, now.near)
            each = white.directions([c.mean(axis=0, keepdims=True) for c in levels + more])[:, 0]
            found.append((each[:len(levels)], each[len(levels):]))
        return found

    @cached_property
    def _quotients(self):
        """Return whitened quotients by the errors, (m, k l l), None where `plain` serves."""
        found = []
        for plain, now, logs, side, white, own in zip(
                self.plain, self.now, self.logs, self.sides, self.white, self.problem.errors):
            levels = np.exp(logs)
            found.append(None if plain else white.directions([
                c.mean(axis=0, keepdims=True) for c in slopes(
                    side, now.at(levels), levels, self.problem.stds[own], self.candidate)])[:, 0])
        return found
