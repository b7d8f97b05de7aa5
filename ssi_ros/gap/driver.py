"""Diagnose the gap between a nominal and a record: is there one, where, why, what remains."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects import applicable
from ssi_ros.gap.check import TooLittleData
from ssi_ros.gap.inference.whittle import BLAS
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.selection.conclusion import Case, conclude, no_gap, not_comparable, too_little
from ssi_ros.gap.selection.cross_validation import validated
from ssi_ros.gap.selection.evidence import Ranked
from ssi_ros.gap.selection.search import Search
from ssi_ros.gap.selection.thresholds import SELECTION as LIMITS
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.integrity.missing import missing_of

VALIDATED = 4           # candidates that are measured on held-out segments
SEED = 20               # of the control drawn at random


def diagnose(nominal, samples, settings=DiagnosisSettings(), *, effects=None, pairs=True,
             progress=None):
    """
    Diagnose the gap between what is expected and what was recorded.

    Parameters
    ----------
    nominal : ModelNominal, RecordedNominal, Spacecraft or LinearModel
        What is believed before the record is looked at; a model stands for its ModelNominal.
    samples : Samples
        The record, on an even grid, NaN where a sample is missing.
    settings : DiagnosisSettings
        Band, segments, uncertainty of the model, prior probabilities.
    effects : sequence of str, optional
        Names of the effects to consider; all by default.
    pairs : bool
        Whether to look for two effects where one does not suffice.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Diagnosis

    Raises
    ------
    ValueError
        If record and nominal do not fit each other, or an effect is not known.

    """
    report = progress or (lambda share: None)
    nominal = nominal if hasattr(nominal, 'compare') else ModelNominal(nominal)
    names = applicable(getattr(nominal, 'spacecraft', None), effects)
    missing = missing_of(samples, nominal.channels)
    with BLAS.limit(limits=1):
        try:
            comparison = nominal.compare(samples, settings, names, _part(report, 0.0, 0.35))
        except TooLittleData as error:
            return replace(too_little(str(error), error.notes), missing=missing)
        found = _diagnose(comparison, settings, pairs, report)
    report(1.0)
    return replace(found, missing=missing)


def _diagnose(comparison, settings, pairs, report):
    # test: is there a gap, and where
    found = comparison.residual(comparison.null)
    case = Case(comparison, settings, found, comparison.localise())
    report(0.4)
    if comparison.mismatch:
        return not_comparable(case, comparison.mismatch)
    if found.p_value > settings.false_alarm:
        return no_gap(case)

    # search: which effects explain it
    search = Search(comparison, found, settings, _part(report, 0.4, 0.7))
    ranked, residual = search.singles(), None
    if ranked:
        ranked, residual = search.explaining(ranked)
        if pairs and search.wants_another(ranked[0], residual):
            search.progress = _part(report, 0.7, 0.9)
            ranked, residual = search.with_pairs(ranked, residual)
        ranked[0] = replace(ranked[0], floor=residual.floor,
                            estimate=comparison.estimate(ranked[0].fit, residual))
    report(0.9)

    # validate: how much of the gap they remove on segments that the fit did not use
    null = validated(comparison, Ranked(comparison.null))
    ranked = [validated(comparison, r, null) for r in ranked[:VALIDATED]]
    far = residual and residual.gap.deviations > LIMITS['far'].value
    if ranked and not (ranked[0].floor or ranked[0].inside or far):
        # halves of a modulated record leave more than the theory of a steady one says
        ranked[0] = replace(ranked[0], floor=comparison.simulated_floor(ranked[0].fit))
    controls = (null, *_control(comparison, ranked))

    # conclude: what is said, and how surely
    case = replace(case, ranked=tuple(ranked), null=null, residual=residual, controls=controls)
    answer = conclude(case)
    if answer.outcome not in ('EXPLAINED', 'TIED'):
        return answer
    best = next(r for r in ranked if r.names == answer.verdict['effects'])
    again = comparison.localise(best.fit, answer.verdict['probability'])
    return replace(answer, where=replace(again, site=answer.where.site,
                                         sensors=again.sensors or answer.where.sensors))


def _control(comparison, ranked):
    """Return one effect that nothing speaks for, validated: what a reduction is worth."""
    named = {n for r in ranked for n in r.names}
    others = [c for c in comparison.all_candidates() if not named & set(c.names)]
    if not others:
        return ()
    candidate = others[np.random.default_rng(SEED).integers(len(others))]
    fit = comparison.fit(candidate, comparison.null, thorough=False)
    return () if fit is None else (validated(comparison, Ranked(fit)),)


def _part(report, first, last):
    """Return a callable that reports a share of a part of the work."""
    return lambda share: report(first + (last - first) * share)
