"""SSI-DATA, ERA and OKID against known truth and against SSI-COV."""
import numpy as np
import pytest
from scipy.linalg import expm
from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.identify import pulse_responses
from ssi_ros.identify.era import era
from ssi_ros.identify.shapes import mac
from ssi_ros.identify.ssi_cov import ssi_cov
from ssi_ros.identify.ssi_data import ssi_data

HZ, DAMPING = np.array([2.3, 5.1, 15.828, 15.844]), 0.005


def structure():
    """Return A, B, C, D at 100 Hz of four modes with two forces and four accelerometers."""
    w = 2.0 * np.pi * HZ
    a = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.diag(w ** 2), -np.diag(2 * DAMPING * w)]])
    force = np.array([[1.0, 0.4], [0.7, -1.0], [1.0, 0.3], [-0.2, 1.0]])
    b = np.concatenate([np.zeros((4, 2)), force])
    c = PAIR_SHAPES.T @ a[4:]
    step = expm(np.block([[a, b], [np.zeros((2, 10))]]) / 100.0)
    return step[:8, :8], step[:8, 8:], c, PAIR_SHAPES.T @ force


def exact(poles):
    """Assert that the poles are those of the structure, to rounding."""
    order = np.argsort(poles.frequency_hz)
    np.testing.assert_allclose(poles.frequency_hz[order], HZ, rtol=1e-6)
    np.testing.assert_allclose(poles.damping_ratio[order], DAMPING, rtol=1e-3)
    assert (np.diagonal(mac(poles.shapes[order], PAIR_SHAPES)) > 0.999).all()


def test_era_realises_pulse_responses():
    """Without noise the realisation is exact: close pair, shapes and all."""
    a, b, c, _ = structure()
    responses = np.array([c @ np.linalg.matrix_power(a, k) @ b for k in range(400)])
    exact(era(responses, 100.0, 60, (8,))[0])


def test_okid_recovers_the_pulse_responses(rng):
    """From two recorded forces: pulse responses to rounding, and with them the poles."""
    a, b, c, d = structure()
    u, x, y = rng.standard_normal((6000, 2)), np.zeros(8), []
    for force in u:
        y.append(c @ x + d @ force)
        x = a @ x + b @ force
    responses = pulse_responses(u, np.array(y), 12, 400)
    true = np.array([c @ np.linalg.matrix_power(a, k) @ b for k in range(400)])
    np.testing.assert_allclose(responses, true, atol=1e-6 * np.abs(true).max())
    exact(era(responses, 100.0, 60, (8,))[0])


@pytest.mark.parametrize('weighting', ['cva', 'upc'])
def test_ssi_data_agrees_with_ssi_cov(weighting):
    """The same record: both are near the truth, and nearer to each other than their spread."""
    record = accelerations(PAIR_HZ, PAIR_SHAPES, 120.0, np.random.default_rng(8))
    found = [p[0] for p in (ssi_data(record, 100.0, 20, (8,), weighting),
                            ssi_cov(record, 100.0, 20, (8,), weighting))]
    f = [np.sort(p.frequency_hz) for p in found]
    # five spreads of two minutes
    np.testing.assert_allclose(f[0], PAIR_HZ, rtol=5e-3)
    np.testing.assert_allclose(f[0], f[1], rtol=2e-3)


def test_the_closest_pair_keeps_its_shapes():
    """15.828 and 15.844 Hz, one half-width apart, in twenty minutes: MAC 0.98."""
    likeness = []
    for seed in range(3):
        record = accelerations(PAIR_HZ[2:], PAIR_SHAPES[2:], 1200.0, np.random.default_rng(seed),
                               damping=0.001)
        poles, = ssi_cov(record, 100.0, 60, (4,))
        likeness.append(mac(poles.shapes, PAIR_SHAPES[2:]).max(axis=1))
    # lags that are transposed give 0.61 here
    assert np.mean(likeness) >= 0.98, likeness


@pytest.mark.parametrize('run, word', [
    (lambda y: ssi_data(np.where(y > 0, y, np.nan), 100.0), 'missing'),
    (lambda y: ssi_data(y[:300], 100.0), 'needs 400'),
    (lambda y: ssi_data(y, 100.0, weighting='x'), 'known: cva'),
    (lambda y: era(y, 100.0), 'is needed'),
    (lambda y: era(np.zeros((80, 2, 1)), 100.0), 'zero'),
    (lambda y: era(np.ones((20, 2, 1)), 100.0), '52 samples'),
    (lambda y: pulse_responses(y[:, :1], y[:-1], 5, 10), 'same n'),
    (lambda y: pulse_responses(y[:, :1], y, 300, 10), 'samples or more')])
def test_wrong_arguments_are_told(rng, run, word):
    """Every message says what is needed."""
    with pytest.raises(ValueError, match=word):
        run(rng.standard_normal((600, 4)))
