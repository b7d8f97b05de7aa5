# Licensed under the Apache License, Version 2.0.
"""
What the generator's own likelihood achieves on records, against the sizes on the labels.

The efficient score of an effect: its score in the record, less what the joint estimate of all
unknowns from record, healthy recordings and prior explains of it. One step from the truth, as the
last step of a fit that has found its maximum. The prior's own error is drawn: its mean is off the
truth by its spread, as a model's number is.
"""
from dataclasses import replace

from blindgen.effects.base import EFFECTS
from blindgen.physics.record import simulate
from blindgen.sizes.information import Knowledge, Record
from blindgen.sizes.predict import periodogram
from blindgen.sizes.unknowns import spreads, unknowns
import numpy as np


def steady(knowledge):
    """Return the same knowledge of records without gaps and warming, which a statistic needs."""
    return Knowledge(*(one if k else one[0] for k, one in enumerate(
        [[_steady(r) for r in group] for group in ([knowledge.record], knowledge.healthy)])))


def _steady(record):
    return Record(replace(record.scenario, gaps=(), warming=0.0), record.duration_s)


class Score:
    """Efficient scores of changes u (k, n c^2), each with unit variance without effect."""

    def __init__(self, knowledge, changes):
        """Take a `steady` knowledge; means are those of records without effect, simulated."""
        self.knowledge, record = knowledge, knowledge.record
        self.changes = np.array(changes)
        self.shared = np.array([u.shared for u in unknowns(record.scenario)])
        cross = record.v @ self.changes.T
        self.weights = np.linalg.solve(knowledge.before + record.fisher, cross)
        sizes = np.array([knowledge.size(u) for u in self.changes])
        self.sizes = np.maximum(sizes, 1e-12)

    def of(self, scenario, seed):
        """Return z (k,) of one simulated record of a scenario and its healthy recordings."""
        k, own = self.knowledge, ~self.shared
        prior = 1 / spreads(k.record.scenario)
        rng = np.random.default_rng(seed)
        scores = prior * rng.standard_normal(len(prior))
        for j, each in enumerate(k.healthy, 1):
            s = each.v @ self._residual(each, each.scenario, seed, j)
            s[own] += (prior * rng.standard_normal(len(prior)))[own]
            f = each.fisher + np.diag(prior**2 * own)
            scores[self.shared] += s[self.shared] - f[np.ix_(self.shared, own)] @ np.linalg.solve(
                f[np.ix_(own, own)], s[own])
        residual = self._residual(k.record, scenario, seed, 0)
        scores += k.record.v @ residual
        return (self.changes @ residual - self.weights.T @ scores) / self.sizes

    def _residual(self, record, scenario, seed, stream):
        values, _ = simulate(scenario, record.duration_s,
                             np.random.SeedSequence(seed, spawn_key=(stream,)))
        identity = np.zeros((len(record.grid[0]), len(record.scenario.craft.sensors)**2))
        identity[:, :len(record.scenario.craft.sensors)] = np.sqrt(record.grid[1])[:, None]
        return periodogram(record, values) - identity.ravel()


def separation(without, with_it):
    """Return d' of two samples of a statistic, and its standard error."""
    sd = np.sqrt((np.var(without, ddof=1) + np.var(with_it, ddof=1)) / 2)
    d = (np.mean(with_it) - np.mean(without)) / sd
    n = min(len(without), len(with_it))
    return float(d), float(np.sqrt(2 / n + d * d / (4 * n)))


def every_hypothesis(knowledge, size=3.0, seed=0):
    """Return the changes (k, n c^2) of all spectral effects of the library at all their places."""
    record, rng, data = knowledge.record, np.random.default_rng(seed), {}
    for effect in EFFECTS.values():
        if not effect.library or effect.predict != 'spectrum' or not effect.fits(
                record.scenario.craft):
            continue
        m = np.sqrt(effect.low * effect.high)
        for draw in range(60):
            v = {**effect.draw(rng, record.scenario.craft, record.duration_s), 'sign': 1.0}
            free = {'f', 'along', 'angle', 'tau'} & set(v)
            place = (effect.name, v.get('source'), v.get('channel'), v.get('array'),
                     draw % 4 if free else 0)
            if place in data:
                continue
            for _ in range(6):
                u = record.change(effect.apply(record.scenario, effect.size(v, m)))
                if 0.3 * size < (now := np.sqrt(u @ u)) < 3 * size:
                    break
                m = float(np.clip(m * np.clip(size / max(now, 1e-12), 1e-3, 1e3), effect.low,
                                  effect.high))
            data[place] = u
    return np.array(list(data.values()))
