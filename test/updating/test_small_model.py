"""Models so small, or so named, that what holds for a spacecraft does not hold for them."""
import numpy as np
import pytest
from ssi_ros.effects import inject, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.model import load_model

MODEL = {'kinds': ['acceleration', 'acceleration'], 'noise_rms': 1e-3, 'inputs': ['push'],
         'levels': 2.0, 'rate_hz': 20.0, 'mass': np.eye(2), 'damping_ratios': 0.02,
         'stiffness': [[2000.0, -1000.0], [-1000.0, 1000.0]], 'input': [[0.0], [1.0]],
         'output': np.eye(2), 'freedoms': ['f', 'g'], 'uncertainty_frequency': 0.01}


@pytest.mark.parametrize('channels', [
    pytest.param(('a', 'b'), marks=pytest.mark.slow), ('left/a', 'right | b')])
def test_a_gain_of_a_model_without_declared_damping_errors(tmp_path, channels):
    """No damping may be wrong, so that nothing is shifted for it; a slash in a name is a name."""
    np.savez(tmp_path / 'm.npz', channels=channels, **MODEL)
    model, _ = load_model(tmp_path / 'm.npz')
    samples = simulate_setup(inject(model, (), 200.0), 2)
    values = samples.values.copy()
    values[:, 0] *= 3.0
    found = diagnose(model, type(samples)(values, samples.rate_hz, samples.channels),
                     pairs=False)
    assert found.outcome != 'WITHIN_FLOOR'
