"""Records to messages and back, slots, channels, parameter files: no process needed."""
import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS 2 is not installed')

from ssi_ros.records import Mode, WindowModes                              # noqa: E402
from ssi_ros.ros.channels import channel_of, channel_sources               # noqa: E402
from ssi_ros.ros.config_files import NODES, parameter_file                 # noqa: E402
from ssi_ros.ros.identifier_settings import IdentifierInput                # noqa: E402
from ssi_ros.ros.messages import modes_message, series_message, Slots, window_of  # noqa: E402

CONFIG = Path(__file__).resolve().parents[2] / 'config'


def window(*identities, deaths=(), reason=''):
    """Return a window with modes of the given identities and awkward numbers."""
    modes = tuple(Mode(frequency_hz=math.pi * (i + 1), damping_ratio=0.005 / 3.0,
                       shape=np.array([1.0, -1.0 / 3.0 + 1e-17j, 0.1]), identity=i,
                       label='structural', frequency_std_hz=1e-3 / 7.0) for i in identities)
    return WindowModes(10 ** 18 + 1, 10 ** 18 + 7, modes, reason, births=identities,
                       deaths=deaths)


@pytest.mark.parametrize('one', [window(3, 5), window(reason='the excitation stopped')])
def test_window_survives_the_message(one):
    """A window read back is equal to the bit."""
    back = window_of(modes_message(one))
    assert (back.start_ns, back.end_ns, back.reason) == (one.start_ns, one.end_ns, one.reason)
    for m, n in zip(one.modes, back.modes, strict=True):
        assert (m.frequency_hz, m.damping_ratio, m.frequency_std_hz, m.identity, m.label) == (
            n.frequency_hz, n.damping_ratio, n.frequency_std_hz, n.identity, n.label)
        np.testing.assert_array_equal(m.shape, n.shape)


def test_header_is_the_window_end():
    """The DiagnosticArray is stamped by the window's end."""
    stamp = modes_message(window(1)).header.stamp
    assert stamp.sec * 10 ** 9 + stamp.nanosec == 10 ** 18 + 7


def test_slots_follow_identity():
    """A mode keeps its slot while others come, miss a window and die."""
    slots = Slots(3)
    assert slots.update(window(10, 11, 12)) == []
    assert slots.of == {10: 0, 11: 1, 12: 2}
    slots.update(window(10, 12))                          # 11 misses a window
    assert slots.update(window(10, 12, 13)) == [13]       # and still holds its slot
    slots.update(window(10, 12, 13, deaths=(11,)))
    assert slots.of == {10: 0, 12: 2, 13: 1}
    data = series_message(window(10, 13), 'frequency_hz', slots.of, 3).data
    assert data[0] == math.pi * 11 and data[1] == math.pi * 14 and math.isnan(data[2])


@pytest.mark.parametrize('text, expected', [
    ('/a', ('/a', 'geometry_msgs/msg/AccelStamped', 'accel.linear.z', 'a')),
    ('{topic: /imu, type: sensor_msgs/msg/Imu, field: linear_acceleration.x, name: x}',
     ('/imu', 'sensor_msgs/msg/Imu', 'linear_acceleration.x', 'x')),
])
def test_channel_entries(text, expected):
    """An entry of `channels` is a topic, or a mapping."""
    c = channel_of(text)
    assert (c.topic, c.type, c.field, c.name) == expected


@pytest.mark.parametrize('channels, words', [
    (('{tpic: /a}',), 'names no topic'),
    (('{topic: /a, filed: x}',), 'did you mean field'),
    (('{topic: /a',), 'is not YAML'),
    (('{topic: /a, type: no_msgs/msg/No}',), 'not installed'),
    (('{topic: /a, field: accel.linear.q}',), 'accel.linear.z'),
    (('/a', '/a'), 'two channels are named'),
])
def test_channel_errors(channels, words):
    """A channel that cannot be is refused with a way out."""
    with pytest.raises(ValueError, match=words):
        channel_sources(IdentifierInput(channels=channels))


@pytest.mark.parametrize('count', [0, 65])
def test_number_of_channels(count):
    """1 to 64 channels."""
    with pytest.raises(ValueError, match='1 to 64'):
        IdentifierInput(channels=tuple(f'/c{i}' for i in range(count)))


@pytest.mark.parametrize('node', sorted(NODES))
def test_parameter_files_are_the_declarations(node):
    """The files in config/ say what the code says; `config_files` writes them."""
    assert (CONFIG / f'{node}.yaml').read_text() == parameter_file(node)
