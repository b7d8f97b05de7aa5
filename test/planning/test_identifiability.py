"""What is promised before the data is what the data gives."""
from dataclasses import replace

import numpy as np
import pytest

from ssi_ros.effects import applicable, inject, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.score_test import make_templates, score
from ssi_ros.gap.inference.whittle import Evidence
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame, spectra
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT
from ssi_ros.planning.identifiability import identifiability
from ssi_ros.updating.model_uncertainty import model_uncertainty

SECONDS = 120.0


@pytest.fixture(scope='module')
def found():
    return identifiability(exact(), SECONDS)


def exact():
    return replace(load_spacecraft(), uncertainty=EXACT)


@pytest.mark.slow
def test_errors_of_the_model_hide_effects(found):
    """A stiffness is hidden by a declared one, a channel's own noise by none."""
    declared = identifiability(load_spacecraft(), SECONDS)
    share = {v.effect.name: v.detection / v.exact for v in declared}
    assert share['stiffness_scale'] < 0.2 and share['sensor_gain'] < 0.5
    assert share['sensor_noise'] > 0.9
    assert all(v.detection <= v.exact * 1.001 for v in declared if v.exact == v.exact)
    # 2 %: the place where it would show best may be another one
    assert {v.effect.name: v.exact for v in declared} == pytest.approx(
        {v.effect.name: v.detection for v in found}, rel=0.02, nan_ok=True)


def test_promised_detection_is_the_mean_score(found):
    """A gain is injected at ten times the size probed; its score is ten times the promised d'."""
    spacecraft = load_spacecraft()
    promised = next(v for v in found if v.effect.name == 'sensor_gain')
    frame = make_frame(12000, 100.0, DiagnosisSettings())
    simulator = Simulator(spacecraft, frame, SECONDS)
    templates = make_templates(simulator, [promised.effect])
    uncertainty = model_uncertainty(simulator, Candidate(), np.ones(3), DiagnosisSettings())
    effect = replace(promised.effect, scale=1 + 10 * (promised.effect.scale - 1))
    z = []
    for seed in range(6):
        samples = simulate_setup(inject(spacecraft, [effect], SECONDS), seed)
        evidence = Evidence(frame, spectra(samples, frame), tuple(range(frame.segments)))
        right = fit(simulator, evidence, uncertainty=uncertainty)
        z.append(score(templates, right, evidence, uncertainty).z[0])
    # 20 %: the mean of six has a spread of 0.4 of some 11, and a gain is not quite linear
    assert np.mean(z) == pytest.approx(10 * promised.detection, rel=0.2)


def test_near_ties_of_the_symmetric_layout(found):
    """A slow clock looks like stiff arrays, a delay like a low-pass of the same channel."""
    def near(name):
        return dict(next(v for v in found if v.effect.name == name).alike)
    # 0.8: what the bend of the phase and the loss of height leave of what they share
    assert max(near('clock_rate'), key=near('clock_rate').get) == 'stiffness_scale'
    assert near('channel_delay')['sensor_bandwidth'] > 0.8
    assert near('excitation_colour')['sensor_bandwidth'] > 0.7
    assert near('sensor_gain')['sensor_crosstalk'] < 0.9


def test_a_longer_record_sees_more(found):
    """Scores grow with the root of the length, at the same length of a piece."""
    few = DiagnosisSettings(segment_s=15.0)
    longer = identifiability(exact(), 4 * SECONDS, few)
    gain = [next(v.detection for v in s if v.effect.name == 'sensor_gain')
            for s in (found, longer)]
    # 4 %: rounding to whole pieces; gains that are not known exactly weigh more in a long record
    assert gain[1] / gain[0] == pytest.approx(2.0, rel=0.04)


def test_every_effect_is_in_the_table(found):
    """Also those that only signs tell of, with the size that is seen where one can be promised."""
    assert {v.effect.name for v in found} >= set(applicable(None))
    for v in found:
        if v.seen is not None and v.effect.name == 'harmonic_disturbance':
            assert v.seen.torque_n_m < v.effect.torque_n_m * 4 / v.detection * 1.001
