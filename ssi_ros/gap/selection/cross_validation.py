"""Held-out validation of a fitted candidate, and the reduction of the gap, eq. (113)."""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.inference.goodness_of_fit import closed_share
from ssi_ros.gap.selection.thresholds import SELECTION as LIMITS

FOLDS = (0, 1)          # halves of interleaved segments


def validated(comparison, ranked, null=None):
    """
    Return a Ranked with the gaps of fits to each half of the segments on the other half.

    With the `null` Ranked, validated, also with what it explains that no effect does not.
    """
    gaps = []
    for fold in FOLDS:
        half = comparison.fit(ranked.fit.candidate, ranked.fit, fold)
        gaps.append(comparison.goodness_of_fit(half, fold))
    found = replace(ranked, held_out=tuple(gaps))
    return found if null is None else replace(
        found, explained=found.log_evidence - null.log_evidence, removed=null.value - found.value)


def reduction(before, after):
    """Return the share of the gap that a candidate removes, with its 90 % interval, (113)."""
    # NaN where the gap before is within three standard deviations of its floor, or of what the
    # candidate leaves of the records that it simulates.
    mean, scatter = after.simulated
    if before.deviations < LIMITS['closed_defined'].value * scatter + mean:
        return float('nan'), float('nan'), float('nan')
    whole, rest = (np.mean([g.value - g.floor for g in r.held_out]) for r in (before, after))
    gaps = after.held_out
    spread = np.sqrt(np.sum([g.floor_std ** 2 for g in gaps])) / len(gaps)
    return closed_share(whole, rest, np.mean([g.floor for g in gaps]), spread * scatter)
