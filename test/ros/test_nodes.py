"""Nodes under bad input, at their ends and through their lifecycle: real processes, real DDS."""
import json
import math
import resource
import signal
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
import numpy as np
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from ssi_ros.bag import open_bag, read_channels, recover, write_samples
from ssi_ros.records import Samples
from ssi_ros.ros.messages import stamp_of, time_of, window_of
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger

START_NS = 1_000_000_000_000_000_000
RATE_HZ = 100.0
LISTEN = QoSProfile(depth=5000, reliability=ReliabilityPolicy.BEST_EFFORT)


def resonance(n, channels=2, seed=5):
    """Return n rows of a 7 Hz mode with 1 % damping under white noise, and its two sensors."""
    rng = np.random.default_rng(seed)
    pole = np.exp((-0.01 + 1j) * 2 * np.pi * 7.0 / RATE_HZ)
    z, out = 0j, np.empty(n)
    for k, w in enumerate(rng.standard_normal(n)):
        z = pole * z + w
        out[k] = z.imag
    shape = np.linspace(1.0, -0.5, channels)
    return out[:, None] * shape + 0.05 * rng.standard_normal((n, channels))


class Sender:
    """Two accelerometers of the test's own, with any fault."""

    def __init__(self, bench, names=('a', 'b'), reliable=True):
        qos = QoSProfile(depth=10_000, reliability=(
            ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT))
        self.bench = bench
        self.publishers = [bench.node.create_publisher(AccelStamped, f'/{n}', qos)
                           for n in names]

    def heard(self):
        """Wait until somebody listens, and a moment more."""
        self.bench.wait(lambda: all(p.get_subscription_count() for p in self.publishers))
        time.sleep(0.5)

    def send(self, values, stamps_ns, skip=()):
        """Publish rows; `skip` names columns that stay silent."""
        for k, (row, stamp) in enumerate(zip(values, stamps_ns)):
            for c, value in enumerate(row):
                if c not in skip:
                    message = AccelStamped()
                    message.header.stamp = time_of(stamp)
                    message.accel.linear.z = float(value)
                    self.publishers[c].publish(message)
            if k % 50 == 49:
                time.sleep(0.005)             # as fast as 10,000 rows a second, no faster


def grid(n, start_ns=START_NS):
    """Return n stamps at 100 Hz."""
    return start_ns + np.arange(n, dtype=np.int64) * 10_000_000


def identifier(bench, **more):
    """Start an identifier on /a and /b with a short window."""
    settings = {'channels': ['/a', '/b'], 'window_s': 20.0, 'hop_s': 5.0, 'reliable': True, **more}
    windows = []
    bench.node.create_subscription(
        DiagnosticArray, '/identifier/modes', lambda m: windows.append(window_of(m)), 100)
    health = bench.collect(DiagnosticArray, '/diagnostics')
    bench.processes.start('identifier', 'identifier', **settings)
    return windows, health


def status_of(health, name):
    """Return the newest status of a name; None before it came."""
    for message in reversed(health):
        for s in message.status:
            if s.name == f'identifier: {name}':
                return s
    return None


def said(health, name, words):
    """Return a condition: the status has these words."""
    return lambda: (s := status_of(health, name)) is not None and words in s.message


def test_faulty_samples_are_survived(bench):
    """NaN, inf, 1e300, duplicates, disorder, a gap: counted, refused or bridged, never fatal."""
    windows, health = identifier(bench)
    sender = Sender(bench)
    sender.heard()
    rows, stamps = resonance(6000), grid(6000)
    rows[100, 0], rows[200, 1], rows[300, 0] = math.nan, math.inf, 1e300
    stamps[[400, 401]] = stamps[[401, 400]]
    stamps[500] = stamps[499]
    sender.send(rows[:2800], stamps[:2800])
    sender.send(rows[3000:], stamps[3000:])                # 2 s are missing
    bench.wait(lambda: windows and windows[-1].end_ns == START_NS + 60 * 10 ** 9)
    last = windows[-1]                                     # 40 to 60 s, after all faults
    assert any(abs(m.frequency_hz / 7.0 - 1.0) < 0.02 for m in last.modes), last.reason
    broken = [w for w in windows if w.start_ns < stamps[300] <= w.end_ns]
    assert broken and all(w.reason for w in broken if not w.modes)
    # health comes once a second: the newest may be older than the newest window
    bench.wait(lambda: (s := status_of(health, 'channel a')) is not None
               and int({v.key: v.value for v in s.values}['missing']) >= 200)
    values = {v.key: v.value for v in status_of(health, 'channel a').values}
    assert values['not_finite'] == '1' and values['out_of_order'] == '1'
    assert values['duplicates'] == '1'
    assert bench.processes.running['identifier'].poll() is None


def test_silent_channel_is_told(bench):
    """A channel without publisher is named with what to look at, in health and windows."""
    windows, health = identifier(bench)
    sender = Sender(bench, names=('a',))
    sender.heard()
    sender.send(resonance(2700, 1), grid(2700))
    bench.wait(said(health, 'channel b', 'silent: no publisher of /b'))
    bench.wait(lambda: windows)
    assert 'channel b misses' in windows[0].reason


def test_other_rate_is_told(bench):
    """A channel at half the rate is an error with both rates, and windows name it."""
    windows, health = identifier(bench, rate_hz=100.0)
    sender = Sender(bench)
    sender.heard()
    rows, stamps = resonance(2700), grid(2700)
    for k in range(0, 2700, 2):
        sender.send(rows[k:k + 1], stamps[k:k + 1])
        sender.send(rows[k + 1:k + 2], stamps[k + 1:k + 2], skip=(1,))
    bench.wait(said(health, 'channel b', 'arrives at 50.00 Hz, the grid is at 100.00 Hz'))
    bench.wait(lambda: windows)
    assert windows[0].reason and not windows[0].modes


def test_incompatible_qos_is_told(bench):
    """A best-effort publisher and a reliable subscriber never connect: health says so."""
    _, health = identifier(bench, reliable=True)
    sender = Sender(bench, reliable=False)
    bench.wait(lambda: status_of(health, 'channel a') is not None)
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        sender.send(np.ones((1, 2)), grid(1))
        bench.executor.spin_once(timeout_sec=0.05)
    bench.wait(said(health, 'channel a', 'compare type and QoS'))


def test_zero_stamps_take_the_time_of_receipt(bench):
    """A driver that leaves its header empty is still heard, with a warning."""
    _, health = identifier(bench)
    sender = Sender(bench)
    sender.heard()

    def told():
        sender.send(np.ones((1, 2)), np.zeros(1, dtype=np.int64))
        time.sleep(0.01)
        # at any time: a pause of the machine makes the newest say that the rate is uneven
        return any(s.name == 'identifier: channel a'
                   and 'stamped by the time of receipt' in s.message
                   for m in health for s in m.status)
    bench.wait(told)


def test_clock_jump_begins_a_window(bench):
    """The clock jumps back an hour: said, and a new window is identified after it."""
    windows, _ = identifier(bench)
    sender = Sender(bench)
    sender.heard()
    rows = resonance(5000)
    later = START_NS - 3600 * 10 ** 9
    sender.send(rows[:2200], grid(2200))
    bench.wait(lambda: len(windows) == 1)
    sender.send(rows[2200:], grid(2800, later))
    bench.wait(lambda: any(w.end_ns < START_NS for w in windows))
    assert all(w.start_ns >= START_NS or w.end_ns <= later + 28 * 10 ** 9 for w in windows)
    bench.wait(lambda: 'jumped by -36' in bench.words('identifier'))


def test_identify_now_and_changes(bench):
    """The service answers at any time; settings change while it runs, within their range."""
    windows, health = identifier(bench)
    sender = Sender(bench)
    sender.heard()
    answer = bench.call(Trigger, '/identifier/identify_now', Trigger.Request())
    assert not answer.success and 'no samples yet' in answer.message
    rows = resonance(6000)
    sender.send(rows[:1600], grid(1600))
    bench.wait(lambda: (s := status_of(health, 'identification')) is not None
               and float({v.key: v.value for v in s.values}['window_fill']) > 0.7)
    answer = bench.call(Trigger, '/identifier/identify_now', Trigger.Request())
    assert 'frequency_hz' in json.loads(answer.message)

    def ask(name, value):
        request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
        return bench.call(SetParameters, '/identifier/set_parameters', request).results[0]
    double = ParameterType.PARAMETER_DOUBLE
    result = ask('window_s', ParameterValue(type=double, double_value=1e6))
    assert not result.successful and '86400' in result.reason
    result = ask('window_s', ParameterValue(type=double, double_value=12.0))
    assert not result.successful and 'whole number of hops' in result.reason
    result = ask('rate_hz', ParameterValue(type=double, double_value=50.0))
    assert not result.successful and 'cannot change while' in result.reason
    assert ask('window_s', ParameterValue(type=double, double_value=10.0)).successful
    before = len(windows)
    sender.send(rows[1600:], grid(6000)[1600:])
    bench.wait(lambda: len(windows) > before + 3)
    assert all(w.end_ns - w.start_ns == 10 ** 10 for w in windows[before:])


def test_any_numeric_field(bench):
    """Channels without header are taken too: std_msgs/Float64, stamped by receipt."""
    channel = '{topic: /x, type: std_msgs/msg/Float64, field: data}'
    _, health = identifier(bench, channels=[channel])
    publisher = bench.node.create_publisher(Float64, '/x', 10)
    bench.wait(lambda: publisher.get_subscription_count() > 0)
    for k in range(300):
        publisher.publish(Float64(data=float(k)))
        time.sleep(0.01)
    bench.wait(said(health, 'channel x.data', 'stamped by the time of receipt'))


@pytest.mark.parametrize('heard, pause_s', [(1000, 2.5), (3900, 1.5)])
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
    bench.processes.start('simulator', 'simulator', batch=True, speed=0.0, duration_s=8.0,
                          wait_for_subscribers=1)
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
