"""Nodes under bad input: real processes, real DDS."""
import json
import math
import time

from geometry_msgs.msg import AccelStamped
from node_records import grid, identifier, RATE_HZ, START_NS
import numpy as np
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.qos import QoSProfile, ReliabilityPolicy
from ssi_ros.ros.messages import time_of
from std_msgs.msg import Float64
from std_srvs.srv import Trigger


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
