"""
Scores of all effects at once, eq. (104) and (105) of docs/theory-gap.md.

A template is the change of the expected spectrum by one effect at one place and starting value.
Templates depend on the model alone, so they are made once and kept; a record whitens them by the
levels that it has.
"""
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.likelihood import real_vectors, white, whiten

DRAWS = 4000


@dataclass(frozen=True, eq=False)
class Templates:
    """
    Directions of effects around a nominal model.

    Attributes
    ----------
    effects : tuple of Effect
        One a template, at its starting value.
    changes : ndarray, shape (t, k, l, l), complex64
        Change of S at nominal levels, the mean over the pieces.
    swings : dict of int to ndarray (pieces, k, l, l), complex64
        What each piece differs from that mean, for effects that change in time.

    """

    effects: tuple
    changes: np.ndarray
    swings: dict


def make_templates(simulator, effects, progress=None):
    """Compute the templates of effects around the simulator's nominal spectrum."""
    nominal = simulator.expected(Candidate())
    base = nominal.at(np.ones(len(nominal.names)))
    kept, changes, swings = [], [], {}
    for i, effect in enumerate(effects):
        if progress is not None:
            progress(i / len(effects))
        there = simulator.expected(Candidate((effect,)))
        if there is None:
            continue
        change = there.at(np.ones(len(there.names))) - base
        mean = change.mean(axis=0)
        if len(change) > 1:
            swings[len(kept)] = (change - mean).astype(np.complex64)
        kept.append(effect)
        changes.append(mean.astype(np.complex64))
    return Templates(tuple(kept), np.array(changes).reshape(-1, *base.shape[1:]), swings)


@dataclass(frozen=True, eq=False)
class Scores:
    """
    How much of every template a record shows, levels and tolerances projected out.

    Attributes
    ----------
    effects : tuple of Effect
        One a template.
    z : ndarray, shape (t,)
        Standardised scores: Gaussian of variance 1 where the model is right.
    size : ndarray, shape (t,)
        One-step estimate of the effect, in units of its starting value.
    detection : ndarray, shape (t,)
        Mean of z for an effect at its starting value, d'.
    cosine : ndarray, shape (t, t)
        Correlation of the scores, R of eq. (105).

    """

    effects: tuple
    z: np.ndarray
    size: np.ndarray
    detection: np.ndarray
    cosine: np.ndarray

    def gains(self):
        """Return the gain of the log likelihood that each promises; 0 for a wrong sign."""
        possible = np.array([not e.one_sided() for e in self.effects]) | (self.z > 0)
        return np.where(possible, self.z ** 2 / 2, 0.0)

    def p_value(self):
        """
        Return the chance of so large a score somewhere where the model is right.

        Beyond what DRAWS of correlated Gaussians can tell, the number of independent scores that
        gives their median takes over.
        """
        values, vectors = np.linalg.eigh(self.cosine)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = np.random.default_rng(0).standard_normal((DRAWS, len(root))) @ root.T
        largest = np.abs(draws).max(axis=1)
        found = np.max(np.abs(self.z))
        share = np.mean(largest >= found)
        if share > 20 / DRAWS:
            return float(share)
        effective = np.log(0.5) / np.log1p(-2 * norm.sf(np.median(largest)))
        return float(-np.expm1(effective * np.log1p(-2 * norm.sf(found))))


def score(templates, fitted, evidence, tolerance):
    """
    Score all templates.

    Parameters
    ----------
    templates : Templates
        Of the nominal.
    fitted : Fit
        A model and its levels, which the templates are scaled by.
    evidence : Evidence
        What was recorded.
    tolerance : Tolerance
        What is not known exactly.

    Returns
    -------
    Scores

    """
    model = fitted.plain.mean(axis=0, keepdims=True)
    lower = np.linalg.inv(np.linalg.cholesky(model))[0].astype(np.complex64)
    seen = whiten(fitted.plain, evidence)
    excess = seen.excess if len(seen.excess) > 1 else None
    total = seen.excess.sum(axis=0).astype(np.float32)
    level = np.float32(np.exp(np.mean(np.log(fitted.levels[:-1]))))
    flat = level * real_vectors(white(lower, templates.changes))
    beside = [real_vectors(white(lower, s.mean(axis=0))[None])[0] for s in fitted.shares]
    basis = np.array(beside + list(tolerance.vectors), np.float32)
    count = seen.weight * (len(seen.excess))
    # Flat prior for the levels, unit variance for the tolerances.
    prior = np.diag([0.0] * len(beside) + [1.0] * len(tolerance.vectors))
    inner = np.linalg.inv(count * (basis @ basis.T).astype(float) + prior)
    mixed = count * (flat @ basis.T).astype(float)
    raw = seen.weight * (flat @ total).astype(float)
    raw -= mixed @ inner @ (seen.weight * (basis @ total)).astype(float)
    information = count * (flat @ flat.T).astype(float) - mixed @ inner @ mixed.T
    if templates.swings:
        excess = excess if excess is not None else _each(fitted, evidence)
        weight = 1.0 / evidence.frame.crowding
        swings = {i: level * real_vectors(white(lower, s[list(evidence.pieces)]))
                  for i, s in templates.swings.items()}
        for i, swing in swings.items():
            raw[i] += weight * np.sum(swing * excess)
            for j, other in swings.items():
                information[i, j] += weight * np.sum(swing * other)
    spread = np.sqrt(np.maximum(np.diag(information), 1e-30))
    return Scores(templates.effects, raw / spread, raw / spread ** 2, spread,
                  information / np.outer(spread, spread))


def _each(fitted, evidence):
    many = np.repeat(fitted.plain[:1], evidence.frame.pieces, axis=0)
    return whiten(many, evidence).excess
