"""A mode of a few bins is no line, whatever its level; a line is one beside it, (162)."""
import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter
from ssi_ros.gap.nominal.recordings import prepare
from ssi_ros.gap.nominal.stationary.tone import line
from ssi_ros.records import Samples

RATE_HZ, SECONDS = 25.0, 600.0
MODES = (1.65, 0.002), (3.9, 0.012), (5.2, 0.003), (8.1, 0.005)
SHAPES = np.array([[1.0, 0.8, 0.6], [0.7, -0.9, 0.3], [0.4, 0.5, -1.0], [0.3, -0.6, 0.8]])


def motion(seed, levels=(1.0,) * 4, tone=0.0):
    """Return accelerations of four modes under white forces of such levels, and a sine."""
    rng, rows = np.random.default_rng(seed), int(SECONDS * RATE_HZ)
    modal = []
    for (f, xi), level in zip(MODES, levels):
        w = 2 * np.pi * f
        b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * xi * w, w ** 2]), 1 / RATE_HZ)
        modal.append(level * lfilter(np.ravel(b), a, rng.standard_normal(rows + 20_000))[20_000:])
    values = np.array(modal).T @ SHAPES
    values += 0.01 * values.std() * rng.standard_normal(values.shape)
    sine = np.sin(2 * np.pi * 2.8 * np.arange(rows) / RATE_HZ)
    return Samples(values + tone * values.std() * sine[:, None], RATE_HZ, ('a', 'b', 'c'))


@pytest.mark.parametrize('seed', range(10, 16))
def test_a_narrow_mode_at_another_level_is_no_line(seed):
    """Its power is three times that of the reference, in three bins of 600 s."""
    record = motion(seed, (1.8, 0.8, 0.8, 0.8))
    assert line(prepare(motion(1), record, ('harmonic_disturbance',))) is None


def test_a_sine_beside_a_narrow_mode_is_a_line():
    """A twentieth of the motion, at 2.8 Hz."""
    record = motion(10, (1.8, 0.8, 0.8, 0.8), tone=0.05)
    assert line(prepare(motion(1), record, ('harmonic_disturbance',)))[1] == pytest.approx(
        2.8, abs=1 / SECONDS)
