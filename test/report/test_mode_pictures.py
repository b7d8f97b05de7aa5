"""Axes of the pictures of modes."""
import pytest
from ssi_ros.records import Mode, WindowModes
from ssi_ros.report.mode_pictures import shape_table, tracks

WINDOWS = [WindowModes(k * 10 ** 9, (k + 60) * 10 ** 9, (
    Mode(2.0, 0.005, [1.0, -0.5], 0.01, 0.001, identity=0),)) for k in range(3)]


def test_tracks_count_from_the_start_of_the_record():
    """The first point is at the end of the first window, 60 s after the first sample."""
    at_s = list(tracks(WINDOWS, 'frequency').figure.data[1].x)
    assert at_s == pytest.approx([60.0, 61.0, 62.0])


def test_shapes_reach_one():
    """The largest component is 1, and so are the ends of the colour bar."""
    drawn = shape_table(WINDOWS[-1], ('a', 'b')).figure.data[0]
    assert (drawn.zmin, drawn.zmax) == (-1.0, 1.0)
