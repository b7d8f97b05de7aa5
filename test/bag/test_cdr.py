"""The CDR field reader against the serialiser of rosbags, an independent implementation."""
import struct

import numpy as np
import pytest

from ssi_ros.bag.cdr import field_reader
from ssi_ros.bag.definitions import definition_of, type_hash_of
from ssi_ros.bag.schema import numeric_fields

typesys = pytest.importorskip('rosbags.typesys')
STORE = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
ACCEL = 'geometry_msgs/msg/AccelStamped'
# Headers or none, strings before numbers, arrays, sequences of numbers, of strings and of
# messages, every width of integer, nested three deep.
TYPES = (
    ACCEL, 'geometry_msgs/msg/PoseWithCovarianceStamped', 'geometry_msgs/msg/PolygonStamped',
    'geometry_msgs/msg/Vector3', 'sensor_msgs/msg/Imu', 'sensor_msgs/msg/JointState',
    'sensor_msgs/msg/NavSatFix', 'sensor_msgs/msg/CameraInfo', 'sensor_msgs/msg/LaserScan',
    'sensor_msgs/msg/PointCloud2', 'sensor_msgs/msg/BatteryState', 'sensor_msgs/msg/Joy',
    'sensor_msgs/msg/MultiDOFJointState', 'sensor_msgs/msg/TimeReference',
    'std_msgs/msg/Float64MultiArray', 'std_msgs/msg/UInt8MultiArray', 'std_msgs/msg/Bool',
    'std_msgs/msg/Int16', 'std_msgs/msg/Int64', 'std_msgs/msg/UInt32', 'nav_msgs/msg/Odometry',
    'nav_msgs/msg/OccupancyGrid', 'nav_msgs/msg/Path', 'trajectory_msgs/msg/JointTrajectory',
    'diagnostic_msgs/msg/DiagnosticArray', 'visualization_msgs/msg/Marker',
    'shape_msgs/msg/Mesh', 'builtin_interfaces/msg/Time', 'rosgraph_msgs/msg/Clock')
# rosbags packs an octet as a signed byte, so only the half that both agree on is used.
RANGES = {'bool': (0, 2), 'byte': (0, 128), 'char': (0, 256), 'octet': (0, 128)}


def scalar(base, rng):
    """Return a random value of a primitive type."""
    if base.startswith('float'):
        return float(np.float32(rng.standard_normal()))       # exact in both widths
    if base == 'string':
        return 'x' * int(rng.integers(0, 12))
    bits = int(base.lstrip('uint')) if base not in RANGES else 0
    low, high = RANGES.get(base) or ((0, 2 ** bits) if base[0] == 'u' else
                                     (-2 ** (bits - 1), 2 ** (bits - 1)))
    value = int(rng.integers(max(low, -2 ** 53), min(high, 2 ** 53)))   # exact as a float
    return bool(value) if base == 'bool' else value


def random_message(name, rng):
    """Return a random message and {path: value} of all its numeric fields."""
    values, args = {}, []

    def make(definition, path):
        kind, detail = definition
        kind = int(kind)
        if kind == 1:                                  # primitive: (name, string bound)
            value = scalar(detail[0], rng)
            if detail[0] != 'string':
                values[path] = float(value)
            return value
        if kind == 2:                                  # a message
            message, inner = random_message(detail, rng)
            values.update({f'{path}.{k}': v for k, v in inner.items()})
            return message
        element, bound = detail
        count = bound if kind == 3 else int(rng.integers(1, 4))
        items = [make(element, f'{path}[{i}]') for i in range(count)]
        if int(element[0]) == 1 and element[1][0] != 'string':
            base = {'octet': 'uint8', 'byte': 'uint8', 'char': 'uint8'}.get(
                element[1][0], element[1][0])
            return np.array(items, dtype=base)
        return items

    _, fields = STORE.fielddefs[name]
    for field, definition in fields:
        args.append(make(definition, field))
    return STORE.types[name](*args), values


def cdr(message, name, little=True):
    """Return the bytes that rosbags makes of a message."""
    return bytes(STORE.serialize_cdr(message, name, little_endian=little))


@pytest.mark.parametrize('name', TYPES)
def test_every_numeric_field_of_random_messages(name, rng):
    """Every field of a message reads as what was serialised, in both byte orders."""
    text = definition_of(name)
    readers = {}
    for turn in range(12):
        message, values = random_message(name, rng)
        raw = cdr(message, name, little=turn % 3 > 0)
        paths = list(values)
        for path in rng.permutation(paths)[:25] if len(paths) > 25 else paths:
            if path.startswith('structure_needs'):
                continue
            reader = readers.setdefault(path, field_reader(name, path, text))
            stamp, value = reader.read(raw)
            assert value == values[path], path         # the same bits: no tolerance
            header = next((p for p in ('header.stamp', 'stamp') if f'{p}.sec' in values), None)
            assert stamp == (None if header is None else int(
                values[f'{header}.sec']) * 10 ** 9 + int(values[f'{header}.nanosec']))


@pytest.mark.parametrize('same_layout', (True, False))
def test_read_many_is_read(rng, same_layout):
    """The vectorised path and its fallback give what one message at a time gives."""
    raws = []
    for i in range(50):
        message, _ = random_message('sensor_msgs/msg/JointState', rng)
        if same_layout:
            message.header.frame_id, message.name = 'base', ['a', 'bc']
            message.position = np.array([1.0, float(i)])
        else:
            message.position = np.arange(2.0 + i % 3)
        raws.append(cdr(message, 'sensor_msgs/msg/JointState'))
    reader = field_reader('sensor_msgs/msg/JointState', 'position[1]',
                          definition_of('sensor_msgs/msg/JointState'))
    stamps, values = reader.read_many(raws)
    assert [(int(s), v) for s, v in zip(stamps, values)] == [reader.read(r) for r in raws]


def test_same_size_but_another_layout_is_noticed(rng):
    """Two messages of one size whose lengths differ are not read at each other's offsets."""
    accel = STORE.types[ACCEL]
    pairs = []
    for frame in ('abc', 'abcd', 'abcdefghijk', 'abc'):    # padding makes the sizes equal
        message, values = random_message(ACCEL, rng)
        message = accel(message.header, message.accel)
        message.header.frame_id = frame
        pairs.append((cdr(message, ACCEL), values['accel.linear.z']))
    reader = field_reader(ACCEL, 'accel.linear.z', definition_of(ACCEL))
    assert [reader.read(r)[1] for r, _ in pairs] == [v for _, v in pairs]
    assert reader.read_many([r for r, _ in pairs])[1].tolist() == [v for _, v in pairs]


def test_wstring_bounded_and_constants():
    """A wstring of 4 bytes a character, bounds, defaults, constants and a byte before them."""
    text = ('int32 ANSWER=42  # a constant\nstring WORD="a = b"\nbyte flag\n'
            'wstring name\nstring<=5 short "abc"\nfloat32[<=3] few\nfloat64 x 1.5\n')
    name, short, few = 'hé', b'abc\0', (1.0, 2.0)
    raw = struct.pack('<4sB3xI', b'\0\1\0\0', 7, len(name))
    raw += struct.pack('<2I', *map(ord, name)) + struct.pack('<I4s', 4, short)
    raw += struct.pack('<I2f', 2, *few)
    raw += b'\0' * (-(len(raw) - 4) % 8) + struct.pack('<d', -2.5)
    for field, value in (('flag', 7.0), ('few[1]', 2.0), ('x', -2.5)):
        assert field_reader('a/msg/B', field, text).read(raw) == (None, value)
    assert numeric_fields('a/msg/B', text) == ('flag', 'few[0]', 'x')


@pytest.mark.parametrize('field, words', (
    ('accel.linear.w', ("no member 'w'", 'accel.linear.z')),
    ('header.frame_id', ('is a string, not a number',)),
    ('accel.linear', ('geometry_msgs/Vector3, not a number',)),
    ('accel[0].linear.z', ('is not an array',)),
    ('accel.linear.z.z', ('has no members',)),
    ('accel..z', ('not a name',))))
def test_a_wrong_field_is_explained(field, words):
    """The error names the field, what is wrong with it, and the fields that exist."""
    with pytest.raises(ValueError) as error:
        field_reader(ACCEL, field, definition_of(ACCEL))
    assert all(w in str(error.value) for w in words), error.value


def test_cut_and_foreign_messages_are_told(rng):
    """No cut of a message, and no random bytes, give anything but a value or a ValueError."""
    message, _ = random_message('sensor_msgs/msg/JointState', rng)
    raw = cdr(message, 'sensor_msgs/msg/JointState')
    reader = field_reader('sensor_msgs/msg/JointState', 'position[0]',
                          definition_of('sensor_msgs/msg/JointState'))
    reader.read(raw)
    for cut in range(0, 40):
        with pytest.raises(ValueError):
            reader.read(raw[:cut])
    with pytest.raises(ValueError, match=r'position\[7\] does not exist'):
        field_reader('sensor_msgs/msg/JointState', 'position[7]',
                     definition_of('sensor_msgs/msg/JointState')).read(raw)
    for _ in range(300):
        noise = raw[:4] + rng.bytes(len(raw) - 4)
        try:
            reader.read(noise)
        except ValueError:
            pass


def test_definitions_and_hashes_are_those_of_rosbags():
    """The hash that rosidl installed is the one rosbags computes; the text parses to the same."""
    for name in TYPES:
        assert type_hash_of(name) == STORE.hash_rihs01(name)
        paths = numeric_fields(name, definition_of(name), limit=10 ** 6)
        assert paths, name
    with pytest.raises(ValueError, match='not installed'):
        definition_of('no_such_msgs/msg/Thing')
    with pytest.raises(ValueError, match='package/msg/Type'):
        definition_of('geometry_msgs/srv/Foo')
