"""Rank fitted candidates by what they say of data that their fit did not see, eq. (112), (113)."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.fit import Fit, fit
from ssi_ros.gap.likelihood import log_likelihood
from ssi_ros.gap.meter import measure

REFIT_STEPS = 3
BLOCK = 8               # bands that the bootstrap keeps together
DRAWS = 400


@dataclass(frozen=True, eq=False)
class Ranked:
    """
    A fitted candidate and its trial on held-out pieces.

    Attributes
    ----------
    fit : Fit
        Of all pieces.
    held_out : float
        Log likelihood of the pieces that each of two fits did not see.
    gaps : tuple of Gap
        On those pieces.
    bonus : float
        Log odds of a sign that no spectrum shows.

    """

    fit: Fit
    held_out: float
    gaps: tuple
    bonus: float = 0.0

    @property
    def names(self):
        """Names of the effects."""
        return self.fit.candidate.names

    @property
    def value(self):
        """Held-out gap, mean of the two folds [nats]."""
        return float(np.mean([g.value for g in self.gaps]))

    @property
    def deviations(self):
        """How many standard deviations the held-out gap is above its floor."""
        spread = np.sqrt(np.sum([g.floor_std ** 2 for g in self.gaps])) / len(self.gaps)
        return float((self.value - np.mean([g.floor for g in self.gaps])) / spread)

    @property
    def bands(self):
        """Held-out gap above the floor of every band, shape (b,)."""
        return np.mean([g.bands for g in self.gaps], axis=0)


def folds(evidence):
    """Return the two interleaved halves of the pieces."""
    return evidence.only(evidence.pieces[::2]), evidence.only(evidence.pieces[1::2])


def try_held_out(simulator, evidence, fitted, settings, bonus=0.0):
    """
    Fit each half anew from the common fit, and measure it on the other half.

    Parameters
    ----------
    simulator, evidence
        Model side and recorded side.
    fitted : Fit
        Of all pieces.
    settings : DiagnosisSettings
        Bins of a band.
    bonus : float
        Log odds of a sign that no spectrum shows.

    Returns
    -------
    Ranked

    """
    halves = folds(evidence)
    total, gaps = 0.0, []
    for train, test in (halves, halves[::-1]):
        half = fit(simulator, train, fitted.candidate, fitted.levels, REFIT_STEPS)
        total += log_likelihood(half.model, test)
        gaps.append(measure(half.model, test, settings.band_bins))
    return Ranked(fitted, total, tuple(gaps), bonus)


def closed(before, after):
    """
    Return the share of the gap that is gone, with a 90 % interval of a block bootstrap.

    NaN where the gap before is within three standard deviations of its floor, eq. (113).
    """
    if before.deviations < 3.0:
        return float('nan'), float('nan'), float('nan')
    a, b = before.bands, after.bands
    count = len(a) // BLOCK
    a, b = (v[:count * BLOCK].reshape(count, BLOCK).sum(axis=1) for v in (a, b))
    draws = np.random.default_rng(0).integers(0, count, (DRAWS, count))
    ratios = 1 - b[draws].sum(axis=1) / np.maximum(a[draws].sum(axis=1), 1e-12)
    low, high = np.quantile(ratios, [0.05, 0.95])
    return float(1 - after.bands.sum() / before.bands.sum()), float(low), float(high)


def posterior(ranked, nominal, unknown_log_odds):
    """
    Return probabilities of the candidates, of "none" and of "unknown", which sum to 1.

    Parameters
    ----------
    ranked : sequence of Ranked
        Candidates.
    nominal : Ranked
        The model without effects.
    unknown_log_odds : float
        Evidence against the best candidate, on the scale of the held-out likelihood.

    Returns
    -------
    ndarray, shape (n,)
    none : float
    unknown : float

    """
    logs = np.array([r.held_out + r.bonus for r in ranked] + [nominal.held_out])
    logs = np.append(logs, logs.max() + unknown_log_odds)
    weights = np.exp(logs - logs.max())
    weights = weights / weights.sum()
    return weights[:-2], float(weights[-2]), float(weights[-1])
