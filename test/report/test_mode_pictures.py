"""Axes of the pictures of modes."""
import pytest
from ssi_ros.records import Mode, WindowModes
from ssi_ros.report.mode_pictures import close_modes, mode_table, shape_table, tracks

WINDOWS = [WindowModes(k * 10 ** 9, (k + 60) * 10 ** 9, (
    Mode(2.0, 0.005, [1.0, -0.5], 0.01, 0.001, identity=0),)) for k in range(3)]
PAIR = WindowModes(0, 60 * 10 ** 9, tuple(
    Mode(f, 0.005, [1.0, -0.5], 0.01, 0.001, identity=i) for f, i in ((2.04, 4), (2.0, 9))))


def test_tracks_count_from_the_start_of_the_record():
    """The first point is at the end of the first window, 60 s after the first sample."""
    at_s = list(tracks(WINDOWS, 'frequency').figure.data[1].x)
    assert at_s == pytest.approx([60.0, 61.0, 62.0])
    assert tracks(WINDOWS, 'frequency').figure.layout.xaxis.rangemode == 'tozero'


def test_shapes_reach_one():
    """The largest component is 1, and so are the ends of the colour bar."""
    drawn = shape_table(WINDOWS[-1], ('a', 'b')).figure.data[0]
    assert (drawn.zmin, drawn.zmax) == (-1.0, 1.0)


def test_modes_are_numbered_by_frequency():
    """The table counts from the lowest frequency; the identity stands behind it."""
    rows = mode_table(PAIR).rows
    assert [(r[0], r[-1]) for r in rows] == [(2, 4), (1, 9)]


def test_close_modes_have_an_axis_of_their_own():
    """Two modes within five percent are drawn in one panel that they fill; one alone is not."""
    picture, = close_modes(PAIR)
    low, high = picture.figure.layout.xaxis.range
    assert low < 2.0 < 2.04 < high and high - low < 0.1
    assert close_modes(WINDOWS[-1]) == ()
