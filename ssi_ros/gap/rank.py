"""
Rank fitted candidates: evidence of the record, held-out gap, probabilities; eq. (112) and (113).

The evidence is the likelihood at the fit less what the candidate's freedom costs (Laplace), so
that four numbers do not win by their number.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects.base import is_log
from ssi_ros.gap.fit import Fit, fit_again
from ssi_ros.gap.indirect import Made
from ssi_ros.gap.meter import closed_share, measure

REFIT_STEPS = 3
DECADES = 6.0           # nats that the logarithm of an unknown size may lie in
HIDDEN = 0.2            # share of these sizes that is worth less than one deviation
SHARPLY = 10.0          # deviations from which the posterior of a size is narrow
GRID = 300              # sizes that stand for all
SINGLE, PAIR = 0.6, 0.1         # prior odds to "something else", 0.1, and to no effect, 0.2
UNKNOWN, NONE = 0.1, 0.2
SIZES = np.array([0.5, 2.0, 4.0, 8.0, 16.0])    # deviations that an effect may be worth
UNSEEN = 0.5            # share of effects, without a template or beside another, that is not seen
SHARP = 0.15            # a: how seldom something unknown leaves a p-value that is not small


@dataclass(frozen=True, eq=False)
class Ranked:
    """
    A fitted candidate and what speaks for it.

    Attributes
    ----------
    fit : Fit
        Of all pieces.
    bonus : float
        Log likelihood of signs that the spectrum does not show.
    places : int
        Among how many places the effects' were chosen.
    credit : float
        Log likelihood that its expected spectrum, not exact, loses on records that it makes.
    held_out : tuple of Gap
        On the pieces that each of two fits did not see; empty before `try_held_out`.
    made : Made, optional
        What a simulator has to be given instead of the fit, of a nonlinear candidate.
    floor : resimulate.Floor, optional
        What it leaves of records that it makes, where these were looked at.

    """

    fit: Fit
    bonus: float = 0.0
    places: int = 1
    credit: float = 0.0
    held_out: tuple = ()
    made: Made = None
    floor: object = None

    @property
    def told(self):
        """Return what a simulator has to be given, with its scatter: the answer."""
        return self.made or Made(self.fit.candidate, self.fit.levels)

    @property
    def names(self):
        """Names of the effects."""
        return self.fit.candidate.names

    @property
    def evidence(self):
        """Log evidence, eq. (112)."""
        return (self.fit.likelihood + self.bonus + self.credit - np.log(self.places)
                + occam(self.fit.candidate, self.fit.covariance))

    @property
    def value(self):
        """Held-out gap, mean of the two folds [nats]."""
        return float(np.mean([g.value for g in self.held_out]))

    @property
    def deviations(self):
        """How many standard deviations the held-out gap is above its floor, eq. (119)."""
        mean, scatter = self.own
        return (above_floor(self.held_out) - mean) / scatter

    @property
    def own(self):
        """Mean and standard deviation of the deviations that it leaves of its own records."""
        return (max(self.floor.halves, 0.0), self.floor.spread_of_halves) if self.floor else (
            0.0, 1.0)


def above_floor(gaps):
    """Return how many standard deviations the mean of gaps of separate pieces is too large."""
    spread = np.sqrt(np.sum([g.floor_std ** 2 for g in gaps])) / len(gaps)
    return float(np.mean([g.value - g.floor for g in gaps]) / spread)


def occam(candidate, covariance):
    """
    Return the log of posterior over prior volume of a candidate's numbers, at most 0.

    The prior of a size is even in the logarithm of its deviations, from some that no record
    shows; that of a place even in the range that its starts span.
    """
    widths, sizes = [], 0.0
    for (i, f), x, variance in zip(candidate.numbers(), candidate.point(), np.diag(covariance)):
        e = candidate.effects[i]
        starts = e.starts[f.name]
        if f.name == e.size:
            width = DECADES if is_log(f) else 2 * DECADES * max(abs(x - f.default), 1e-12)
            # by its deviations, in place of the logarithm that the covariance is of
            power = abs(e.power) if is_log(f) else 1.0
            away = 1 / power if is_log(f) else x - f.default
            sizes += (np.log(of_size(away / np.sqrt(variance), e.one_sided(), power))
                      + np.log1p(width ** 2 / (2 * np.pi * variance)) / 2)
        elif e.hinge:
            # the stiffness of a hinge is the same number, whatever its law
            width = DECADES
        elif is_log(f):
            width = 2 * np.log(max(starts) / min(starts)) if len(starts) > 1 else DECADES
        else:
            width = (2 * (max(starts) - min(starts)) if len(starts) > 1
                     else 2 * max(abs(starts[0]), 1e-12))
        widths.append(width)
    if not widths:
        return 0.0
    scale = np.array(widths) / np.sqrt(2 * np.pi)
    ratio = np.eye(len(scale)) + np.linalg.pinv(covariance / np.outer(scale, scale),
                                                hermitian=True)
    return -0.5 * float(np.linalg.slogdet(ratio)[1]) + float(sizes)


def of_size(deviations, one_sided, power=1.0):
    """
    Return the mean likelihood of a size over its prior, over that of the fitted one, eq. (112a).

    Where a size changes a spectrum by a power of it, the likelihood is Gaussian in that power:
    also of sizes near nothing, of which a quadratic in the logarithm says that they are as
    unlikely as large ones. So a size that is not seen has a fifth of what the model without has.
    """
    span = DECADES * power
    if abs(deviations) > SHARPLY:
        return np.sqrt(2 * np.pi) / span / abs(deviations) / (1 if one_sided else 2)
    d = np.exp(span * ((np.arange(GRID) + 0.5) / GRID - HIDDEN))
    there = np.exp(-(d - deviations) ** 2 / 2).mean()
    return there if one_sided else (there + np.exp(-(d + deviations) ** 2 / 2).mean()) / 2


def folds(evidence):
    """Return the two interleaved halves of the pieces."""
    return evidence.only(evidence.pieces[::2]), evidence.only(evidence.pieces[1::2])


def try_held_out(simulator, evidence, ranked, settings, tolerance):
    """
    Fit each half anew from the common fit, and measure it on the other half.

    Parameters
    ----------
    simulator, evidence
        Model side and recorded side.
    ranked : Ranked
        A candidate.
    settings : DiagnosisSettings
        Bins of a band.
    tolerance : Tolerance
        What is fitted beside.

    Returns
    -------
    Ranked
        With the gaps.

    """
    simulator = simulator.following(ranked.fit.candidate, ranked.fit.levels, evidence)
    halves = folds(evidence)
    gaps = []
    for train, test in (halves, halves[::-1]):
        half = fit_again(simulator, train, ranked.fit, REFIT_STEPS, tolerance)
        gaps.append(measure(half.model, test, settings.band_bins))
    return replace(ranked, held_out=tuple(gaps))


def closed(before, after):
    """
    Return the share of the gap that is gone, with its 90 % interval, (113).

    NaN where the gap before is within three standard deviations of its floor, or of what the
    candidate leaves of its own records.
    """
    mean, scatter = after.own
    if before.deviations < 3.0 * scatter + mean:
        return float('nan'), float('nan'), float('nan')
    whole, left = (np.mean([g.value - g.floor for g in r.held_out]) for r in (before, after))
    gaps = after.held_out
    spread = np.sqrt(np.sum([g.floor_std ** 2 for g in gaps])) / len(gaps)
    return closed_share(whole, left, np.mean([g.floor for g in gaps]), spread * scatter)


def posterior(ranked, nominal, left, strange, effects, temperature):
    """
    Return probabilities of the candidates, of "none" and of "unknown", which sum to 1, eq. (113b).

    Unknown is also what another effect, too small to be told, adds to a single one.  Its odds
    against the best candidate are told by what that leaves, against none by what is strange.

    Parameters
    ----------
    ranked : sequence of Ranked
        Candidates.
    nominal : Ranked
        The model without effects.
    left : float
        p-value of what the best candidate leaves.
    strange : float
        p-value of what in the record no effect of the library makes.
    effects : int
        Effects that were considered.
    temperature : float
        Divides the logarithms: what is overconfident by that factor.

    Returns
    -------
    ndarray, shape (n,)
    none : float
    unknown : float

    """
    pairs = max(effects * (effects - 1) / 2, 1)
    prior = [np.log(SINGLE / effects if len(r.names) == 1 else PAIR / pairs) for r in ranked]
    logs = np.array([r.evidence for r in ranked] + [nominal.evidence]) + np.array(
        prior + [np.log(NONE)])
    # Where something else is there, what is left is improbable: p has the density a p^(a - 1).
    rest, odd = (np.log(SHARP) + (SHARP - 1) * np.log(max(p, 1e-300)) for p in (left, strange))
    logs = (logs - logs.max()) / temperature
    logs = np.append(logs, max(np.log(UNKNOWN / SINGLE) + rest,
                               np.log(UNKNOWN / NONE) + odd + logs[-1]))
    weights = np.exp(logs - logs.max())
    alone = [w for r, w in zip(ranked, weights) if len(r.names) == 1]
    weights[-1] += PAIR / SINGLE * UNSEEN * sum(alone)
    weights = weights / weights.sum()
    return weights[:-2], float(weights[-2]), float(weights[-1])


def unseen(z, owners, one_sided, names):
    """
    Return probabilities of no effect and of effects too small to be told, eq. (113a).

    Parameters
    ----------
    z : ndarray, shape (t,)
        Standardised scores of templates, in which no gap is seen.
    owners : sequence of tuple of str, length t
        Effects that each template speaks for.
    one_sided : ndarray of bool, shape (t,)
        Whether only a positive score can be theirs.
    names : sequence of str
        Effects that were considered.

    Returns
    -------
    none : float
    singles : dict of str to float
        Of each effect alone; what is missing to 1 is for pairs and for something unknown.

    """
    z = np.array(z)[:, None]
    there = np.exp(z * SIZES - SIZES ** 2 / 2)
    other = np.exp(-z * SIZES - SIZES ** 2 / 2)
    ratios = np.where(np.reshape(one_sided, (-1, 1)), there, (there + other) / 2).mean(axis=1)
    each = {}
    for name in names:
        own = [r for r, owner in zip(ratios, owners) if name in owner]
        each[name] = np.mean(own) if own else UNSEEN
    mean = float(np.mean(list(each.values())))
    total = NONE + SINGLE * mean + PAIR * mean ** 2 + UNKNOWN * UNSEEN
    return NONE / total, {n: float(SINGLE / len(names) * r / total) for n, r in each.items()}


def worth(ranked, effects):
    """Return log evidence and prior, which candidates are sorted by."""
    pairs = max(effects * (effects - 1) / 2, 1)
    return ranked.evidence + np.log(SINGLE / effects if len(ranked.names) == 1 else PAIR / pairs)
