"""A record of many segments is held as the means of groups of neighbours, with little loss."""
import numpy as np
import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.score_test import make_templates, score
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra import segmentation
from ssi_ros.model import load_spacecraft
from ssi_ros.updating.model_uncertainty import no_uncertainty

DRIFT = parse_effect('stiffness_drift:change=0.01')
SETTINGS = DiagnosisSettings(segment_s=20.0)


@pytest.fixture(scope='module')
def record():
    return simulate_setup(inject(load_spacecraft(), [DRIFT], 600.0), 3)


def fitted(record):
    """Return the fit of a drift, the scores of templates around no effect, and the frame."""
    frame = segmentation.frame_of(record, SETTINGS)
    simulator = Simulator(load_spacecraft(), frame, 600.0)
    evidence = simulator.evidence(record)
    null = fit(simulator, evidence)
    free = no_uncertainty(frame, 4)
    return fit(simulator, evidence, Candidate((DRIFT,)), null.levels), score(
        make_templates(simulator, [DRIFT]), null, evidence, free), null, evidence


def test_a_drift_is_fitted_and_scored_as_by_single_segments(record, monkeypatch):
    """Value, deviation, likelihood ratio and score of 10 groups of 3 are those of 30 segments."""
    one, one_score, one_null, _ = fitted(record)
    monkeypatch.setattr(segmentation, 'MOST', 12)
    monkeypatch.setattr(segmentation, 'PARTS', 10)
    two, two_score, two_null, evidence = fitted(record)
    assert evidence.each.shape[0] == 10 and evidence.each_of == 3
    # a drift is straight over 60 s: what is left is noise that the means of groups do not hold
    std = np.sqrt(one.covariance[0, 0])
    assert abs(two.candidate.point()[0] - one.candidate.point()[0]) < 0.3 * std
    assert np.sqrt(two.covariance[0, 0]) == pytest.approx(std, rel=0.05)
    gains = one.likelihood - one_null.likelihood, two.likelihood - two_null.likelihood
    assert gains[1] == pytest.approx(gains[0], rel=0.05)
    assert two_score.z == pytest.approx(one_score.z, rel=0.05)


def test_halves_of_groups_have_their_own_segments(record, monkeypatch):
    """Every second segment: the mean is of those alone, and parts know how many they hold."""
    monkeypatch.setattr(segmentation, 'MOST', 12)
    monkeypatch.setattr(segmentation, 'PARTS', 10)
    frame = segmentation.frame_of(record, SETTINGS)
    evidence = Simulator(load_spacecraft(), frame, 600.0).evidence(record)
    half = evidence.only(evidence.segments[::2])
    assert half.parts == tuple(range(10)) and half.each_of == 1.5
    assert np.allclose(half.mean[0], np.mean(
        [np.einsum('ki,kj->kij', s, s.conj()) for s in evidence.spectrum[::2]], axis=0))
