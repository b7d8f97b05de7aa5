"""Two publishers on one topic: said at once by all who listen, and no result is made of both."""
from diagnostic_msgs.msg import DiagnosticArray
from node_records import grid, identifier, newest
import pytest
from ssi_ros.bag import open_bag
from ssi_ros.ros.mixed import BACKS, Senders
from std_msgs.msg import Bool
from std_srvs.srv import Trigger
from test_nodes import resonance, said, Sender, status_of


def mixed(numbers, step_s=0.01):
    """Return whether messages with these numbers, so long apart, come from several publishers."""
    now = [0.0]
    senders = Senders(lambda: now[0])
    for number in numbers:
        now[0] += step_s
        senders.take(number)
    return senders.mixed


def test_numbers_tell_who_sends():
    """A restart, losses and a middleware without numbers are one publisher; turns are two."""
    assert not mixed([1, 2, 3, 9, 10])
    assert not mixed([*range(50, 90), 1, 2, 3, 1, 2])
    assert not mixed([None] * 20)
    assert mixed([k for n in range(1, 2 + BACKS) for k in (n, n)])
    assert mixed([k for n in range(2 + BACKS) for k in (900 + n, 5 + n)])
    assert not mixed([900, 1, 901, 2, 902, 3], step_s=9.0)


@pytest.mark.parametrize('beside_ns', [0, 5_000_000])
def test_two_publishers_are_named_and_never_mixed(bench, tmp_path, beside_ns):
    """Equal stamps, and stamps in the middle of the others'."""
    windows, health = identifier(bench, window_s=5.0, hop_s=1.0)
    bench.processes.start('recorder', 'recorder', bag=tmp_path / 'bag', topics=['/a', '/b'])
    one, two = Sender(bench), Sender(bench)
    bench.wait(lambda: bench.words('recorder').count('joined') == 2)
    # by the identifier and the recorder
    bench.wait(lambda: all(p.get_subscription_count() == 2
                           for p in one.publishers + two.publishers))
    one.heard()
    rows, stamps = resonance(9000), grid(9000)
    one.send(rows[:1000], stamps[:1000])
    bench.wait(lambda: windows)
    bench.wait(said(health, 'channel a', 'where both send, samples mix'))
    sent = [1000]

    def both(condition):
        """Send 0.1 s of each, until a condition holds."""
        k, sent[0] = sent[0], sent[0] + 10
        for i in range(k, k + 10):
            one.send(rows[i:i + 1], stamps[i:i + 1])
            two.send(rows[i - 900:i - 899], stamps[i:i + 1] + beside_ns)
        return condition()
    bench.wait(lambda: both(said(health, 'channel a', '2 publishers send on /a at once')))
    bench.wait(lambda: both(lambda: 'publishers send on /b' in newest(
        health, 'recorder: bag').message))
    before = len(windows)       # the last one may arrive after what is said of both
    assert newest(health, 'recorder: bag').level == b'\1'
    # sent on meanwhile: after two seconds without a sample they are silent instead
    bench.wait(lambda: both(said(health, 'identification', 'no usable sample of a, b')))
    assert status_of(health, 'identification').level == b'\2'
    answer = bench.call(Trigger, '/identifier/identify_now', Trigger.Request())
    assert not answer.success and 'publishers send on /a' in answer.message
    assert len(windows) == before and bench.words('identifier').count('on /a at once') == 1
    # the first two turns tell nothing; no window holds more than that of both
    assert all(w.end_ns <= stamps[1100] for w in windows)
    bench.processes.stop('recorder')
    assert '2 publishers send on /a' in bench.words('recorder')
    assert 'sent at once on /a, /b' in open_bag(tmp_path / 'bag').warnings[0]


@pytest.mark.slow
def test_two_simulators_beside_the_gap_node(bench):
    """Two simulators of other seeds: no alarm, no verdict, and ~/diagnose is refused."""
    health = bench.collect(DiagnosticArray, '/diagnostics')
    alarms = bench.collect(Bool, '/gap/alarm')
    bench.processes.start('gap', 'gap', reliable=True, effects=['sensor_gain'], window_s=60.0,
                          hop_s=10.0, false_alarm_every_s=600.0)
    bench.wait(lambda: 'waiting for' in bench.words('gap'))
    simulated = {'reliable': True, 'speed': 10.0, 'wait_for_subscribers': 1}
    bench.processes.start('simulator', 'simulator', seed=1, **simulated)
    bench.wait(lambda: (s := newest(health, 'gap: gap')) and 'sd above the floor' in s.message,
               60.0)
    bench.processes.start('other', 'simulator', seed=2, **simulated)
    bench.wait(lambda: (s := newest(health, 'gap: channel e2_b')) and
               '2 publishers send on /accelerometer/e2_b at once' in s.message)
    bench.wait(lambda: 'no usable sample of e1_a' in newest(health, 'gap: alarm').message)
    assert newest(health, 'gap: alarm').level == b'\3'
    assert newest(health, 'gap: gap').level == b'\2'
    answer = bench.call(Trigger, '/gap/diagnose', Trigger.Request())
    assert not answer.success and 'publishers send on /accelerometer/e1_a' in answer.message
    bench.processes.running.pop('other').kill()
    bench.wait(lambda: 'one publisher again' in bench.words('gap'))
    assert not any(a.data for a in alarms)
