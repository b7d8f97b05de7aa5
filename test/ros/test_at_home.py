"""What a ROS user expects of a node: one line at the start, no losses unsaid, names its own."""
import re
import signal
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from node_records import grid, identifier, LISTEN, RATE_HZ, START_NS
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from ssi_ros.bag import write_samples
from ssi_ros.records import Samples
from ssi_ros.ros.messages import time_of, window_of
from std_msgs.msg import Float64MultiArray


def texts(health):
    """Return every sentence of the diagnostics by the name of its status."""
    return {(s.name, s.message) for m in health for s in m.status}


def noise_bag(path, seconds=60.0, names=('a', 'b')):
    """Write a bag of white noise."""
    values = np.random.default_rng(3).standard_normal((round(seconds * RATE_HZ), len(names)))
    write_samples(path, Samples(values, RATE_HZ, names, START_NS))
    return path


def test_one_line_at_the_start(bench, tmp_path):
    """Each node says what it does: channels, rate, window, and when a result comes."""
    windows, _ = identifier(bench, channels=['/accelerometer/a', '/accelerometer/b'])
    bench.processes.start('player', 'player', bag=noise_bag(tmp_path / 'bag'), rate=20.0,
                          wait_for_subscribers=1, reliable=True)
    bench.wait(lambda: windows)
    said = bench.words('identifier')
    assert said.count('waiting for 2 channels: /accelerometer/a, /accelerometer/b') == 1
    assert said.count('watching 2 channels at 100 Hz, window 20 s, first result at '
                      '01:47:00.0 UTC, then every 5 s') == 1      # START_NS is 01:46:40 UTC
    assert f'playing {tmp_path / "bag"}: 2 topics, 60 s at rate 20' in bench.words('player')
    bench.processes.start('simulator', 'simulator', wait_for_subscribers=9)
    bench.wait(lambda: 'publishing 4 accelerometers at 100 Hz, speed 1, seed 1, until it is '
               'stopped, when 9 subscribers are there' in bench.words('simulator'))


def test_a_name_that_is_taken_is_reported(bench):
    """A second identifier warns of its name, a second publisher of a topic of its topic."""
    _, health = identifier(bench)
    bench.processes.start('twin', 'identifier', remaps=['__node:=identifier'], channels=['/a'])
    bench.processes.start('other', 'simulator')
    bench.node.create_publisher(AccelStamped, '/accelerometer/e1_a', LISTEN)
    for name in ('identifier', 'twin'):
        bench.wait(lambda n=name: 'another node is named /identifier too' in bench.words(n))
    bench.wait(lambda: '2 nodes publish /accelerometer/e1_a' in bench.words('other'))
    assert 'another node' not in bench.words('other')
    bench.wait(lambda: any(name == 'simulator: names' or name == 'other: names'
                           for name, _ in texts(health)))
    time.sleep(2.5)                            # said once, not every second
    assert bench.words('other').count('2 nodes publish') == 1


def test_missing_samples_are_said(bench):
    """A node that lacks samples says how many of which channel, once for all of some seconds."""
    identifier(bench, rate_hz=100.0)
    publishers = [bench.node.create_publisher(AccelStamped, f'/{n}', 10_000) for n in 'ab']
    bench.wait(lambda: all(p.get_subscription_count() for p in publishers))
    time.sleep(0.5)
    for k, stamp in enumerate(grid(3000).tolist()):
        for c, publisher in enumerate(publishers):
            if c == 0 or k % 100 >= 7:
                message = AccelStamped()
                message.header.stamp = time_of(stamp)
                message.accel.linear.z = float(k % 13)
                publisher.publish(message)
        if k % 50 == 49:
            time.sleep(0.005)
    bench.wait(lambda: re.search(r'samples missing in \d+ s \(b: \d+;', bench.words('identifier')))
    assert bench.words('identifier').count('samples missing') == 1


@pytest.mark.slow
def test_the_player_waits_for_a_reader_that_stands_still(bench, tmp_path):
    """A reader stops until the player cannot go on: all samples arrive, the player says it."""
    windows, health = identifier(bench, channels=['/accelerometer/a', '/accelerometer/b'],
                                 lateness_s=60.0)
    bag = noise_bag(tmp_path / 'bag', seconds=720.0)
    bench.processes.start('player', 'player', bag=bag, rate=60.0, wait_for_subscribers=1,
                          reliable=True)

    def sent():
        found = (s for m in health for s in m.status if s.name == 'player: bag')
        return [int(v.value) for s in found for v in s.values if v.key == 'sent']
    bench.wait(lambda: sent() and sent()[-1] > 0)
    bench.processes.running['identifier'].send_signal(signal.SIGSTOP)
    bench.wait(lambda: len(sent()) > 1 and sent()[-1] == sent()[-2])
    assert sent()[-1] < 144_000
    time.sleep(1.0)
    bench.processes.running['identifier'].send_signal(signal.SIGCONT)
    assert bench.ended('player', 60.0) == 0
    bench.wait(lambda: windows and windows[-1].end_ns == START_NS + 720 * 10 ** 9)
    bench.processes.stop('identifier')
    assert 'received [72000, 72000], missing [0, 0]' in bench.words('identifier')
    assert 'for a reader of /accelerometer/' in bench.words('player')


def test_diagnostics_name_the_topic_after_a_remap(bench):
    """After a remapping the status of a channel names the topic that is subscribed to."""
    health = bench.collect(DiagnosticArray, '/diagnostics')
    bench.processes.start('identifier', 'identifier', remaps=['left:=/imu/z'],
                          channels=['left'])
    bench.wait(lambda: any('no publisher of /imu/z' in text for _, text in texts(health)))
    numbers = {v.value for m in health for s in m.status for v in s.values}
    assert not numbers & {'nan', 'inf'}        # what is not known yet has no number


def test_an_inactive_node_says_so(bench):
    """A node that is configured and not active reports that, and no window that fills."""
    _, health = identifier(bench, autostart=False)
    bench.wait(lambda: 'unconfigured, since autostart is false; waits for: ros2 lifecycle set '
               '/identifier configure' in bench.words('identifier'))
    request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_CONFIGURE))
    assert bench.call(ChangeState, '/identifier/change_state', request).success
    bench.wait(lambda: texts(health))
    assert texts(health) == {('identifier: node', 'inactive: configured, waits for activation')}


@pytest.mark.slow
def test_modes_are_latched(bench, tmp_path):
    """Who subscribes after the last window still gets it."""
    windows, _ = identifier(bench, channels=['/accelerometer/a', '/accelerometer/b'])
    # the first of them comes a second after the player: the test itself must have met the node
    bench.wait(lambda: bench.node.count_publishers('/identifier/modes'))
    bench.processes.start('player', 'player', bag=noise_bag(tmp_path / 'bag', 21.0), rate=20.0,
                          wait_for_subscribers=1, reliable=True)
    bench.wait(lambda: windows)
    assert bench.ended('player') == 0
    late = bench.collect(DiagnosticArray, '/identifier/modes', QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    bench.wait(lambda: late)
    assert window_of(late[0]).end_ns == windows[-1].end_ns


def test_every_number_of_a_mode_is_published_as_a_number(bench):
    """Identity and shape stand in the slots of the frequencies, beside the texts of ~/modes."""
    windows, _ = identifier(bench)
    arrays = {n: bench.collect(Float64MultiArray, f'/identifier/{n}')
              for n in ('frequency_hz', 'identity', 'shape')}
    publishers = [bench.node.create_publisher(AccelStamped, f'/{n}', 10_000) for n in 'ab']
    bench.wait(lambda: all(p.get_subscription_count() for p in publishers)
               and all(bench.node.count_publishers(f'/identifier/{n}') for n in arrays))
    time.sleep(0.5)
    rng, z, pole = np.random.default_rng(5), 0j, np.exp((-0.01 + 1j) * 2 * np.pi * 7.0 / RATE_HZ)
    for k, stamp in enumerate(grid(2600).tolist()):
        z = pole * z + rng.standard_normal()
        for gain, publisher in zip((1.0, -0.5), publishers):
            message = AccelStamped()
            message.header.stamp = time_of(stamp)
            message.accel.linear.z = gain * z.imag + 0.05 * rng.standard_normal()
            publisher.publish(message)
        if k % 50 == 49:
            time.sleep(0.005)
    bench.wait(lambda: windows and all(arrays.values()))
    modes = {m.identity: m for m in windows[0].modes}
    assert modes
    identities = np.array(arrays['identity'][0].data)
    layout = arrays['shape'][0].layout.dim
    assert [d.size for d in layout] == [len(identities), 2, 2] and layout[1].label == 'a,b'
    shapes = np.array(arrays['shape'][0].data).reshape([d.size for d in layout])
    found = {int(identities[slot]) for slot in np.flatnonzero(~np.isnan(identities))}
    assert found == set(modes)
    for slot in np.flatnonzero(~np.isnan(identities)):
        mode = modes[int(identities[slot])]
        assert arrays['frequency_hz'][0].data[slot] == mode.frequency_hz
        np.testing.assert_array_equal(shapes[slot, :, 0] + 1j * shapes[slot, :, 1], mode.shape)
    assert np.isnan(shapes[np.isnan(identities)]).all()
