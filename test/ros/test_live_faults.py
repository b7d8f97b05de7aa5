"""Streams that stop, lose, change their rate or carry strange stamps: said at once, and once."""
import re
import signal

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelStamped
from node_records import grid, identifier, newest, START_NS
import numpy as np
import pytest
from std_msgs.msg import Float64
from test_nodes import resonance, said, Sender, status_of


def test_a_channel_that_dies_is_named(bench):
    """Of two channels one stops: its rate is 0 and it is named; both stop: nothing is OK."""
    windows, health = identifier(bench, window_s=5.0, hop_s=1.0)
    sender = Sender(bench)
    sender.heard()
    rows, stamps = resonance(6000), grid(6000)
    sender.send(rows[:800], stamps[:800])
    bench.wait(said(health, 'channel b', '100.00 Hz'))
    bench.wait(lambda: len(windows) >= 3)
    sent = [800]

    def one_goes_on():
        """Send 0.1 s of the channel that lives."""
        sender.send(rows[sent[0]:sent[0] + 10], stamps[sent[0]:sent[0] + 10], skip=(1,))
        sent[0] = min(sent[0] + 10, 5000)
        return said(health, 'channel b', 'silent for')()
    bench.wait(one_goes_on)
    values = {v.key: v.value for v in status_of(health, 'channel b').values}
    assert float(values['rate_hz']) == 0.0 and status_of(health, 'channel b').level == b'\2'
    assert status_of(health, 'channel a').level != b'\2'
    bench.wait(said(health, 'identification', 'no sample of b for'))
    bench.wait(said(health, 'channel a', 'silent for'))
    bench.wait(said(health, 'identification', 'no sample for'))
    assert status_of(health, 'identification').level == b'\2'
    sender.send(rows[5000:5200], stamps[5000:5200])
    bench.wait(lambda: 'samples again of a, b' in bench.words('identifier'))
    assert bench.words('identifier').count('no sample any more of b') == 1


def test_a_publisher_at_another_rate_is_followed(bench):
    """From 100 to 80 Hz: no window holds both, and the next is at the new rate."""
    windows, health = identifier(bench, window_s=5.0, hop_s=1.0)
    sender = Sender(bench)
    sender.heard()
    rows = resonance(3000)
    later = START_NS + 10 ** 10 + np.arange(2000, dtype=np.int64) * 12_500_000
    sender.send(rows[:1000], grid(1000))
    sender.send(rows[1000:], later)
    bench.wait(said(health, 'channel a', '80.00 Hz'))
    bench.wait(lambda: windows and windows[-1].start_ns > later[200])
    assert 'has changed: the window begins anew' in bench.words('identifier')
    # the first 128 stamps at the new rate tell it
    assert not [w for w in windows if w.start_ns < later[0] and w.end_ns > later[130]]


@pytest.mark.slow
def test_hostile_stamps_are_bounded_and_said_once(bench):
    """Equal stamps, far ones, negative ones, another type: errors, no traceback, said once."""
    _, health = identifier(bench, channels=['/a', '/b', '/c', '/d'])
    publishers = [bench.node.create_publisher(AccelStamped, f'/{n}', 10_000) for n in 'abc']
    bench.node.create_publisher(Float64, '/d', 10)
    bench.wait(lambda: all(p.get_subscription_count() for p in publishers))
    message, sent = AccelStamped(), [0]
    message.accel.linear.z = 1.0

    def reported():
        """Send 100 more of each."""
        for k in range(sent[0], sent[0] + 100 if sent[0] < 5000 else 0):
            for publisher, stamp in zip(publishers, (START_NS, k * 700 * 10 ** 9, -k - 1)):
                message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10 ** 9)
                publisher.publish(message)
        sent[0] += 100
        return 'of no use' in bench.words('identifier')
    bench.wait(reported)
    for name in 'abcd':
        bench.wait(lambda: status_of(health, f'channel {name}').level == b'\2', what=name)
    assert status_of(health, 'identification').level == b'\2'
    assert ('/d is published as std_msgs/msg/Float64, and read as geometry_msgs/msg/AccelStamped'
            in status_of(health, 'channel d').message)
    printed = bench.words('identifier')
    assert 'Traceback' not in printed and len(printed.splitlines()) < 6


def test_the_recorder_counts_what_it_lost(bench, tmp_path):
    """A recorder that stood still says how many messages went by, and that its topic stopped."""
    health = bench.collect(DiagnosticArray, '/diagnostics')
    bench.processes.start('recorder', 'recorder', bag=tmp_path / 'bag', topics=['/a', '/b'],
                          queue_depth=10)
    sender = Sender(bench, reliable=False)
    bench.wait(lambda: bench.words('recorder').count('joined') == 2)
    sender.heard()
    rows, sent = np.ones((1, 2)), [0]

    def send(n, pause_s=0.01):
        """Send n rows, as a sensor does."""
        for _ in range(n):
            sender.send(rows, [START_NS + sent[0] * 10_000_000])
            sent[0] += 1
            bench.executor.spin_once(timeout_sec=pause_s)

    def written():
        send(20)
        s = newest(health, 'recorder: bag')
        return s is not None and int({v.key: v.value for v in s.values}['written']) > 200
    bench.wait(written)
    send(150)             # steady for more than two seconds
    process = bench.processes.running['recorder']
    process.send_signal(signal.SIGSTOP)
    send(1000, 0.0)
    process.send_signal(signal.SIGCONT)
    send(100)
    bench.wait(lambda: 'no message for' in newest(health, 'recorder: bag').message)
    status = newest(health, 'recorder: bag')
    values = {v.key: v.value for v in status.values}
    assert status.level == b'\2' and 'lost on the way' in status.message
    assert int(values['lost']) + int(values['written']) == 2 * sent[0]
    bench.processes.stop('recorder')
    assert f'{values["written"]} messages in' in bench.words('recorder')


def test_a_grid_given_up_forgets_no_loss(bench):
    """Stamps of which no grid can be made begin the window anew; what was lost before is said."""
    windows, health = identifier(bench, window_s=5.0, hop_s=1.0)
    sender = Sender(bench)
    sender.heard()
    rows, stamps = resonance(800), grid(500)
    for k in range(0, 500, 5):
        sender.send(rows[k:k + 1], stamps[k:k + 1], skip=(1,))
        sender.send(rows[k + 1:k + 5], stamps[k + 1:k + 5])
    bench.wait(said(health, 'channel b', '100.00 Hz'))

    def values_of_b():
        """Return the numbers of the newest status of channel b."""
        return {v.key: v.value for v in status_of(health, 'channel b').values}
    # all of it has come before the grid is given up
    bench.wait(lambda: int(values_of_b()['received']) >= 400)
    far = START_NS + 10 ** 10 + np.arange(12, dtype=np.int64) * 500 * 10 ** 9
    sender.send(rows[:12], far)
    bench.wait(lambda: 'the window begins anew' in bench.words('identifier'))

    def counted():
        """Return whether a status of after the grid was given up still knows of the loss."""
        values = values_of_b()
        return int(values['received']) >= 412 and int(values['missing']) >= 90
    bench.wait(counted)
    bench.wait(lambda: re.search(r'samples missing in \d+ s \(.*b: \d{2,}',
                                 bench.words('identifier')))
    later = int(far[-1]) + 10 ** 9
    sender.send(rows, grid(800, later))
    bench.wait(lambda: windows and windows[-1].end_ns > later)
    assert windows[-1].start_ns > START_NS + 10 ** 10       # not the window of the first grid
    assert 'Traceback' not in bench.words('identifier')


def test_a_clock_that_runs_away_is_an_error(bench):
    """Within 0.1 % of the rate, but half a sample apart after 10 s: the channel is named."""
    _, health = identifier(bench)
    sender = Sender(bench, names=('a',)), Sender(bench, names=('b',))
    for s in sender:
        s.heard()
    rows = resonance(3000)
    fast = START_NS + np.arange(3000, dtype=np.int64) * 9_997_000
    for k in range(0, 3000, 100):
        sender[0].send(rows[k:k + 100, :1], grid(3000)[k:k + 100])
        sender[1].send(rows[k:k + 100, 1:], fast[k:k + 100])
    bench.wait(lambda: 'the clock of b runs away from that of a' in bench.words('identifier'))
    bench.wait(said(health, 'channel b', 'its clock runs away'))
    assert status_of(health, 'channel b').level == b'\2'
