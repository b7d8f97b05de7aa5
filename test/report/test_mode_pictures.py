"""Axes of the pictures of modes."""
import pytest
from ssi_ros.records import Mode, WindowModes
from ssi_ros.report.mode_pictures import (
    close_modes, mode_table, motion_of, notes, shape_table, tracks)

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
    assert [(r[0], r[-1]) for r in rows] == [(1, 9), (2, 4)]


def test_motions_are_named_by_the_signs_of_their_shapes():
    """Of two arrays with two sensors each; other channels have no such name."""
    channels = ('e1_a', 'e1_b', 'e2_a', 'e2_b')
    assert motion_of([1, 1, 1, 1], channels) == 'symmetric bending'
    assert motion_of([1, -1, -1, 1], channels) == 'antisymmetric torsion'
    assert motion_of([1, 1, 0.01, 0.0], channels) == 'E1 bending'
    assert motion_of([1, -0.5], ('a', 'b')) == ''
    modes = (Mode(2.0, 0.005, [1, -1, -1, 1], 0.01, 0.001, identity=3),)
    table = mode_table(WindowModes(0, 10 ** 9, modes), channels=channels)
    assert table.heads[3] == 'motion' and table.rows[0][3] == 'antisymmetric torsion'
    # a narrow screen shows the first columns alone
    assert table.heads[:3] == ('mode', 'frequency [Hz]', 'damping [%]')


def test_notes_name_their_modes():
    """Modes of one label and note share a sentence, by number."""
    modes = tuple(Mode(f, 0.005, [1.0, -0.5], 0.01, 0.001, identity=i, label='input_line',
                       note='it stands out') for f, i in ((2.04, 4), (2.0, 9)))
    assert notes(WindowModes(0, 10 ** 9, modes)) == ('Modes 1, 2: input line, it stands out.',)
    assert notes(PAIR) == ()


def test_close_modes_have_an_axis_of_their_own():
    """Two modes within five percent are drawn in one panel that they fill; one alone is not."""
    picture, = close_modes(PAIR)
    low, high = picture.figure.layout.xaxis.range
    assert low < 2.0 < 2.04 < high and high - low < 0.1
    assert close_modes(WINDOWS[-1]) == ()
