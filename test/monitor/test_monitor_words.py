"""The watch and its words: histories, trends, the sketch, health, what is missing."""
from dataclasses import replace
import math

import pytest

from ssi_ros.effects import inject, simulate_setup
from ssi_ros.identify import Identification
from ssi_ros.identify.stamped import identify_stamped
from ssi_ros.model import load_spacecraft
from ssi_ros.monitor.watch import (
    histories, KEPT, Status, Watch, with_gap, with_health, with_where, with_window)
from ssi_ros.monitor.words import (
    arrow, gap_lines, head_line, health_lines, mode_lines, sketch_lines, sparkline, summary_line,
    text)
from ssi_ros.records import Mode, WindowModes


def window(end_s, *frequencies_hz, deaths=(), label='structural'):
    """Return a window of 10 s with these modes; identities by their order."""
    modes = tuple(Mode(f, 0.005, [1.0, -1.0], 0.01, 0.001, identity=i, label=label)
                  for i, f in enumerate(frequencies_hz))
    return WindowModes(round((end_s - 10) * 1e9), round(end_s * 1e9), modes, deaths=deaths)


def watch_of(*windows):
    """Return a watch that has heard these windows."""
    watch = Watch()
    for w in windows:
        watch = with_window(watch, w, 0.0)
    return watch


def test_sparkline():
    """The least is the lowest bar, the greatest the highest, a missing value a space."""
    assert sparkline([0.0, 1.0, None, 0.5, float('nan')]) == '▁█ ▅ '
    assert sparkline([2.0, 2.0]) == '▅▅' and sparkline([None]) == ' '


@pytest.mark.parametrize('step, sign', [(0.0, '→'), (0.06, '→'), (0.08, '↑'), (-0.08, '↓')])
def test_arrow_means_more_than_chance(step, sign):
    """An arrow says that a frequency has moved by more than five spreads of the difference."""
    watch = watch_of(window(10, 5.0), window(11, 5.0 + step))     # spread 0.01 each
    assert arrow(histories(watch.windows)[0]) == sign


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_a_record_without_drift_has_no_arrow(seed):
    """
    The screens of a simulated record of 900 s without drift show no arrow.

    The rate that is stated is 1 screen in 100; each of these records has 25, which share windows.
    """
    record = simulate_setup(inject(load_spacecraft(), [], 900.0), seed)
    windows, _ = identify_stamped(record.channels, [record.stamps_ns()] * 4, record.values.T,
                                  Identification(window_s=120.0, hop_s=20.0))
    screens = [watch_of(*windows[k:k + 16]) for k in range(len(windows) - 15)]
    assert len(screens) == 25
    for watch in screens:
        assert len(mode_lines(watch)) > 10             # there is something to be wrong about
        assert not any(mark in line for line in mode_lines(watch)[1:] for mark in '↑↓')


def test_one_line_of_health():
    """The summary of a small screen: what is worst, or that all is well."""
    watch = watch_of(window(10, 5.0))
    assert 'nothing on /diagnostics' in summary_line(watch)
    watch = with_health(watch, [Status('b', 'ok', 'fine'), Status('a', 'ok', 'fine')], 0.0)
    assert summary_line(watch) == 'no gap node; health: all 2 ok'
    watch = with_health(watch, [Status('c', 'warn', 'slow'), Status('d', 'error', 'lost')], 0.0)
    assert 'ERROR d: lost' in summary_line(watch)


def test_missing_mode_is_named_and_a_dead_one_gone():
    """A mode that the last window lacks stays with a word; after its end it goes."""
    watch = watch_of(window(10, 1.0, 5.0), window(11, 1.0))
    lines = mode_lines(watch)
    assert len(lines) == 3 and 'missing for 1' in lines[2]
    watch = with_window(watch, window(12, 1.0, deaths=(1,)), 0.0)
    assert len(mode_lines(watch)) == 2


def test_time_that_jumps_back_begins_anew():
    """A replay that starts again does not mix with what was before."""
    watch = watch_of(window(10, 1.0), window(11, 1.0), window(10, 2.0))
    assert len(watch.windows) == 1 and '2.000' in mode_lines(watch)[1]


def test_memory_is_bounded():
    """A week of windows keeps the last ones."""
    watch = watch_of(*(window(10 + k, 1.0) for k in range(3 * KEPT)))
    assert len(watch.windows) == KEPT
    for k in range(3 * KEPT):
        watch = with_gap(watch, 'gap', 0.1, 0.0)
    assert len(watch.gap) == KEPT


def test_sketch_keeps_a_mode_in_its_column():
    """Steady modes make straight columns, the latest window on top, with the count beside."""
    lines = sketch_lines(watch_of(window(10, 1.0, 10.0), window(11, 1.0, 10.0),
                                  window(12, 1.0, label='undecided')), columns=60)
    assert lines[0].count('○') == 1 and lines[0].endswith('│ 1')
    assert lines[1] == lines[2] and lines[1].count('●') == 2
    assert lines[0].index('○') == lines[1].index('●')
    assert lines[-1].split()[-1] == 'Hz'


def test_a_mode_of_one_frequency_alone_can_be_drawn():
    """One mode, or none, makes a sketch too."""
    assert '●' in sketch_lines(watch_of(window(10, 1.0)))[0]
    assert sketch_lines(watch_of(window(10))) == ['nothing to draw yet']


def test_worst_health_comes_first():
    """What is not well stands on top, in words, not in colour alone."""
    watch = with_health(Watch(), [Status('a', 'ok', 'fine'), Status('b', 'error', 'silent'),
                                  Status('c', 'warn', 'slow')], 0.0)
    assert [line.split()[0] for line in health_lines(watch)] == ['ERROR', 'WARN', 'ok']
    watch = with_health(watch, [Status('b', 'ok', 'back')], 0.0)
    assert 'ERROR' not in '\n'.join(health_lines(watch))


def test_gap_with_and_without_its_node():
    """Without a gap node the monitor says so; with one it shows meter, site and effect."""
    assert 'no gap node' in gap_lines(Watch())[0]
    watch = with_gap(with_gap(with_gap(Watch(), 'gap', 0.2, 0.0), 'floor', 0.11, 0.0),
                     'deviations', 40.0, 0.0)
    watch = with_where(watch, [Status('leading', 'warn', 'sensor_gain')], 0.0)
    lines = '\n'.join(gap_lines(watch))
    assert '0.2000' in lines and '+40.0 sd' in lines and 'sensor_gain' in lines
    assert '0.2000' in '\n'.join(gap_lines(replace(watch, floor=(), deviations=())))


def test_silence_is_told():
    """Nothing heard, and nothing heard for long, are told apart."""
    assert head_line(Watch(), 0.0) == 'nothing heard yet'
    watch = watch_of(window(10, 1.0))
    assert 'SILENT' not in head_line(watch, 3.0) and 'SILENT for 60 s' in head_line(watch, 60.0)


def test_reason_of_an_empty_window():
    """A window without modes shows its reason; before any window there is a hint."""
    empty = replace(window(10), reason='channel e1_a is constant')
    assert 'constant' in text(watch_of(empty), 0.0)
    assert 'identifier running' in mode_lines(Watch())[1]
    assert math.isnan(Watch().heard_s)
