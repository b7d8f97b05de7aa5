"""
Sizes of effects that are far from every start, for a gap that no small one explains.

Where a record is thousands of nats from a model, a score says neither which effect it is nor how
large: sizes of all effects are tried, in shorter segments, which show as much of so large a gap.
"""
import numpy as np

from ssi_ros.effects.sizes import brackets
from ssi_ros.gap.inference.model_fit import best_starts
from ssi_ros.gap.inference.whittle import whiten
from ssi_ros.gap.nominal.starting_points import at_any_size, rivals
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.gap.selection.search import RIVALS
from ssi_ros.gap.selection.thresholds import SELECTION

SHORTER = 4             # times, segments in which sizes are tried
LEAST_BANDS = 8         # that short segments are to resolve
KINDS = 3               # of effects that are fitted at all sizes
SCANNED = 3             # sizes of an effect that are fitted further


def distant(comparison, ranked):
    """Return the best effects at sizes far away, a little fitted."""
    return tuple(c for e in rivals(ranked, RIVALS)
                 for c in a_little_fitted(comparison, brackets(e))[:SCANNED])


def is_near(comparison, fit):
    """Return whether a fit leaves little, or less than half of what there is without effects."""
    lost = comparison.goodness_of_fit(comparison.null).lost
    left = lost + comparison.null.log_likelihood - fit.log_likelihood
    return left < max(lost / 2, LIMITS.wrong_model.value)


def anywhere(comparison, residual, beside=None):
    """Return effects of all kinds and sizes, beside a fit that leaves much, a little fitted."""
    fit = beside or comparison.null
    if residual.p_value >= SELECTION['residual_p'].value or (
            residual.gap.lost < LIMITS.wrong_model.value) or (
            beside and (len(fit.state.model) > 1 or not is_near(comparison, beside))):
        return ()       # beside what varies in time it would take minutes
    (simulator, spectra), ones = shortened(comparison, fit), np.ones(len(fit.levels))

    def likelihood(effect):
        now = simulator.expected(fit.candidate.with_one_more(effect), fit.levels)
        # the levels of the fit have taken up some of what it does not explain
        return -np.inf if now is None else max(
            whiten(now.at(levels), spectra).likelihood for levels in (fit.levels, ones))
    others = [e for e in comparison.templates.effects
              if not e.nonlinear and e.answer not in fit.candidate.names]
    return tuple(c for effects in at_any_size(others, likelihood, KINDS)
                 for c in a_little_fitted(comparison, effects, beside)[:SCANNED])


def a_little_fitted(comparison, effects, beside=None, uncertainty=None):
    """Return candidates of effects beside a fit, that without effects if none is given."""
    # far away, what is not known of the model takes up little, and most of the time
    fit = beside or comparison.null
    simulator, spectra = shortened(comparison, fit) if uncertainty is None else (
        comparison.side(fit).simulator, comparison.record.spectra)
    return best_starts(simulator, spectra, [fit.candidate.with_one_more(e) for e in effects],
                       fit.levels, uncertainty)


def shortened(comparison, fit):
    """Return the model side that a fit stands on, and the Evidence, in shorter segments."""
    simulator, record = comparison.side(fit).simulator, comparison.record
    frame = simulator.frame.cut_shorter(SHORTER, comparison.settings)
    # what is recorded of inputs, and rows that are missing, are known of the usual segments only
    if simulator.recorded or record.missing.any() or (
            frame.last - frame.first < LEAST_BANDS * comparison.settings.band_bins):
        return simulator, record.spectra
    simulator = simulator.on(frame)
    return simulator, simulator.evidence(record.samples)
