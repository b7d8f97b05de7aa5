"""A line is seen in all channels jointly, and in one given the others, beside a recording."""
import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter
from ssi_ros.events.joint_lines import joint_line
from ssi_ros.gap.nominal.recordings import prepare
from ssi_ros.records import Samples

RATE_HZ, SECONDS, HZ = 25.0, 300.0, 2.8
MODES = (0.5, 0.001), (1.65, 0.01), (3.9, 0.012), (5.2, 0.005)
SHAPES = np.array([[1.0, 0.8, 0.6], [0.7, -0.9, 0.3], [0.4, 0.5, -1.0], [0.3, -0.6, 0.8]])


def motion(seed, tone=(0.0, 0.0, 0.0), count=4):
    """Return accelerations of modes, the first narrower than a bin, and a sine."""
    rng, rows = np.random.default_rng(seed), int(SECONDS * RATE_HZ)
    modal = []
    for f, xi in MODES[:count]:
        w = 2 * np.pi * f
        b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * xi * w, w ** 2]), 1 / RATE_HZ)
        modal.append(lfilter(np.ravel(b), a, rng.standard_normal(rows + 20_000))[20_000:])
    values = np.array(modal).T @ SHAPES[:count]
    values /= values.std(axis=0)
    values += 0.01 * rng.standard_normal(values.shape)
    sine = np.sin(2 * np.pi * HZ * np.arange(rows) / RATE_HZ)
    return Samples(values + sine[:, None] * tone, RATE_HZ, ('a', 'b', 'c'))


def found(before, now):
    """Return the joint line of a record beside a reference."""
    return joint_line(prepare(before, now, ('harmonic_disturbance',)), None)


def test_a_line_in_all_channels():
    """It is about as strong as the motion is in its bin, which no channel alone shows."""
    p_value, hz, _, faint = found(motion(1), motion(2, (0.03, 0.02, -0.03)))
    assert p_value < 1e-6 and not faint
    assert hz == pytest.approx(HZ, abs=1 / SECONDS)


def test_a_line_in_one_channel_alone():
    """The others show what the motion of that channel should be, of two modes."""
    p_value, hz, vector, _ = found(motion(1, count=2), motion(2, (0.0, 0.025, 0.0), 2))
    assert p_value < 1e-6
    assert hz == pytest.approx(HZ, abs=1 / SECONDS)
    assert np.abs(vector) == pytest.approx([0.0, 0.025, 0.0], rel=0.3)


@pytest.mark.parametrize('seed', range(2, 6))
def test_a_mode_narrower_than_a_bin_is_no_line(seed):
    """It is as narrow in the reference, by whatever prediction."""
    assert found(motion(1), motion(seed)) is None


def test_a_line_of_both_is_none():
    """It was there before."""
    assert found(motion(1, (0.0, 0.03, 0.0)), motion(2, (0.0, 0.04, 0.0))) is None
