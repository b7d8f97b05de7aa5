"""What the gap node does where samples are missing: it says so; too few, no verdict."""
import re
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelStamped
from node_records import grid, newest
import numpy as np
import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.model import load_spacecraft
from ssi_ros.records import Samples
from ssi_ros.ros.gap_messages import numbers_of
from ssi_ros.ros.gap_task import missing_words, refusal
from ssi_ros.ros.messages import time_of
from std_srvs.srv import Trigger

NAMES = ('e1_a', 'e1_b', 'e2_a', 'e2_b')


@pytest.mark.slow
def test_too_many_missing_samples_give_no_verdict(bench):
    """A record that lacks a fifth of one channel is refused; the alarm never says it is quiet."""
    health = bench.collect(DiagnosticArray, '/diagnostics')
    bench.processes.start('gap', 'gap', reliable=True, effects=['sensor_gain'], record_s=20.0)
    publishers = [bench.node.create_publisher(AccelStamped, f'/accelerometer/{n}', 10_000)
                  for n in NAMES]
    bench.wait(lambda: all(p.get_subscription_count() for p in publishers), 60.0)
    bench.wait(lambda: newest(health, 'gap: alarm') is not None)
    assert newest(health, 'gap: alarm').level == b'\3'
    time.sleep(0.5)
    for k, stamp in enumerate(grid(2400).tolist()):
        for name, publisher in zip(NAMES, publishers):
            if name != 'e2_a' or k % 5:
                message = AccelStamped()
                message.header.stamp = time_of(stamp)
                message.accel.linear.z = float(k % 7)
                publisher.publish(message)
        if k % 50 == 49:
            time.sleep(0.005)
    bench.wait(lambda: re.search(r'samples missing in \d+ s \(e2_a: ', bench.words('gap')), 60.0)
    answer = bench.call(Trigger, '/gap/diagnose', Trigger.Request())
    assert not answer.success
    assert 'no diagnosis: channel e2_a lacks 20 % of its samples of the last 20 s, more than ' \
           'diagnosis_missing_share=0.1' in answer.message
    bench.wait(lambda: 'no sample for' in newest(health, 'gap: alarm').message)
    assert newest(health, 'gap: alarm').level == b'\3'
    assert newest(health, 'gap: gap').level == b'\2'
    alarms = [s.message for m in health for s in m.status if s.name == 'gap: alarm']
    assert alarms and 'quiet' not in alarms


def test_few_missing_samples_are_masked_and_said():
    """Below the limit there is a diagnosis, and the words for it name what is missing."""
    values = np.zeros((1000, 2))
    values[::50, 1] = np.nan
    record = Samples(values, 100.0, ('a', 'b'))
    assert refusal(record, 0.1) == ''
    assert missing_words(record) == 'samples missing, masked and filled: b 2 %'
    assert missing_words(Samples(np.zeros((9, 1)), 1.0, ('a',))) == 'none is missing'
    assert 'channel b lacks 2 %' in refusal(record, 0.01)


def send(publishers, rows, stamps_ns, later_ns):
    """Publish rows of four channels, each stamped later by its own time."""
    for k, (row, stamp) in enumerate(zip(rows.tolist(), stamps_ns.tolist())):
        for value, publisher, later in zip(row, publishers, later_ns):
            message = AccelStamped()
            message.header.stamp = time_of(stamp + later)
            message.accel.linear.z = value
            publisher.publish(message)
        if k % 50 == 49:
            time.sleep(0.01)


@pytest.mark.slow
def test_a_channel_sampled_beside_the_others_is_moved(bench):
    """3 ms beside the others: said, moved, and no delay is blamed for the power at 0.9 of half."""
    late_s = np.array([0.0, 0.003, 0.0, 0.0])
    record = simulate_setup(inject(load_spacecraft(), [
        parse_effect('channel_delay:channel=e1_b,delay_s=0.003')], 160.0), 7)
    # what shows the motion 3 ms ago, stamped 3 ms ago: sampled beside the others by the stamps
    health = bench.collect(DiagnosticArray, '/diagnostics')
    where = bench.collect(DiagnosticArray, '/gap/where')
    bench.processes.start('gap', 'gap', reliable=True, effects=['channel_delay'], window_s=50.0,
                          hop_s=10.0, record_s=100.0)
    publishers = [bench.node.create_publisher(AccelStamped, f'/accelerometer/{n}', 20_000)
                  for n in NAMES]
    bench.wait(lambda: all(p.get_subscription_count() for p in publishers), 60.0)
    time.sleep(0.5)
    send(publishers, record.values, grid(len(record.values)), -np.rint(1e9 * late_s).astype(int))
    bench.wait(lambda: 'e1_b is sampled -3 ms beside e1_a: moved' in bench.words('gap'))
    bench.wait(lambda: len(where) >= 12, 120.0)
    found = numbers_of(where[-1])
    assert int(found['alarm']['raised_ns']) == -1
    assert abs(float(found['window']['deviations'])) < 5.0      # hundreds where it is not moved
    # while samples came: the offset is not known before the first, and the record may have ended
    offsets = [(s.level, next(v.value for v in s.values if v.key == 'offset_s')) for m in health
               for s in m.status if s.name == 'gap: channel e1_b' and 'silent' not in s.message]
    reported = [level for level, offset in offsets if offset and abs(float(offset) + 0.003) < 1e-5]
    assert reported and all(level == b'\0' for level in reported)
