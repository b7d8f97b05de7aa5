"""Nodes at their ends, after pauses and through their lifecycle: real processes, real DDS."""
import resource
import signal
import time

from geometry_msgs.msg import AccelStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from node_records import grid, identifier, LISTEN, RATE_HZ, START_NS
import numpy as np
import pytest
from rosgraph_msgs.msg import Clock
from ssi_ros.bag import open_bag, read_channels, recover, write_samples
from ssi_ros.records import Samples
from ssi_ros.ros.messages import stamp_of
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger


@pytest.mark.parametrize('heard, pause_s', [
    pytest.param(1000, 2.5, marks=pytest.mark.slow), (3900, 1.5)])
def test_a_process_that_stood_still_loses_nothing(bench, heard, pause_s):
    """Reliable samples come late and channel by channel after a pause, even beyond the end."""
    topics = [f'/accelerometer/{n}' for n in ('e1_a', 'e1_b', 'e2_a', 'e2_b')]
    windows, _ = identifier(bench, channels=topics, lateness_s=60.0)
    got = [bench.collect(AccelStamped, topic, LISTEN) for topic in topics][0]
    bench.processes.start('simulator', 'simulator', speed=10.0, duration_s=40.0, reliable=True,
                          wait_for_subscribers=2)
    bench.wait(lambda: len(got) > heard)
    bench.processes.running['identifier'].send_signal(signal.SIGSTOP)
    time.sleep(pause_s)
    bench.processes.running['identifier'].send_signal(signal.SIGCONT)
    bench.wait(lambda: len(windows) == 5)     # they end at 20, 25, ... 40 s
    bench.processes.stop('identifier')
    assert 'received [4000, 4000, 4000, 4000], missing [0, 0, 0, 0]' in bench.words('identifier')


@pytest.mark.slow
def test_a_reader_that_never_wakes_is_told(bench):
    """A publisher that has sent all waits for its readers, and not for ever."""
    names = ('e1_a', 'e1_b', 'e2_a', 'e2_b')
    identifier(bench, channels=[f'/accelerometer/{n}' for n in names])
    bench.processes.start('simulator', 'simulator', speed=10.0, duration_s=20.0, reliable=True,
                          wait_for_subscribers=1)
    got = bench.collect(AccelStamped, '/accelerometer/e1_a', LISTEN)
    bench.wait(lambda: len(got) > 100)
    bench.processes.running['identifier'].send_signal(signal.SIGSTOP)
    assert bench.ended('simulator') == 0
    assert 'readers have not confirmed all of /accelerometer/e1_a' in bench.words('simulator')


@pytest.mark.parametrize('node, settings, words', [
    ('simulator', {'seeed': 1}, 'did you mean seed'),
    ('simulator', {'speed': -1.0}, 'out of range Min: 0.0'),
    ('simulator', {'config': '/no/such.yaml'}, 'No such file'),
    ('identifier', {'hop_s': 7.0}, 'whole number of hops'),
    ('identifier', {'channels': ['{topic: /a, type: no_msgs/msg/No}']}, 'not installed'),
    ('identifier', {'stamp_source': 'sun'}, "must be 'auto'"),
    ('player', {'bag': '/no/such/bag'}, 'does not exist'),
    ('recorder', {'topics': ['[']}, 'not a regular expression'),
    ('recorder', {'bag': '/dev/null'}, 'exists and is never overwritten'),
])
def test_bad_start_is_told(bench, node, settings, words):
    """A wrong parameter ends the node at once with exit code 2 and no traceback."""
    bench.processes.start(node, node, **settings)
    assert bench.ended(node) == 2
    assert words in bench.words(node) and 'Traceback' not in bench.words(node)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_clean_end(bench, tmp_path, number):
    """All nodes end on a signal with exit code 0, no traceback, and the bag is closed."""
    bench.processes.start('recorder', 'recorder', bag=tmp_path / 'bag')
    bench.processes.start('identifier', 'identifier')
    bench.processes.start('simulator', 'simulator', wait_for_subscribers=2, speed=5.0)
    got = bench.collect(AccelStamped, '/accelerometer/e1_a', LISTEN)
    bench.wait(lambda: len(got) > 400)      # the recorder may hear later and is ended first
    for process in bench.processes.running.values():
        process.send_signal(number)
    for name in list(bench.processes.running):
        assert bench.ended(name) == 0, bench.words(name)
        assert 'Traceback' not in bench.words(name)
    bag = open_bag(tmp_path / 'bag')
    assert bag.topic('/accelerometer/e1_a').count > 200


def test_killed_recorder_loses_little(bench, tmp_path):
    """After kill -9 a recovered bag lacks at most 0.6 s of what had been sent."""
    bench.processes.start('recorder', 'recorder', bag=tmp_path / 'bag')
    bench.processes.start('simulator', 'simulator', wait_for_subscribers=1)
    got = bench.collect(AccelStamped, '/accelerometer/e1_a', LISTEN)
    bench.wait(lambda: len(got) > 230)
    bench.processes.running['recorder'].kill()
    last_ns = stamp_of(got[-1].header.stamp)
    bench.ended('recorder')
    recover(tmp_path / 'bag', tmp_path / 'saved')
    stamps = read_channels(tmp_path / 'saved').stamps_ns[0]
    assert last_ns - stamps[-1] <= 0.6e9
    assert (np.diff(stamps) == 10_000_000).all()


def test_full_disk_is_told(bench, tmp_path):
    """A file that cannot grow: one clear error, exit code 1, what was flushed can be recovered."""
    bench.processes.start('recorder', 'recorder', bag=tmp_path / 'bag', compression='none')
    process = bench.processes.running['recorder']
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (200_000, 200_000))
    bench.processes.start('simulator', 'simulator', wait_for_subscribers=1, speed=5.0)
    bench.wait(lambda: 'recording stopped' in bench.words('recorder'))
    assert process.poll() is None                       # it goes on telling by /diagnostics
    process.send_signal(signal.SIGTERM)
    assert bench.ended('recorder') == 1 and 'Traceback' not in bench.words('recorder')
    recover(tmp_path / 'bag', tmp_path / 'saved')
    stamps = read_channels(tmp_path / 'saved').stamps_ns[0]
    assert len(stamps) > 100 and (np.diff(stamps) == 10_000_000).all()


def test_batch_holds_the_same_samples(bench):
    """The batched topic carries the rows of the single topics, with their first stamp."""
    single = [bench.collect(AccelStamped, f'/accelerometer/{name}', LISTEN)
              for name in ('e1_a', 'e1_b', 'e2_a', 'e2_b')][-1]
    batches = bench.collect(Float64MultiArray, '/accelerometer/batch', LISTEN)
    # a best-effort reader has the buffer of a socket: it must read while samples come
    bench.processes.start('simulator', 'simulator', batch=True, speed=10.0, duration_s=8.0,
                          wait_for_subscribers=1)
    bench.wait(lambda: bench.processes.running['simulator'].poll() is not None)
    assert bench.ended('simulator') == 0
    bench.wait(lambda: len(single) > 0 and len(batches) > 0)
    values = {stamp_of(m.header.stamp): m.accel.linear.z for m in single}
    compared = 0
    for b in batches:
        rows = np.array(b.data).reshape(b.layout.dim[0].size, b.layout.dim[1].size)
        column = b.layout.dim[1].label.split(',').index('e2_b')
        first = int(b.layout.dim[0].label.removeprefix('first_stamp_ns='))
        for k, stamp in enumerate(grid(len(rows), first).tolist()):
            if stamp in values:
                assert values[stamp] == rows[k, column]
                compared += 1
    assert compared > 300


def small_bag(path, n=300):
    """Write a bag of n numbered samples."""
    values = np.arange(n, dtype=float)[:, None]
    write_samples(path, Samples(values, RATE_HZ, ('a',), START_NS))
    return path


def test_player_loops_forward(bench, tmp_path):
    """In a loop neither stamps nor /clock ever go back, and no sample is left out."""
    got = bench.collect(AccelStamped, '/accelerometer/a', LISTEN)
    clock = bench.collect(Clock, '/clock')
    bench.processes.start('player', 'player', bag=small_bag(tmp_path / 'bag'), rate=5.0,
                          loop=True, wait_for_subscribers=1)
    bench.wait(lambda: len(got) > 900)
    stamps = np.array([stamp_of(m.header.stamp) for m in got])
    assert (np.diff(stamps) > 0).all()
    values = np.array([m.accel.linear.z for m in got])
    np.testing.assert_array_equal(values, np.arange(len(values)) % 300)
    ticks = [stamp_of(c.clock) for c in clock]
    assert len(ticks) > 20 and (np.diff(ticks) >= 0).all()


def test_player_pauses(bench, tmp_path):
    """Pause holds the bag, resume goes on without a loss."""
    got = bench.collect(AccelStamped, '/accelerometer/a', LISTEN)
    bench.processes.start('player', 'player', bag=small_bag(tmp_path / 'bag'),
                          wait_for_subscribers=1)
    bench.wait(lambda: len(got) > 50)
    assert bench.call(Trigger, '/player/pause', Trigger.Request()).success
    bench.wait(lambda n=[0]: (before := n[0], n.__setitem__(0, len(got)))[0] == len(got) > 0
               and before > 0)
    held = len(got)
    end = time.monotonic() + 0.5
    while time.monotonic() < end:
        bench.executor.spin_once(timeout_sec=0.05)
    assert len(got) <= held + 1 < 300
    assert bench.call(Trigger, '/player/resume', Trigger.Request()).success
    assert bench.ended('player') == 0
    bench.wait(lambda: len(got) == 300)


def test_lifecycle(bench):
    """Without autostart the node waits; configure, activate, deactivate, cleanup, again."""
    bench.processes.start('simulator', 'simulator', autostart=False, speed=2.0)
    got = bench.collect(AccelStamped, '/accelerometer/e1_a', LISTEN)

    def change(transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        assert bench.call(ChangeState, '/simulator/change_state', request).success

    def state():
        answer = bench.call(GetState, '/simulator/get_state', GetState.Request())
        return answer.current_state.label
    assert state() == 'unconfigured'
    for _ in range(2):
        change(Transition.TRANSITION_CONFIGURE)
        change(Transition.TRANSITION_ACTIVATE)
        assert state() == 'active'
        before = len(got)
        bench.wait(lambda n=before: len(got) > n + 20)
        change(Transition.TRANSITION_DEACTIVATE)
        change(Transition.TRANSITION_CLEANUP)
        assert state() == 'unconfigured'
