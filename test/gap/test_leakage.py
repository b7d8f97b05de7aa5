"""Channels that follow each other down to little noise: near frequencies are correlated then."""
import numpy as np
import pytest
from ssi_ros.bootstrap.score_scatter import leaks
from ssi_ros.effects import inject, simulate_setup
from ssi_ros.gap.check import match
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model import Channel, Input, modal_model

SHAPES = np.array([[0.3, -0.8, 1.0], [0.6, -0.9, -0.5], [0.8, 0.1, -0.9], [1.0, 0.9, 0.8]])
EFFECTS = ('mode_damping', 'mode_frequency', 'sensor_gain', 'channel_delay', 'sensor_drift')


def cantilever(noise, inputs):
    """Return a model of three modes, four accelerometers, and forces at the first places."""
    return modal_model(
        [1.4, 3.9, 7.6], 0.01, SHAPES, SHAPES[:inputs].T, rate_hz=50.0,
        sensors=[Channel(f'a{i}', 'acceleration', noise) for i in range(4)],
        drives=[Input(f'f{i}', 1.0) for i in range(inputs)])


def compared(model, seed):
    """Return a ModelComparison with a record of the model itself."""
    samples = simulate_setup(inject(model, (), 600.0), seed)
    return ModelNominal(match(model, samples)[0]).compare(
        samples, DiagnosisSettings(), EFFECTS, lambda share: None)


@pytest.mark.parametrize('noise, inputs, leaky', [
    (1e-5, 1, True), (1e-5, 4, False), (0.3, 1, False)])
def test_it_is_known_where_that_is_so(noise, inputs, leaky):
    """Few inputs and little noise; as many inputs as channels, or noise, and it is not."""
    comparison = compared(cantilever(noise, inputs), 1)
    assert leaks(comparison.simulator, comparison.null.state) == leaky


@pytest.mark.slow
def test_scores_scatter_as_is_said():
    """Of records of the model itself, standardised: they are wider by a half without it."""
    z = []
    for seed in range(5):
        comparison = compared(cantilever(1e-5, 1), seed)
        scores = comparison.score_test(comparison.null)
        z.append(np.append(np.std(scores.z), np.mean(comparison.scatter.scores)))
    deviation, scatter = np.sqrt(np.mean(np.square(z), axis=0))
    assert deviation < 1.1 and deviation * scatter > 1.3


def test_the_mean_of_a_record_is_no_drift():
    """It holds what velocities at both ends differ by, far above noise as small as this."""
    for seed in range(3):
        comparison = compared(cantilever(1e-5, 1), seed)
        found, *_ = comparison.detections(comparison.null)
        assert 'sensor_drift' not in [d.effect for d in found]


def test_noise_that_no_double_shows_is_an_error():
    """At 100 dB below the motion it is seen (above); at 160 dB the message says what to do."""
    with pytest.raises(ValueError, match='noise_rms of 1e-5'):
        compared(cantilever(1e-8, 1), 1)
