"""The sentence at the top of a report: how many modes, how many structural, which moved."""
from ssi_ros.records import Mode, WindowModes
from ssi_ros.report.mode_words import modes_sentence, moved


def window(end_s, *frequencies_hz, label='structural'):
    """Return a window with these modes, known to 0.01 Hz."""
    return WindowModes(0, round(end_s * 1e9), tuple(
        Mode(f, 0.005, [1.0], 0.01, 0.001, identity=i, label=label)
        for i, f in enumerate(frequencies_hz)))


def test_modes_that_stay():
    """Two structural modes within their spreads: none moved."""
    assert modes_sentence([window(1, 1.0, 5.0), window(2, 1.05, 5.02)]) == (
        '2 modes, 2 structural, none moved.')


def test_a_mode_that_moved_is_named():
    """0.2 Hz is 14 spreads of the difference; the mode is named by its frequency."""
    windows = [window(1, 1.0, 5.0), window(2, 1.0, 5.2)]
    assert moved(windows) == (1,)
    assert modes_sentence(windows) == '2 modes, 2 structural, 1 moved (5.200 Hz).'


def test_no_mode_has_a_reason():
    """A last window without modes gives its reason."""
    empty = WindowModes(0, 10 ** 9, (), reason='the channel is constant')
    assert modes_sentence([empty]) == 'No mode in the last window: the channel is constant.'


def test_one_undecided():
    """One mode is singular, and counted as structural only if it is."""
    assert modes_sentence([window(1, 1.0, label='undecided')]) == (
        '1 mode, 0 structural, none moved.')
