"""When messages are due, and that time never jumps back in a loop."""
from itertools import islice

import numpy as np
import pytest

from ssi_ros.bag import (
    definition_of, field_reader, open_bag, schedule, stamp_shifter, write_samples)
from ssi_ros.records import Samples

ACCEL = 'geometry_msgs/msg/AccelStamped'
START = 1_700_000_000_000_000_000


@pytest.fixture
def bag(tmp_path, rng):
    """Return an open bag: 2 s of two channels at 100 Hz."""
    write_samples(tmp_path / 'bag', Samples(rng.standard_normal((200, 2)), 100.0, ('a', 'b'),
                                            START))
    return open_bag(tmp_path / 'bag')


def test_once(bag):
    """Every message once, byte for byte, due when it was logged, at the rate."""
    plan = list(schedule(bag, rate=4.0))
    assert [p[2] for p in plan] == [m.raw for m in bag.messages()]
    # due times are exact quotients of nanoseconds: the tolerance is rounding alone
    assert np.allclose([p[0] for p in plan], np.repeat(np.arange(200) * 0.0025, 2), atol=1e-12)


def test_a_part(bag):
    """The part from start_s for duration_s of one topic."""
    plan = list(schedule(bag, topics=['/accelerometer/b'], start_s=0.5, duration_s=0.25))
    assert [p[3] - START for p in plan] == list(range(500_000_000, 750_000_000, 10_000_000))
    assert plan[0][0] == 0.0 and {p[1] for p in plan} == {'/accelerometer/b'}


@pytest.mark.parametrize('part', ({}, {'start_s': 0.5}, {'start_s': 0.2, 'duration_s': 1.0}))
def test_a_loop_never_jumps_back(bag, part):
    """Over four passes log times and header stamps go on in steps of one period."""
    reader = field_reader(ACCEL, 'accel.linear.z', definition_of(ACCEL))
    once = len(list(schedule(bag, **part)))
    plan = list(islice(schedule(bag, loop=True, **part), 4 * once))
    a = [p for p in plan if p[1] == '/accelerometer/a']
    stamps = np.array([reader.read(p[2])[0] for p in a])
    assert set(np.diff(stamps)) == {10_000_000}       # the grid goes on over the seam
    assert stamps.tolist() == [p[3] for p in a]
    assert (np.diff([p[0] for p in plan]) >= 0).all()
    values = [reader.read(p[2])[1] for p in a]
    assert values[:once // 2] == values[once // 2:once]        # and the data come again


def test_shifting_both_byte_orders():
    """The stamp moves by what was asked, 0 stays 0, and nothing else of the message changes."""
    typesys = pytest.importorskip('rosbags.typesys')
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    types = store.types
    shift = stamp_shifter('sensor_msgs/msg/Temperature',
                          definition_of('sensor_msgs/msg/Temperature'))
    for little in (True, False):
        for sec, nanosec in ((5, 999_999_999), (0, 0)):
            message = types['sensor_msgs/msg/Temperature'](
                types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](sec, nanosec),
                                             'f'), 21.5, 0.25)
            raw = bytes(store.serialize_cdr(message, message.__msgtype__, little_endian=little))
            moved = store.deserialize_cdr(shift(raw, 3_000_000_002), message.__msgtype__)
            stamp = moved.header.stamp
            assert (stamp.sec, stamp.nanosec) == ((9, 1) if sec else (0, 0))
            assert (moved.temperature, moved.variance, moved.header.frame_id) == (21.5, 0.25, 'f')
    assert stamp_shifter('std_msgs/msg/Float64', definition_of('std_msgs/msg/Float64')) is None


@pytest.mark.parametrize('options, words', (
    ({'rate': 0.0}, 'rate=0.0 must be'), ({'start_s': -1.0}, '0 or more'),
    ({'start_s': 99.0}, 'has no message from 99 s'), ({'topics': ['/x']}, 'no topic /x')))
def test_mistakes_are_told_at_once(bag, options, words):
    """A wrong option is told by the call itself, before the first message is asked for."""
    with pytest.raises(ValueError, match=words):
        schedule(bag, **options)
