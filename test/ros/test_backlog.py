"""A machine too slow for all windows: whole windows are skipped, samples never, and it is said."""
import time
from types import SimpleNamespace

from node_records import grid, identifier
import pytest
from ssi_ros.identify import Identification
from ssi_ros.identify.grid import Rows
from ssi_ros.identify.monitor import Monitor
from ssi_ros.ros import backlog, identifier_node
from test_nodes import resonance, said, Sender, status_of

SETTINGS = Identification(window_s=20.0, hop_s=2.0)
CHUNK = 50                  # rows that come together


class Node:
    """What a worker needs of its node."""

    def __init__(self):
        self.log, self.windows = [], []

    def get_logger(self):
        """Return itself, which takes warnings."""
        return self

    def warning(self, text):
        """Keep a warning."""
        self.log.append(text)

    def error(self, text):
        """Raise what the worker would only say."""
        raise AssertionError(text)

    def publish(self, window):
        """Keep a window."""
        self.windows.append(window)


@pytest.fixture
def slow(monkeypatch):
    """Let each identification take 0.2 s more, rows be late after 0.5 s; return how it was."""
    usual = Monitor._identify

    def slowly(self, keep=True):
        time.sleep(0.2)
        return usual(self, keep)
    monkeypatch.setattr(Monitor, '_identify', slowly)
    monkeypatch.setattr(backlog, 'LATE_S', 0.5)
    return usual


def worked(values, pause_s):
    """Return node and worker behind rows that came in chunks, and the most that waited [rows]."""
    node = Node()
    worker = identifier_node.Worker(node, SimpleNamespace(names=('a', 'b'), grid=None), 64,
                                    SETTINGS)
    most = 0
    for first in range(0, len(values), CHUNK):
        worker.rows.put(Rows(0, first, 0, 100.0, values[first:first + CHUNK]))
        most = max(most, worker.rows.waiting)
        time.sleep(pause_s)
    worker.rows.put(None)
    worker.thread.join(timeout=60.0)
    return node, worker, most


def test_windows_are_skipped_and_memory_is_bounded(slow, monkeypatch):
    """Samples come ten times as fast as windows are identified, for six windows' time."""
    values = resonance(30_000)
    node, worker, most = worked(values, 0.01)       # a hop in 0.04 s, a window takes 0.2 s
    ends = [w.end_ns for w in node.windows]
    # 150 hops, the first nine of which fill the window
    assert worker.rows.skipped and len(node.windows) + worker.rows.skipped == 141
    # what comes in LATE_S and while one window is identified, and as much again for the machine;
    # without skipping 24,000 wait at the end
    assert most < 2 * (0.5 + 0.2) / 0.01 * CHUNK
    assert len(node.log) == 1 and 'windows are skipped up to the newest one' in node.log[0]
    assert ends == sorted(ends)
    # no sample is lacking: a window behind skipped ones is that of all rows
    monkeypatch.setattr(Monitor, '_identify', slow)
    whole = Monitor(('a', 'b'), 100.0, 0, SETTINGS)
    equal = {w.end_ns: w for w in whole.push(values)}
    for window in node.windows:
        other = equal[window.end_ns]
        assert window.start_ns == other.start_ns
        assert [m.frequency_hz for m in window.modes] == [m.frequency_hz for m in other.modes]


def test_a_pause_costs_no_window(slow, monkeypatch):
    """What waits for less than LATE_S is identified late, all of it."""
    monkeypatch.setattr(backlog, 'LATE_S', 600.0)
    node, worker, _ = worked(resonance(4000), 0.0)
    assert not worker.rows.skipped and not node.log
    assert len(node.windows) == 11


@pytest.mark.slow
def test_a_node_that_is_too_slow_for_good(bench):
    """5,000 hops at once, 10 ms each: the newest window comes, and it is said once."""
    windows, health = identifier(bench, window_s=3.0, hop_s=0.01, lateness_s=60.0)
    sender = Sender(bench)
    sender.heard()
    rows, stamps = resonance(5000), grid(5000)
    sender.send(rows, stamps)
    bench.wait(said(health, 'identification', 'windows skipped, as this machine is too slow'),
               patience_s=60.0)
    bench.wait(lambda: windows[-1].end_ns >= stamps[4990], patience_s=60.0, what='for the newest')

    def number(key):
        """Return a number of the identification's newest status."""
        status = status_of(health, 'identification')
        return next(float(v.value) for v in status.values if v.key == key)
    bench.wait(lambda: number('rows_waiting') == 0 and number('windows_skipped') > 100)
    assert status_of(health, 'identification').level != b'\0'
    counts = {v.key: v.value for v in status_of(health, 'channel a').values}
    assert (counts['received'], counts['missing'], counts['late']) == ('5000', '0', '0')
    bench.processes.stop('identifier')
    printed = bench.words('identifier')
    assert printed.count('windows are skipped up to the newest one') == 1
    assert ' skipped; samples received [5000, 5000], missing [0, 0]' in printed
