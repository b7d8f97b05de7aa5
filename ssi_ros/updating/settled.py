"""
Which model stands beside a record: as it is, or moved to where its spectrum is linear in errors.

What a calibration leaves unknown is fitted beside every effect as directions of the spectrum. A
damping that is half of what was thought, or a force on a mode that is 3 dB higher than it was,
changes a resonance by more than a direction says: then the model moves, within its prior, to the
most probable errors of the record. Beside an effect every thorough fit does so by itself.
"""
from ssi_ros.gap.candidate import is_approximate
from ssi_ros.gap.inference.whittle import whiten
from ssi_ros.gap.nominal.model_answer import refuted
from ssi_ros.gap.selection.search import Search
from ssi_ros.gap.selection.thresholds import SELECTION
from ssi_ros.updating.prior import relinearised

ROUNDS = 3              # in which a model moves to where its spectrum is linear
SPECTRUM_FITS = 5.0     # deviations of a gap, below which other tests decide
UNUSUAL = 0.01          # chance of errors so far off, below which an effect may have moved them


def settled(comparison, beside):
    """
    Return a calibrated model beside a record, moved where that explains the record better.

    Parameters
    ----------
    comparison : ModelComparison
        The model as its calibration left it.
    beside : callable
        From a simulator and an ErrorPrior to a ModelComparison of the same record.

    Returns
    -------
    ModelComparison

    """
    if explains(comparison):
        return comparison
    alone = None
    if not is_far(comparison, comparison.null):
        alone = _moved(comparison, beside)
        if alone is not comparison and (explains(alone) or (
                _is_usual(alone) and best_of(alone, pairs=False, simulated=False)[1])):
            return alone
    # a thorough fit moves errors beside its own candidate by itself
    if search_of(comparison).singles():
        return comparison
    alone = alone or _moved(comparison, beside)
    return alone if _is_usual(alone) else comparison


def _moved(comparison, beside):
    """Return a comparison whose model is at the most probable errors of the record."""
    moved, spectra = comparison, comparison.record.spectra
    for _ in range(ROUNDS):
        there = relinearised(moved.here, whiten(moved.null.state.plain, spectra))
        if there is None:
            break
        moved = beside(*there)
        # scores are standardised along any direction, so that those of a model near by will do
        moved.templates, moved.unmodelled = comparison.templates, comparison.unmodelled
    return moved


def _is_usual(moved):
    """Return whether errors are as far as those of records without an effect would be."""
    side, null = moved.here, moved.null.state
    return side.chance_of_errors(null.without_errors, moved.record.spectra.frame) > UNUSUAL


def explains(comparison):
    """Return whether a model explains the record without any effect."""
    if comparison.mismatch:
        return True
    null, alarm = comparison.null, comparison.settings.false_alarm
    # no other test takes back what the spectrum or the scores say; they take a tenth of its time
    if comparison.goodness_of_fit(null).deviations >= SPECTRUM_FITS or refuted(
            comparison.score_test(null), alarm):
        return False
    return comparison.residual(null).p_value > alarm


def is_better(comparison, best, there, moved):
    """Return whether the best beside a model is more probable than that beside a moved one."""
    # errors that are linear make a likelihood too large: what explains less is not better
    left = moved.residual(there.fit).p_value if best and there else 1.0
    return left < SELECTION['residual_p'].value and best.log_evidence > there.log_evidence and (
        comparison.residual(best.fit).p_value > left)


def is_far(comparison, fit):
    """Return whether a fit leaves so much that no other test has to be asked."""
    return comparison.goodness_of_fit(fit).deviations > SELECTION['far'].value


def leaves_nothing(comparison, fit):
    """Return whether what a fit leaves is within what its own records leave of themselves."""
    # no record that it simulates takes back what an exact spectrum leaves of this one
    exact = not is_approximate(fit.candidate)
    return not (exact and comparison.goodness_of_fit(fit).deviations >= SPECTRUM_FITS) and (
        comparison.residual(fit, not exact).p_value >= SELECTION['residual_p'].value)


def suffices(moved, fit, wrong):
    """Return whether a moved model needs no effects beside linear errors, as of a wrong model."""
    return moved.needs_errors(fit) if wrong else leaves_nothing(moved, fit)


def search_of(comparison):
    """Return the Search of a comparison, before any fit."""
    found = comparison.residual(comparison.null)
    return Search(comparison, found, comparison.settings, lambda share: None)


def best_of(comparison, pairs=True, simulated=True):
    """Return the best explanation beside a model, or None, and whether it is one."""
    search = search_of(comparison)
    ranked = search.singles()
    # two effects are tried where the rest is small enough to be another one
    if not ranked or is_far(comparison, ranked[0].fit):
        return next(iter(ranked), None), False
    residual = comparison.residual(ranked[0].fit, simulated)
    limit = SELECTION['residual_p'].value
    if residual.p_value < limit and residual.gap.deviations < SPECTRUM_FITS:
        # impulses or the law of a hinge fail tests that their own records fail as well
        residual = comparison.residual(ranked[0].fit)
    ranked, residual = search.with_equivalents(ranked, residual)
    if pairs and residual.p_value < limit:
        ranked, residual = search.with_pairs(ranked, residual)
    return ranked[0], residual.p_value >= limit
