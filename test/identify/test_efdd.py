"""Enhanced frequency domain decomposition, which SSI-COV is compared with."""
import numpy as np
import pytest
from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.identify import Identification, identify
from ssi_ros.identify.efdd import efdd, efdd_table
from ssi_ros.records import Mode, Samples

APART_HZ = np.array([2.0, 6.0, 17.0])
SHAPES = np.array([[1.0, 0.6, -0.2, 0.1], [0.3, -1.0, 0.5, 0.2], [0.1, 0.2, 1.0, -0.7]])
DAMPING = 0.01


def modes_of(values, seconds):
    """Return the modes of a record by SSI-COV, one window."""
    return identify(Samples(values, 100.0, tuple('abcd')), Identification(
        window_s=seconds, hop_s=seconds))[-1].modes


def test_modes_that_are_apart_agree(rng):
    """Of ten minutes frequencies are right within 0.3 %, dampings within a third."""
    values = accelerations(APART_HZ, SHAPES, 600.0, rng, damping=DAMPING)
    modes = sorted(modes_of(values, 600.0), key=lambda m: m.frequency_hz)
    found = efdd(values, 100.0, modes)
    assert [f.frequency_hz for f in found] == pytest.approx(APART_HZ, rel=3e-3)
    assert [f.damping_ratio for f in found] == pytest.approx([DAMPING] * 3, rel=0.33)
    assert min(f.mac for f in found) > 0.98
    assert efdd_table(modes, found).count('\n') == 3


def test_a_pair_that_bells_do_not_separate_has_no_number(rng):
    """A pair 0.1 % apart: where one bell has a line or two no damping is made of it."""
    values = accelerations(PAIR_HZ, PAIR_SHAPES, 120.0, rng)
    modes = modes_of(values, 120.0)
    found = efdd(values, 100.0, modes)
    close = [f for m, f in zip(modes, found) if m.frequency_hz > 10.0]
    assert close and any(np.isnan(f.damping_ratio) for f in close)
    assert 'no bell of its own' in efdd_table(modes, found)


def test_a_mode_outside_the_record_or_of_another_shape_has_none(rng):
    """Nothing is alike: no number, and no error; a record too short is refused."""
    values = accelerations(APART_HZ, SHAPES, 60.0, rng, damping=DAMPING)
    found = efdd(values, 100.0, (Mode(49.99, 0.01, np.ones(4)), Mode(6.0, 0.01, [1, 1, 1, 1j])))
    assert all(np.isnan(f.frequency_hz) for f in found)
    with pytest.raises(ValueError, match='63 samples given; 64 or more'):
        efdd(values[:63], 100.0, ())
