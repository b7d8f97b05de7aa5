"""The main job, small: live, recorded, replayed and offline, each in its own process."""
import math

import pytest

from ssi_ros.bag import open_bag, read_channels
from ssi_ros.identify import Identification
from ssi_ros.identify.stamped import identify_stamped
from ssi_ros.model import assemble, load_spacecraft, simulate
from ssi_ros.ros import demo

rosbags = pytest.importorskip('rosbags.highlevel')

WINDOW_S, HOP_S, DURATION_S = 30.0, 5.0, 40.0


@pytest.fixture(scope='module')
def outcome(tmp_path_factory):
    """Run the chain once: 40 s at 10 times real time."""
    lines = []
    result = demo.run(tmp_path_factory.mktemp('chain'), duration_s=DURATION_S, window_s=WINDOW_S,
                      hop_s=HOP_S, speed=10.0, seed=3, say=lines.append, progress=lambda s: None)
    return result, lines


def numbers(windows):
    """Return all that a window says, in a form that can be compared exactly."""
    return {end: [(m.identity, m.label, m.frequency_hz, m.damping_ratio, *m.shape.tolist())
                  for m in w.modes] for end, w in windows.items()}


def test_replay_is_equal_to_live(outcome):
    """Every window of the replay has the live one's modes, to the bit."""
    result, _ = outcome
    assert len(result.live) == 3 and all(w.modes for w in result.live.values())
    assert numbers(result.live) == numbers(result.replayed)


def test_offline_is_equal_to_live(outcome):
    """The verb's code on the bag gives the node's modes, to the bit."""
    result, _ = outcome
    r = read_channels(result.bag)
    windows, grid = identify_stamped(
        r.names, r.stamps_ns, r.values, Identification(window_s=WINDOW_S, hop_s=HOP_S),
        arrivals_ns=r.arrivals_ns)
    assert numbers({w.end_ns: w for w in windows}) == numbers(result.live)
    assert all(c.missing == 0 for c in grid.counts)


def test_bag_holds_the_simulation(outcome):
    """Every sample of the seed is in the bag, on the exact grid: nothing was lost over DDS."""
    result, _ = outcome
    r = read_channels(result.bag)
    samples = simulate(assemble(load_spacecraft()), DURATION_S, 3,
                       start_ns=int(r.stamps_ns[0][0]))
    for i, name in enumerate(samples.channels):
        k = r.names.index(name)
        assert (r.stamps_ns[k] == samples.stamps_ns()).all()
        # other blocks and BLAS threads differ by rounding alone
        assert abs(r.values[k] - samples.values[:, i]).max() < 1e-10


def test_bag_has_results_too(outcome):
    """The results were recorded with the samples, with their offered quality of service."""
    result, _ = outcome
    bag = open_bag(result.bag)
    topics = {t.name: t for t in bag.topics}
    assert topics['/identifier/modes'].count == 3
    assert topics['/accelerometer/e1_a'].qos[0]['reliability'] == 'reliable'
    assert topics['/identifier/modes'].qos[0]['reliability'] == 'reliable'
    assert topics['/accelerometer/e1_a'].type_hash.startswith('RIHS01_')


def test_rosbags_reads_it(outcome):
    """An independent reader finds the same messages in the recorded bag."""
    result, _ = outcome
    with rosbags.AnyReader([result.bag]) as reader:
        wanted = [c for c in reader.connections if c.topic == '/accelerometer/e2_b']
        got = [reader.deserialize(raw, c.msgtype).accel.linear.z
               for c, _, raw in reader.messages(connections=wanted)]
    r = read_channels(result.bag)
    assert got == r.values[r.names.index('e2_b')].tolist()


def test_what_the_user_sees(outcome):
    """A line a step and a window."""
    _, lines = outcome
    assert lines[0].startswith('step 1 of 3, live:')
    assert sum('modes [Hz]' in line for line in lines) == 6
    assert math.isclose(float(lines[1].split()[0]), WINDOW_S)
