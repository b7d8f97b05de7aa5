"""Effects in the simulator node: the samples on the topics are those of the offline record."""
from geometry_msgs.msg import AccelStamped
import numpy as np
import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from ssi_ros.effects import inject, parse_effect, save_configuration, simulate_setup
from ssi_ros.model import load_spacecraft
from ssi_ros.ros.messages import stamp_of

RELIABLE = QoSProfile(depth=5000, reliability=ReliabilityPolicy.RELIABLE)
NAMES = ('e1_a', 'e1_b', 'e2_a', 'e2_b')
SECONDS = 4.0


@pytest.mark.parametrize('texts', [
    ('sensor_gain:channel=e1_b,scale=1.2', 'dropped_samples:fraction=0.05', 'clock_rate:ppm=500'),
    ('stiffness_drift:change=0.1', 'channel_delay:delay_s=0.004')])
def test_published_samples_are_the_record(bench, tmp_path, texts):
    """One effect from the configuration, the others by parameter; no dropped row is sent."""
    effects = [parse_effect(t) for t in texts]
    save_configuration(load_spacecraft(), effects[:1], tmp_path / 'corrected.yaml')
    heard = {n: bench.collect(AccelStamped, f'/accelerometer/{n}', RELIABLE) for n in NAMES}
    bench.processes.start('simulator', 'simulator', config=str(tmp_path / 'corrected.yaml'),
                          effects=texts[1:], seed=8, speed=10.0, duration_s=SECONDS,
                          start_s=100.0, reliable=True, wait_for_subscribers=1)
    record = simulate_setup(inject(load_spacecraft(), effects, SECONDS), 8, start_ns=10 ** 11)
    there = np.isfinite(record.values).all(axis=1)
    bench.wait(lambda: all(len(m) >= there.sum() for m in heard.values()))
    assert bench.ended('simulator') == 0
    for i, name in enumerate(NAMES):
        assert [stamp_of(m.header.stamp) for m in heard[name]] == list(record.stamps_ns()[there])
        # other blocks and BLAS threads differ by rounding alone
        np.testing.assert_allclose([m.accel.linear.z for m in heard[name]],
                                   record.values[there, i], rtol=0, atol=1e-10)


@pytest.mark.parametrize('text, words', [
    ('sensor_gian', 'did you mean sensor_gain'),
    ('sensor_gain:scale=7000000', 'outside'),
    ('wheel_speed_sweep:torque_n_m=0.1', 'set duration_s')])
def test_mistakes_are_told(bench, text, words):
    """The same words as on the command line; the node ends with code 2."""
    bench.processes.start('simulator', 'simulator', effects=[text])
    assert bench.ended('simulator') == 2
    said = bench.words('simulator')
    assert 'cannot configure' in said and words in said and 'Traceback' not in said
