"""Errors of a calibrated model beside a large effect: around it, where they are most probable."""
from dataclasses import replace
from types import SimpleNamespace

from craft import model, SECONDS
import numpy as np
import pytest
from ssi_ros.effects import applicable, inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.whittle import BLAS, whiten
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.selection.evidence import Ranked
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model.errors import Calibration, declared, of_recording
from ssi_ros.updating.adapted_comparison import AdaptedComparison
from ssi_ros.updating.calibrated_comparison import CalibratedComparison
from ssi_ros.updating.prior import relinearised

KNOWN = 0.1             # of the declared errors that remain unknown; forces remain as they are


def compared(text, seed, forces=0.0):
    """Return a record with an effect beside a calibrated model, and the truth as a candidate."""
    names, stds = declared(model())
    unknown = np.where(of_recording(names), stds, KNOWN * stds)
    nominal = replace(model(), calibration=Calibration(
        names, np.zeros(len(names)), np.diag(unknown ** 2)))
    away = np.random.default_rng(seed).standard_normal(len(names)) * unknown
    truth = nominal.at_errors(np.where(of_recording(names), forces * away, away))
    effect = parse_effect(text)
    samples = simulate_setup(inject(truth, (effect,), SECONDS), seed)
    with BLAS.limit(limits=1):
        return ModelNominal(nominal).compare(
            samples, DiagnosisSettings(), applicable(nominal),
            lambda share: None), Candidate((effect,))


def fitted(comparison, candidate):
    """Return a thorough fit of a candidate."""
    with BLAS.limit(limits=1):
        first = comparison.fit(candidate, comparison.null, thorough=False)
        return comparison.fit(first.candidate, first)


@pytest.mark.slow
@pytest.mark.parametrize('text', [
    'damping_scale:scale=0.5', 'stiffness_scale:scale=0.97', 'excitation_colour:corner_hz=8'])
def test_a_large_effect_stands_where_errors_are_linear(text):
    """No step of the errors is left that bends the spectrum; directions are those beside it."""
    comparison, truth = compared(text, 3, forces=1.0)
    found = fitted(comparison, truth)
    side = comparison.side(found)
    assert isinstance(comparison, CalibratedComparison)
    assert side is not comparison.here and side.candidate.kinds == truth.kinds
    assert relinearised(side, whiten(found.state.plain, comparison.record.spectra)) is None
    off = (np.array(found.candidate.point()) - truth.point()) / np.sqrt(
        np.diag(found.covariance))
    assert np.abs(off).max() < 4.0


def test_a_small_effect_stands_with_the_model():
    """The spectrum that it changes is the one that the errors were made around."""
    comparison, truth = compared('sensor_gain:channel=e1_a,scale=1.01', 4)
    found = fitted(comparison, truth)
    assert comparison.side(found) is comparison.here
    assert comparison.log_prior_ratio(found) == super(
        CalibratedComparison, comparison).log_prior_ratio(found)


def test_errors_that_were_fitted_with_a_candidate_are_not_moved_again():
    """A law beside a model alone keeps the side that it begins at, and what that was made of."""
    alone = AdaptedComparison.__new__(AdaptedComparison)
    alone._sides, alone.here = {}, None
    found, side = SimpleNamespace(state=object()), object()
    assert alone._around(found, side) is found
    assert alone.side(found) is side


@pytest.mark.slow
def test_a_volume_of_errors_counts_beside_an_effect():
    """Half the damping makes frequencies twice as sure: that is what the evidence pays for."""
    comparison, truth = compared('damping_scale:scale=0.5', 5)
    found = fitted(comparison, truth)
    paid = comparison.log_prior_ratio(found) - super(
        CalibratedComparison, comparison).log_prior_ratio(found)
    assert paid < -0.5
    assert comparison.detected_beside(Ranked(found), ()) == ()
