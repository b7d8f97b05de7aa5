"""
Scores of all effects at once, eq. (104) and (105).

A template is the change of the expected spectrum by one effect at one place and starting value. It
depends on the model alone, so it is computed once; a record whitens it by its levels.
"""
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from ssi_ros.effects.base import lateness
from ssi_ros.effects.second_degree import SecondDegree
from ssi_ros.effects.sizes import at_size
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.whittle import whiten, whiten_each
from ssi_ros.gap.nominal.simulator import level_prior
from ssi_ros.gap.spectra.expected_periodogram import power_of
from ssi_ros.hermitian import inverse_root, white_vectors
from ssi_ros.tails import tail_of_largest
from ssi_ros.updating.merged_bins import merged, runs_beside, WhiteChanges
from ssi_ros.updating.score_variance import as_gaussian
from ssi_ros.weighted_sums import changed, each_of, mean_of, total_of, WeightedSum

DRAWS = 4000
FAR = 2.0               # standardised scores beyond which their tails count


@dataclass(frozen=True, eq=False)
class Templates:
    """Directions of effects around a nominal model."""

    effects: tuple          # one a template, at its starting value
    white: WhiteChanges     # (t, ...), of S at nominal levels, segments' mean
    modulation: dict        # {template: (parts, g l l)}, deviations from that mean, likewise
    level: float            # power of all excitation at nominal levels
    shifts: np.ndarray = None   # (t, m), by what the errors of the model are shifted beside

    def late(self, late, frame):
        """Return those of channels that are read late [samples], (l,)."""
        if not late:
            return self
        turn = lateness(late, frame.cycles).astype(np.complex64)
        return replace(self, white=replace(
            self.white, factor=turn[:, :, None] * self.white.factor))


def make_templates(simulator, effects, progress=None):
    """
    Compute the templates of effects around the simulator's nominal spectrum.

    Of a model whose errors are declared they are derivatives where an effect is smooth: errors as
    wide take up nearly all of it, and what goes by its square would be all that is left, (105h).
    """
    nominal = simulator.expected(Candidate())
    base, errors = nominal.at_nominal, simulator.spacecraft.calibration
    declared = bool(errors.names) and not errors.covariance
    factor = np.linalg.cholesky(base.mean(axis=0)).astype(np.complex64)
    lower = inverse_root(base.mean(axis=0)).astype(np.complex64)
    kept, shifts, modulation, others = [], [], {}, SecondDegree()
    vectors = np.empty((len(effects), lower.size), np.float32)
    for i, effect in enumerate(effects):
        if progress is not None:
            progress(i / len(effects))
        change, share = others.change(effect), effect.first_order if declared else 1.0
        candidate = Candidate((at_size(effect, share) if share < 1.0 else effect,))
        if change is None:
            there = simulator.expected(candidate)
            if there is None:
                continue
            change = total_of([there.few_at_nominal, -base])
            change = changed(change, lambda x: x / share)
            others.keep(effect, change)
        if not isinstance(change, WeightedSum):
            change = change.astype(np.complex64)
        each = changed(change, partial(white_vectors, lower))
        vectors[len(kept)] = mean = mean_of(each)
        if isinstance(each, WeightedSum) or len(each) > 1:
            modulation[len(kept)] = (each_of(each) - mean).astype(np.float32)
        kept.append(effect)
        shifts.append(simulator.shift(candidate) / share)
    white = merged(vectors[:len(kept)], factor)
    return Templates(
        tuple(kept), white, {i: white.runs.projected(m) for i, m in modulation.items()},
        power_of(nominal.shares[:-1]), np.array(shifts) if np.any(shifts) else None)


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of a record for every template, levels and model errors projected out."""

    effects: tuple          # one a template
    z: np.ndarray           # (t,), standardised: Gaussian of variance 1 where the model is right
    size: np.ndarray        # (t,), one-step estimate of the effect, in units of its starting value
    detection: np.ndarray   # (t,), mean of z for an effect at its starting value, d'
    cosine: np.ndarray      # (t, t), correlation of the scores, R of eq. (105)
    skewness: np.ndarray = 0.0      # (t,), of large scores, whose tails count

    def gains(self):
        """Return the gain of the log likelihood that each promises; 0 for an impossible sign."""
        possible = np.array([not e.one_sided() for e in self.effects]) | (self.z > 0)
        return np.where(possible, self.z ** 2 / 2, 0.0)

    def p_value(self, signed=False):
        """Return the chance of so large a score somewhere, `signed`: of a sign that can be."""
        sided = np.array([signed and e.one_sided() for e in self.effects], bool)
        values, vectors = np.linalg.eigh(self.cosine)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = _normal(len(root)) @ root.T
        return tail_of_largest(*(np.where(sided, z, np.abs(z)).max(axis=-1)
                                 for z in (
            as_gaussian(self.z, self.skewness + np.zeros(len(self.z))), draws)))


@lru_cache(maxsize=1)
def _normal(count):
    draws = np.random.default_rng(0).standard_normal((DRAWS, count))
    draws.flags.writeable = False
    return draws


def score(templates, fitted, evidence, uncertainty, here=None, skewed=True):
    """Return the Scores of all templates around a Fit; `here` are Directions of one near by."""
    record = uncertainty.taken_out(whiten(fitted.plain, evidence))
    here = here or directions(templates, fitted, evidence, uncertainty)
    # effects and errors as the model without errors whitens them, so that what does the same is
    # the same; the record beside the most probable errors
    excess = uncertainty.seen(record, uncertainty.of(fitted))
    total = here.runs.projected(excess.sum(axis=0, keepdims=True).astype(np.float32))[0]
    raw = record.weight * (here.flat @ total).astype(float)
    beside = (record.weight * (here.basis @ total)).astype(float)
    count = len(fitted.levels)
    beside[:count] -= level_prior(count) * np.log(fitted.levels)
    # heights are at their best already
    beside[count:] = uncertainty.errors(
        beside[count:] - uncertainty.offset - uncertainty.of(fitted))
    raw -= here.mixed @ here.inner @ beside
    if here.modulation:
        # a model that is the same for all segments was compared with their mean alone
        each = (excess if len(excess) > 1
                else whiten_each(uncertainty.raised(fitted.model, evidence), evidence))
        each = here.runs.projected(each)
        for i, part in here.modulation.items():
            raw[i] += evidence.each_of * np.sum(part * each) / evidence.frame.inflation
    z, skewness = raw / here.spread, np.zeros(len(raw))
    far = np.flatnonzero(np.abs(z) > (FAR if skewed else np.inf))
    skewness[far] = here.skewness(far)
    return Scores(templates.effects, z, raw / here.spread ** 2, here.spread, here.cosine, skewness)


def directions(templates, fitted, evidence, uncertainty):
    """Return the templates as a fit whitens them; arguments as of `score`."""
    return Directions(templates, fitted.plain, fitted.shares, uncertainty, evidence.frame,
                      evidence.segments)


def promise(templates, expected, frame, uncertainty):
    """Return the expected scores of templates in a record that does not exist yet, eq. (114)."""
    # `expected` is the nominal Expected, `frame` how the record will be cut. Returns d' (t,) of
    # every template, and their correlations (t, t).
    here = Directions(templates, expected.at_nominal, expected.shares, uncertainty, frame,
                      tuple(range(frame.segments)))
    return here.spread, here.cosine


class Directions:
    """Templates as a model whitens them, and their information with levels projected out."""

    def __init__(self, templates, plain, shares, uncertainty, frame, segments):
        self.effects, self.frame, self.channels = templates.effects, frame, plain.shape[-1]
        model = plain.mean(axis=0, keepdims=True)
        lower = inverse_root(model)[0].astype(np.complex64)
        # templates are made at nominal levels: the excitation of the record scales them
        scaled = np.float32(np.sqrt(power_of(shares[:-1]) / templates.level)) * lower
        white = templates.white
        self.runs = runs_beside(white.runs, model[0])
        self.flat = white.by(scaled, self.runs, white.vectors)
        vectors = self.runs.projected(uncertainty.vectors)
        if templates.shifts is not None:
            moves = (templates.shifts @ uncertainty.into.T).astype(np.float32)
            self.flat -= moves @ vectors
        beside = self.runs.white(lower, np.stack([s.mean(axis=0) for s in shares]))
        self.basis = np.concatenate([beside, vectors], dtype=np.float32)
        self.weight = count = len(segments) / frame.inflation
        prior = np.diag(np.append(level_prior(len(beside)), np.ones(len(vectors))))
        self.inner = np.linalg.inv(count * (self.basis @ self.basis.T).astype(float) + prior)
        self.mixed = count * (self.flat @ self.basis.T).astype(float)
        self.information = (count * (self.flat @ self.flat.T).astype(float)
                            - self.mixed @ self.inner @ self.mixed.T)
        parts = np.unique(frame.parts_of(segments))
        self.modulation = {i: white.by(scaled, self.runs, m[parts])
                           for i, m in templates.modulation.items()}
        for i, part in self.modulation.items():
            for j, other in self.modulation.items():
                self.information[i, j] += np.sum(part * other) / len(parts) * count
        self.spread = np.sqrt(np.maximum(np.diag(self.information), 1e-30))
        self.cosine = self.information / np.outer(self.spread, self.spread)

    def skewness(self, rows):
        """
        Return the skewness of some scores, (r,): third cumulant over standard deviation cubed.

        A score is a sum over complex Wishart matrices, of third cumulant 2 n sum tr D^3, larger by
        neighbouring bins that a taper correlates.
        """
        apart = self.flat[rows] - (self.mixed[rows] @ self.inner).astype(np.float32) @ self.basis
        cubes = self.runs.cubes(apart, self.channels)
        taper = self.frame.taper
        of_taper = self.frame.rows ** 2 * np.sum(taper ** 6) / self.frame.inflation ** 2
        return 2 * self.weight * of_taper * cubes / self.spread[rows] ** 3
