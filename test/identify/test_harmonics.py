"""What may be called a line, and what the window is too short to tell."""
import numpy as np
import pytest
from ssi_ros.identify.harmonics import label
from ssi_ros.identify.modes import Candidate


def candidate(frequency_hz, damping, spread):
    """Return a candidate of one channel."""
    return Candidate(frequency_hz, damping, np.ones(1), 0.002, spread, 8, 0)


@pytest.mark.parametrize('frequency_hz', [0.36, 0.69, 0.9])
def test_few_cycles_are_undecided(frequency_hz):
    """Below 1 Hz in 120 s a mode of 0.5 % is as narrow as a line, whatever its peak."""
    word, note = label(candidate(frequency_hz, -0.0008, 0.0025), 900.0, 120.0)
    assert word == 'undecided' and 'too short' in note


def test_many_cycles_are_a_line():
    """At 12 Hz in 120 s the same peak can only be a line."""
    assert label(candidate(12.0, 1e-5, 1e-5), 900.0, 120.0)[0] == 'input_line'


@pytest.mark.parametrize('sharp', [1.0, 20.0, 900.0])
@pytest.mark.parametrize('frequency_hz', [0.4, 3.0, 30.0])
def test_negative_damping_is_no_sure_mode(frequency_hz, sharp):
    """No structure gains energy from its own motion, so such a pole is not sure."""
    assert label(candidate(frequency_hz, -0.002, 1e-4), sharp, 120.0)[0] != 'structural'
