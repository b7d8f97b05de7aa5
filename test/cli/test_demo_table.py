"""The table of the demo holds each mode against its own line of theory."""
from dataclasses import dataclass

import numpy as np
from ssi_ros.cli._table import compare
from ssi_ros.records import Mode, WindowModes


@dataclass
class Theory:
    """Two modes that are closer than they are measured."""

    frequencies_hz = np.array([15.83, 15.84])
    damping_ratios = np.array([0.005, 0.005])
    shapes = np.array([[1.0, 1.0], [1.0, -1.0]])


def test_a_pair_is_distinguished_by_shape():
    """A pair whose frequencies were measured in reverse order is not exchanged."""
    modes = (Mode(15.82, 0.005, [1.0, -1.0], label='structural'),
             Mode(15.85, 0.005, [1.0, 1.0], label='structural'))
    found, text = compare(Theory(), 2, WindowModes(0, 1, modes))
    lines = text.splitlines()
    assert found == 2 and '15.8500' in lines[1] and '15.8200' in lines[2]
    assert all(line.split()[-2] == '1.000' for line in lines[1:])


def test_a_mode_of_another_shape_is_not_counted():
    """A mode at the frequency of a line with the shape of none is not that line."""
    alone = WindowModes(0, 1, (Mode(15.84, 0.005, [1.0, 0.0], label='structural'),))
    assert compare(Theory(), 1, alone)[0] == 0
