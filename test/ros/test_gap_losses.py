"""What the gap node does where samples are missing: it says so; too few, no verdict."""
import re
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelStamped
from node_records import grid, newest
import numpy as np
from ssi_ros.records import Samples
from ssi_ros.ros.gap_task import missing_words, refusal
from ssi_ros.ros.messages import time_of
from std_srvs.srv import Trigger

NAMES = ('e1_a', 'e1_b', 'e2_a', 'e2_b')


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
           'missing_share=0.1' in answer.message
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
