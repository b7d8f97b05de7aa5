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
from ssi_ros.gap.fit import level_prior
from ssi_ros.gap.likelihood import real_vectors, white, whiten, whiten_each

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
    level : float
        Power of all excitation at nominal levels, which a record's is compared with.

    """

    effects: tuple
    changes: np.ndarray
    swings: dict
    level: float


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
    return Templates(tuple(kept), np.array(changes).reshape(-1, *base.shape[1:]), swings,
                     power_of(nominal.shares[:-1]))


def power_of(shares):
    """Return the power of parts of an expected spectrum."""
    return float(sum(np.trace(s.mean(axis=(0, 1))).real for s in shares))


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


def score(templates, fitted, evidence, tolerance, here=None):
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
    here : Directions, optional
        Of `directions`, where those of a fit near by will do.

    Returns
    -------
    Scores

    """
    seen = whiten(fitted.plain, evidence)
    here = here or directions(templates, fitted, evidence, tolerance)
    total = seen.excess.sum(axis=0).astype(np.float32)
    raw = seen.weight * (here.flat @ total).astype(float)
    beside = (seen.weight * (here.basis @ total)).astype(float)
    count = len(fitted.levels)
    beside[:count] -= level_prior(count) * np.log(fitted.levels)
    raw -= here.mixed @ here.inner @ beside
    if here.swings:
        # a model that is the same for all pieces was compared with their mean only
        each = (seen if len(seen.excess) > 1 else whiten_each(fitted.plain, evidence)).excess
        for i, swing in here.swings.items():
            raw[i] += np.sum(swing * each) / evidence.frame.crowding
    return Scores(templates.effects, raw / here.spread, raw / here.spread ** 2, here.spread,
                  here.information / np.outer(here.spread, here.spread))


def directions(templates, fitted, evidence, tolerance):
    """Return the templates as a fit whitens them; arguments as of `score`."""
    return Directions(templates, fitted.plain, fitted.shares, tolerance, evidence.frame,
                      evidence.pieces)


def promise(templates, expected, frame, tolerance):
    """
    Return how templates would be seen in a record that does not exist yet, eq. (114).

    Parameters
    ----------
    templates : Templates
        Of the nominal.
    expected : Expected
        Nominal expected periodograms, taken at nominal levels.
    frame : Frame
        How the record will be cut.
    tolerance : Tolerance
        What is not known exactly.

    Returns
    -------
    detection : ndarray, shape (t,)
        d' of every template.
    cosine : ndarray, shape (t, t)
        Their correlations.

    """
    model = expected.at(np.ones(len(expected.names)))
    here = Directions(templates, model, expected.shares, tolerance, frame,
                      tuple(range(frame.pieces)))
    return here.spread, here.information / np.outer(here.spread, here.spread)


class Directions:
    """Templates as a model whitens them, and their information with levels projected out."""

    def __init__(self, templates, plain, shares, tolerance, frame, pieces):
        self.effects = templates.effects
        model = plain.mean(axis=0, keepdims=True)
        lower = np.linalg.inv(np.linalg.cholesky(model))[0].astype(np.complex64)
        # templates are made at nominal levels: the excitation of the record scales them
        level = np.float32(power_of(shares[:-1]) / templates.level)
        self.flat = level * real_vectors(white(lower, templates.changes))
        beside = [real_vectors(white(lower, s.mean(axis=0))[None])[0] for s in shares]
        self.basis = np.array(beside + list(tolerance.vectors), np.float32)
        count = len(pieces) / frame.crowding
        prior = np.diag(np.append(level_prior(len(beside)), np.ones(len(tolerance.vectors))))
        self.inner = np.linalg.inv(count * (self.basis @ self.basis.T).astype(float) + prior)
        self.mixed = count * (self.flat @ self.basis.T).astype(float)
        self.information = (count * (self.flat @ self.flat.T).astype(float)
                            - self.mixed @ self.inner @ self.mixed.T)
        self.swings = {i: level * real_vectors(white(lower, s[list(pieces)]))
                       for i, s in templates.swings.items()}
        for i, swing in self.swings.items():
            for j, other in self.swings.items():
                self.information[i, j] += np.sum(swing * other) / frame.crowding
        self.spread = np.sqrt(np.maximum(np.diag(self.information), 1e-30))
