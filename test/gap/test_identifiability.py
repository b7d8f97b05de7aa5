"""What is promised before the data is what the data gives."""
import numpy as np
import pytest

from ssi_ros.effects import inject, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.fit import fit, Simulator
from ssi_ros.gap.identifiability import identifiability
from ssi_ros.gap.likelihood import Evidence
from ssi_ros.gap.scores import make_templates, score
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra import make_frame, spectra
from ssi_ros.model import load_spacecraft

SECONDS = 120.0


@pytest.fixture(scope='module')
def found():
    return identifiability(load_spacecraft(), SECONDS)


def test_promised_detection_is_the_mean_score(found):
    """A gain is injected at the size probed; its score is the promised d'."""
    spacecraft = load_spacecraft()
    promised = next(v for v in found if v.effect.name == 'sensor_gain')
    frame = make_frame(12000, 100.0, DiagnosisSettings())
    simulator = Simulator(spacecraft, frame, SECONDS)
    plain = simulator.expected(Candidate())
    templates = make_templates(simulator, plain.at(np.ones(3)), plain.shares, [promised.effect])
    z = []
    for seed in range(6):
        samples = simulate_setup(inject(spacecraft, [promised.effect], SECONDS), seed)
        evidence = Evidence(frame, spectra(samples, frame), tuple(range(frame.pieces)))
        z.append(score(templates, fit(simulator, evidence).model, evidence).z[0])
    # 25 %: the mean of six has a spread of 0.4 of some 6, and a gain is not quite linear
    assert np.mean(z) == pytest.approx(promised.detection, rel=0.25)


def test_near_ties_of_the_symmetric_layout(found):
    """A slow clock looks like stiff arrays, a delay like a low-pass of the same channel."""
    def near(name):
        return dict(next(v for v in found if v.effect.name == name).alike)
    # 0.9: what damping and the bend of the phase leave of the difference
    assert near('clock_rate')['stiffness_scale'] > 0.9
    assert near('channel_delay')['sensor_bandwidth'] > 0.9
    assert near('sensor_gain')['sensor_crosstalk'] < 0.9


def test_a_longer_record_sees_more(found):
    """Scores grow with the root of the length, at the same length of a piece."""
    few = DiagnosisSettings(segment_s=15.0)
    longer = identifiability(load_spacecraft(), 4 * SECONDS, few)
    gain = [next(v.detection for v in s if v.effect.name == 'sensor_gain')
            for s in (found, longer)]
    assert gain[1] / gain[0] == pytest.approx(2.0, rel=0.02)   # 2 %: rounding to whole pieces
