"""Candidates whose spectra are approximate, corrected by what that costs of their own records."""
from dataclasses import replace

from ssi_ros.gap.selection.evidence import log_posterior
from ssi_ros.gap.selection.thresholds import SELECTION as LIMITS


def corrected(comparison, ranked):
    """Return the Ranked of a comparison, best first, the log evidence of approximations raised."""
    # the best explains nothing: another law may do so whose linear equivalent is worse
    best, others, found, exact = ranked[0], [], {}, None
    promising = (best.fit.log_likelihood + comparison.null.log_likelihood) / 2
    for r in ranked:
        if r is not best and (
                r.fit.log_likelihood <= promising or not r.fit.candidate.nonlinear
                or r.log_evidence + LIMITS['largest_correction'].value * comparison.indirect(
                    r.fit).deficit < max(f.log_evidence for f in found)
                - LIMITS['pruning_margin'].value):
            others.append(r)
            continue
        floor, correction = comparison.residual(r.fit).floor, 0.0
        if floor and r.fit.candidate.nonlinear:
            # the same random numbers cost an exact spectrum as much by chance
            if exact is None:
                own = [k for f, k in found.items() if k and not f.fit.candidate.nonlinear]
                exact = (own[0] if own else comparison.simulated_floor(comparison.null)).deficit
            correction = max(floor.deficit - exact, 0.0)
        found[replace(r, correction=correction)] = floor
    count = len(comparison.effects)
    return sorted([*found, *others],
                  key=lambda r: -log_posterior(r, comparison.settings, count))
