"""
The evidence for a candidate, and the probabilities that follow, eq. (112) to (113b).

The evidence is the likelihood at the fit less what the candidate's freedom costs (Laplace), so
that four quantities do not win by their number.
"""
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import logsumexp

from ssi_ros.gap.selection.thresholds import SELECTION as LIMITS
from ssi_ros.tails import norm

GRID = 300              # sizes that stand for all, 1


@dataclass(frozen=True)
class SizePrior:
    """
    The prior of a size: even in the logarithm of its deviations, from some that no record shows.

    `distance` is that of the estimate from its null value in its coordinate, or None where the
    coordinate is a logarithm; the spectrum changes by the given power of the size.
    """

    distance: float
    one_sided: bool
    power: float = 1.0


@dataclass(frozen=True)
class RangePrior:
    """The prior of a place or a constant: even over a width of its coordinate."""

    width: float


@dataclass(frozen=True, eq=False)
class Ranked:
    """A fitted candidate and what speaks for it."""

    fit: Any                # `Fit` to all segments
    bonus: float = 0.0      # log odds of detections that the spectrum does not show
    prior: float = 0.0      # log of posterior over prior volume of its quantities and places
    correction: float = 0.0     # log likelihood that inexact spectra lose in simulation
    held_out: tuple = ()    # `GapStatistic`s on what each of two fits did not use; validated only
    estimate: Any = None    # indirect-inference estimate, in place of the fit's
    floor: Any = None       # what it leaves of records that it simulates, where computed
    others: tuple = ()      # Ranked of the same effects and places, hardly less likely
    explained: float = 0.0      # log likelihood over that of no effect; validated only
    removed: float = 0.0    # of the held-out gap [nats]; validated only

    @property
    def by_law(self):
        """Log likelihood of what is explained by a law that may be off."""
        return 0.0 if self.fit.candidate.exact else self.explained

    @property
    def names(self):
        """Names of the effects."""
        return self.fit.candidate.names

    @property
    def log_evidence(self):
        """Log evidence, eq. (112)."""
        return self.fit.log_likelihood + self.bonus + self.prior + self.correction

    @property
    def value(self):
        """Held-out gap, mean of the two folds [nats]."""
        return float(np.mean([g.value for g in self.held_out]))

    @property
    def deviations(self):
        """Return the standard deviations by which the held-out gap exceeds its floor, (119)."""
        mean, scatter = self.simulated
        off = LIMITS['law_error'].value ** 2 * max(self.removed, 0.0)
        return (above_floor(self.held_out, off) - mean) / scatter

    @property
    def inside(self):
        """Whether the held-out gap is inside its floor."""
        return bool(self.deviations <= LIMITS['residual_deviations'].value)

    @property
    def simulated(self):
        """Mean and standard deviation of its deviations over records that it simulates."""
        return (max(self.floor.halves, 0.0), self.floor.spread_of_halves) if self.floor else (
            0.0, 1.0)


def above_floor(gaps, off=0.0):
    """Return by how many deviations the mean of gaps of separate segments is above floor + off."""
    spread = np.sqrt(np.sum([g.floor_std ** 2 for g in gaps])) / len(gaps)
    return float((np.mean([g.value - g.floor for g in gaps]) - off) / spread)


def beside_law(p_value, explained):
    """
    Return the p-value of what an effect leaves, beside what its law may be off by, eq. (113e).

    `explained` is the log likelihood that the effect gains: half of the square of its standard
    deviations, of which a tenth may be left in whatever direction a test looks.
    """
    if p_value < 1e-300:        # beyond what a number can say
        return p_value
    return float(2 * norm.sf(norm.isf(p_value / 2) / np.sqrt(law_variance(explained))))


def law_variance(explained, directions=1):
    """
    Return the variance of a score beside an effect whose law is right to a tenth, (113e).

    What the law is off by lies in the direction of the score, or in any of several.
    """
    return 1 + 2 * LIMITS['law_error'].value ** 2 * max(explained, 0.0) / directions


def log_prior_ratio(priors, covariance):
    """Return the log of posterior over prior volume, of p priors and their covariance (p, p)."""
    if not priors:
        return 0.0
    widths, sizes = [], 0.0
    for prior, variance in zip(priors, np.diag(covariance)):
        if isinstance(prior, RangePrior):
            widths.append(prior.width)
            continue
        is_log = prior.distance is None
        decades = LIMITS['size_range'].value
        width = decades if is_log else 2 * decades * max(abs(prior.distance), 1e-12)
        # by its deviations, in place of the logarithm that the covariance is of
        power = abs(prior.power) if is_log else 1.0
        away = 1 / power if is_log else prior.distance
        sizes += (np.log(size_factor(away / np.sqrt(variance), prior.one_sided, power))
                  + np.log1p(width ** 2 / (2 * np.pi * variance)) / 2)
        widths.append(width)
    scale = np.array(widths) / np.sqrt(2 * np.pi)
    ratio = np.eye(len(scale)) + np.linalg.pinv(covariance / np.outer(scale, scale),
                                                hermitian=True)
    return -0.5 * float(np.linalg.slogdet(ratio)[1]) + float(sizes)


def size_factor(deviations, one_sided, power=1.0):
    """
    Return the mean likelihood of a size over its prior, over that of the fitted one, eq. (112a).

    Where a size changes a spectrum by a power of it, the likelihood is Gaussian in that power:
    also of sizes near zero, of which a quadratic in the logarithm says that they are as unlikely
    as large ones. So a size below the detection limit has a fifth of what the model without has.
    """
    span = LIMITS['size_range'].value * power
    if abs(deviations) > LIMITS['narrow_posterior'].value:
        return np.sqrt(2 * np.pi) / span / abs(deviations) / (1 if one_sided else 2)
    d = _sizes(span)
    there = np.exp(-(d - deviations) ** 2 / 2).mean()
    return there if one_sided else (there + np.exp(-(d + deviations) ** 2 / 2).mean()) / 2


def _sizes(span):
    """Return sizes [standard deviations] that stand for all, even in the logarithm, (GRID,)."""
    return np.exp(span * ((np.arange(GRID) + 0.5) / GRID - LIMITS['undetectable_sizes'].value))


def log_prior(names, settings, effects):
    """Return the log prior probability of the candidates with these effects, each."""
    if len(names) == 1:
        return np.log(settings.prior_single / effects)
    return np.log(settings.prior_pair / max(effects * (effects - 1) / 2, 1))


def log_posterior(ranked, settings, effects):
    """Return log evidence and prior, by which candidates are ordered."""
    return ranked.log_evidence + log_prior(ranked.names, settings, effects)


def posterior(ranked, null, residual, anomaly, effects, settings):
    """
    Return probabilities of n candidates (n,), of "none" and of "unknown", of sum 1, eq. (113b).

    Unknown is also what another effect, below the detection limit, adds to those named. Its odds
    against the best candidate follow from the p-value of what that leaves, `residual`, and against
    none from that of anomalies. `effects` is the number of effects that were considered. No
    likelihood is certain to be right: in a share of all records the prior holds, eq. (113d); and
    a share of known effects leaves as much as what is unknown, which a second effect may take
    up, eq. (113f).
    """
    logs = np.append(_beside_the_best(ranked, settings, effects),
                     null.log_evidence + np.log(settings.prior_none))
    # Where something else is there, the residual is improbable: p has the density a p^(a - 1).
    a = LIMITS['alternative_exponent'].value
    rest, rare = (np.log(a) + (a - 1) * np.log(max(p, 1e-300)) for p in (residual, anomaly))
    logs = (logs - logs.max()) / settings.temperature
    unknown, of_best = np.log(settings.prior_unknown), np.log(settings.prior_single)
    leaving = np.log(LIMITS['missed_share'].value) + of_best
    if ranked and len((best := ranked[np.argmax(logs[:-1])]).names) > 1:
        of_best = np.log(settings.prior_pair)
        # the best of its two effects, whose law may leave what the other one takes up
        for i in np.flatnonzero([set(r.names) < set(best.names) for r in ranked])[:1]:
            logs[i] = np.logaddexp(logs[i], leaving - of_best + logs[:-1].max())
    logs = np.append(logs, max(unknown - of_best + rest,
                               unknown - np.log(settings.prior_none) + rare + logs[-1]))
    if ranked:
        missed = leaving - unknown + logs[-1] - logsumexp(logs[:-2])
        logs[:-2] += np.logaddexp(0.0, missed)
    weights = np.exp(logs - logs.max())
    weights[-1] += hidden_odds(settings) * weights[:-2].sum()
    before = np.append([np.exp(log_prior(r.names, settings, effects)) for r in ranked],
                       [settings.prior_none, settings.prior_unknown])
    doubt = LIMITS['doubt'].value
    shares = (1 - doubt) * weights / weights.sum() + doubt * before / before.sum()
    return shares[:-2], float(shares[-2]), float(shares[-1])


def hidden_odds(settings):
    """Return the odds of one more effect, too small to be seen, beside those named, (113b)."""
    # each of n effects is in n - 1 of n (n - 1) / 2 pairs; one more is as probable beside two
    return 2 * settings.prior_pair / settings.prior_single * LIMITS['undetected_share'].value


def _beside_the_best(ranked, settings, effects):
    """Return the log posteriors of candidates, (n,), whose laws are right to a tenth, (113e)."""
    logs = np.array([log_posterior(r, settings, effects) for r in ranked])
    counts, before = np.array([len(r.names) for r in ranked]), 0.0
    for count in np.unique(counts):
        # a second effect is compared with others by what it adds to the best single one
        alike = np.flatnonzero(counts == count)
        best = ranked[alike[np.argmax(logs[alike])]]
        share = 1 - 1 / law_variance(best.explained - before)
        # what moves through a record, or does not, is no matter of its mean spectra
        gains = np.array([r.log_evidence - r.fit.candidate.odds_in_time for r in ranked])
        logs[alike] += share * (gains[alike].max() - gains[alike])
        before = max(before, best.explained)
    return logs


def undetected(test, effects, settings):
    """
    Return probabilities of no effect and, by name, of effects below the detection limit, (113a).

    The score test has detected no gap. What is missing to 1 is for pairs and something unknown.
    """
    z, sizes = np.array(test.z)[:, None], _sizes(LIMITS['size_range'].value)
    there = np.exp(z * sizes - sizes ** 2 / 2)
    other = np.exp(-z * sizes - sizes ** 2 / 2)
    ratios = np.where(np.reshape(test.one_sided, (-1, 1)), there, (there + other) / 2).mean(axis=1)
    share, each = LIMITS['undetected_share'].value, {}
    for name in effects:
        own = [r for r, owners in zip(ratios, test.owners) if name in owners]
        each[name] = np.mean(own) if own else share
    mean = float(np.mean(list(each.values())))
    total = (settings.prior_none + settings.prior_single * mean + settings.prior_pair * mean ** 2
             + settings.prior_unknown * share)
    return settings.prior_none / total, {
        n: float(settings.prior_single / len(effects) * r / total) for n, r in each.items()}
