"""What two correct models may differ by is no gap; what is larger is."""
from dataclasses import replace

import numpy as np
import pytest

from ssi_ros.bootstrap.indirect_inference import IndirectEstimate
from ssi_ros.bootstrap.parametric_bootstrap import bootstrap_floor, BootstrapTests
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.score_test import make_templates
from ssi_ros.gap.inference.unmodelled.templates import make_change_templates
from ssi_ros.gap.inference.whittle import Evidence, whiten
from ssi_ros.gap.nominal.simulator import at_levels, Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame, spectra
from ssi_ros.model import load_spacecraft
from ssi_ros.updating.model_uncertainty import model_uncertainty, no_uncertainty

SECONDS = 200.0


@pytest.fixture(scope='module')
def simulator():
    frame = make_frame(20000, 100.0, DiagnosisSettings())
    return Simulator(load_spacecraft(), frame, SECONDS)


def evidence_of(simulator, *texts, seed=5):
    setup = inject(simulator.spacecraft, [parse_effect(t) for t in texts], SECONDS)
    samples = simulate_setup(setup, seed)
    return Evidence(simulator.frame, spectra(samples, simulator.frame),
                    tuple(range(simulator.frame.segments)))


def test_a_tolerance_takes_in_what_it_names(simulator):
    """A gain 1 % off costs the likelihood; with a uncertainty of 1 % it costs almost nothing."""
    wide = replace(DiagnosisSettings(), gain_std=0.01)
    quiet = evidence_of(simulator)
    loud = evidence_of(simulator, 'sensor_gain:channel=e1_a,scale=1.01')
    none = no_uncertainty(simulator.frame, 4)
    free = model_uncertainty(simulator, Candidate(), np.ones(3), wide)
    effect = Candidate((parse_effect('sensor_gain:channel=e1_a,scale=1.001'),))
    gain = [fit(simulator, loud, effect, uncertainty=t).likelihood
            - fit(simulator, loud, uncertainty=t).likelihood for t in (none, free)]
    # d' = 5 or so without; with it the record says no more of the effect than the prior did
    assert gain[0] > 8.0 and gain[1] < 2.0
    # a right model gains no more by model errors than their number and chance give
    more = fit(simulator, quiet, uncertainty=free).likelihood - fit(
        simulator, quiet, uncertainty=none).likelihood
    assert -1e-6 < more < len(free.names)


def test_a_model_far_from_the_record_does_not_win_by_its_tolerances(simulator):
    """Their quadratic holds near by; far away it once gave a low-pass 10^7 of log likelihood."""
    evidence = evidence_of(simulator, 'stiffness_drift:change=0.03')
    free = model_uncertainty(simulator, Candidate(), np.ones(3), DiagnosisSettings())
    right, wrong = (fit(simulator, evidence, Candidate((parse_effect(t),)), steps=1,
                        uncertainty=free).likelihood
                    for t in ('stiffness_drift:change=0.03',
                              'sensor_bandwidth:channel=all,corner_hz=8'))
    assert wrong < right


def test_the_corrected_model_is_what_the_gain_promises(simulator):
    """The likelihood of the corrected spectrum is that of the profile, to second order."""
    wide = replace(DiagnosisSettings(), gain_std=0.003)
    evidence = evidence_of(simulator, 'sensor_gain:channel=e2_b,scale=1.003')
    free = model_uncertainty(simulator, Candidate(), np.ones(3), wide)
    found = fit(simulator, evidence, uncertainty=free)
    plain = whiten(found.plain, evidence).likelihood
    bent = whiten(found.model, evidence).likelihood
    # the prior takes a part of the gain, the curvature another; both are below a half here
    assert bent > plain
    assert np.all(np.linalg.eigvalsh(found.model[0]) > 0)


def test_floor_by_simulation_is_the_floor_where_the_spectrum_is_exact(simulator):
    """A right model leaves nothing of its own records, and levels are those of the fit."""
    evidence = evidence_of(simulator)
    free = no_uncertainty(simulator.frame, 4)
    best = fit(simulator, evidence)
    templates = make_templates(simulator, [parse_effect('sensor_gain:channel=e1_a,scale=1.002'),
                                           parse_effect('damping_scale:scale=1.1')])
    made = IndirectEstimate(best.candidate, best.levels)
    floor = bootstrap_floor(simulator, best, made, BootstrapTests(
        templates, make_change_templates(simulator), free, DiagnosisSettings()))
    # the mean of five standard scores: 5 sd
    assert np.all(np.abs(floor.z) < 5 / np.sqrt(5)) and abs(floor.deviations) < 5 / np.sqrt(5)
    louder = at_levels(simulator.spacecraft, np.array([4.0, 9.0, 1.0]))
    assert louder.excitation.torque_rms_n_m[0] == pytest.approx(0.2, rel=1e-12)
    assert louder.excitation.process_noise_rms == pytest.approx(0.015, rel=1e-12)
