"""Write sampled channels as accelerometer topics, a whole chunk of messages at a time."""
import numpy as np

from ssi_ros.records import Samples

from .layout import SENSOR
from .mcap_file import Block, CHUNK_BYTES
from .names import check_topic
from .writer import BagWriter

TYPE, FIELD = 'geometry_msgs/msg/AccelStamped', 'accel.linear.z'
# of an input: the same members in the same order
WRENCH, WRENCH_FIELDS = 'geometry_msgs/msg/WrenchStamped', tuple(
    f'wrench.{part}.{axis}' for part in ('force', 'torque') for axis in 'xyz')


def input_channel(name):
    """Return topic and field that `write_samples` writes an input to: torque_y turns about y."""
    axis = name.removeprefix('torque_')
    return f'/input/{name}', 'wrench.torque.' + axis if axis in ('x', 'y', 'z') else (
        WRENCH_FIELDS[0])


def write_samples(path, samples, *, topics=None, frame_ids=None, inputs=None, extra=None,
                  progress=None):
    """
    Write samples to a new bag, one geometry_msgs/msg/AccelStamped topic a channel.

    The measured acceleration [m/s^2] is accel.linear.z, along the sensor's own z axis; the other
    five components are 0 because nothing measures them. A sample that is NaN is missing and
    gets no message. Log and publish time are the stamp of the sample.

    Parameters
    ----------
    path : str or Path
        Folder to make.
    samples : Samples
        Channels on an even grid.
    topics : sequence of str, optional
        Topic of each channel; `/accelerometer/<channel>` if not given.
    frame_ids : sequence of str, optional
        frame_id of each channel; its name if not given.
    inputs : Samples, optional
        Inputs that were recorded beside, a geometry_msgs/msg/WrenchStamped topic each, see
        `input_channel`.
    extra : dict, optional
        Words to words, kept as custom_data in metadata.yaml (a seed, a command).
    progress : callable, optional
        Called with the share done, 0 to 1, after each chunk.

    Raises
    ------
    ValueError
        If the folder exists, a name is not a topic, or the stamps do not fit a ROS time.

    """
    topics = tuple(topics or (f'/accelerometer/{c}' for c in samples.channels))
    frames = tuple(frame_ids or samples.channels)
    types, places = [TYPE] * len(topics), [2] * len(topics)
    if inputs is not None:
        named = [input_channel(n) for n in inputs.channels]
        topics += tuple(topic for topic, _ in named)
        frames += tuple(inputs.channels)
        types += [WRENCH] * len(named)
        places += [WRENCH_FIELDS.index(field) for _, field in named]
        samples = Samples(np.hstack([samples.values, inputs.values]), samples.rate_hz,
                          samples.channels + inputs.channels, samples.start_ns)
    _check(samples, topics, frames)
    extra = {str(k): str(v) for k, v in (extra or {}).items()}
    stamps = samples.stamps_ns()
    with BagWriter(path, custom_data=extra) as bag:
        for topic, type_name in zip(topics, types):
            bag.add_topic(topic, type_name, SENSOR)
        rows = _Rows(frames, [bag.channel_id(t) for t in topics], places)
        step = max(1, CHUNK_BYTES // rows.width)
        for first in range(0, len(stamps), step):
            block = rows.block(stamps[first:first + step], samples.values[first:first + step])
            if block is not None:
                bag.write_block(block)
            if progress is not None:
                progress(min(1.0, (first + step) / len(stamps)))


def _check(samples, topics, frames):
    for name, given in (('topics', topics), ('frame_ids', frames)):
        if len(given) != len(samples.channels):
            raise ValueError(f'{len(given)} {name} were given for {len(samples.channels)} '
                             'channels: one a channel is needed')
    for topic in topics:
        check_topic(topic)
    if len(set(topics)) != len(topics):
        raise ValueError(f'topics {", ".join(topics)} are not all different')
    if len(samples.values):
        last = samples.start_ns + samples.duration_s * 1e9
        if samples.start_ns < 0 or last >= 2 ** 31 * 1e9:
            raise ValueError(f'start_ns={samples.start_ns} and {samples.duration_s:g} s leave '
                             'the range of a ROS time, 1970 to 2038')


def encode_accel(stamps_ns, values, frame_id):
    """
    Return the CDR bytes of AccelStamped messages, one a sample.

    Parameters
    ----------
    stamps_ns : ndarray of int64, shape (n,)
        Stamps [ns].
    values : ndarray, shape (n,)
        Acceleration along the sensor's z axis [m/s^2].
    frame_id : str
        Frame of the sensor.

    Returns
    -------
    list of bytes

    """
    dtype, fixed = _accel(frame_id)
    messages = np.zeros(len(stamps_ns), dtype)
    _fill(messages, fixed, np.asarray(stamps_ns, np.int64), values)
    raw, size = messages.tobytes(), dtype.itemsize
    return [raw[i:i + size] for i in range(0, len(raw), size)]


def _accel(frame_id):
    """Return AccelStamped in CDR as a packed numpy type, and its constant members."""
    text = frame_id.encode() + b'\0'
    pad = (4 - (4 + 12 + len(text))) % 8         # doubles align to 8 behind the 4-byte header
    dtype = np.dtype([
        ('head', 'V4'), ('sec', '<i4'), ('nanosec', '<u4'), ('frame_length', '<u4'),
        ('frame', f'V{len(text)}'), ('pad', f'V{pad}'), ('linear', '<f8', 3),
        ('angular', '<f8', 3)])
    return dtype, {'head': np.void(b'\0\1\0\0'), 'frame_length': len(text),
                   'frame': np.void(text)}


def _fill(messages, fixed, stamps, values, place=2):
    for name, value in fixed.items():
        messages[name] = value
    messages['sec'], messages['nanosec'] = np.divmod(stamps, 1_000_000_000)
    messages[('linear', 'angular')[place // 3]][:, place % 3] = values


class _Rows:
    """The message records of one sampling instant as one packed numpy type."""

    def __init__(self, frames, channel_ids, places):
        self.ids, self._places, self._fixed, records = channel_ids, places, [], []
        for i, frame in enumerate(frames):
            accel, fixed = _accel(frame)
            records.append((f'm{i}', np.dtype([
                ('opcode', 'u1'), ('length', '<u8'), ('channel', '<u2'), ('sequence', '<u4'),
                ('log', '<u8'), ('publish', '<u8'), ('cdr', accel)])))
            self._fixed.append(fixed)
        self._dtype = np.dtype(records)
        self._sizes = np.array([d.itemsize for _, d in records])
        self.width = self._dtype.itemsize

    def block(self, stamps, values):
        """Return the chunk of some rows, NaN left out; None if nothing is left."""
        there = ~np.isnan(values)
        if not there.any():
            return None
        rows = np.zeros(len(stamps), self._dtype)
        for i, channel in enumerate(self.ids):
            message = rows[f'm{i}']
            message['opcode'], message['channel'] = 5, channel
            message['length'] = 22 + message['cdr'].dtype.itemsize
            message['log'] = message['publish'] = stamps
            _fill(message['cdr'], self._fixed[i], stamps, values[:, i], self._places[i])
        records = rows.view(np.uint8).reshape(len(stamps), self.width)
        if not there.all():
            records = records[np.repeat(there, self._sizes, axis=1)]
        sizes = np.where(there, self._sizes, 0).ravel()
        offsets = (np.cumsum(sizes) - sizes).reshape(there.shape)
        index = {}
        for i, channel in enumerate(self.ids):
            kept = there[:, i]
            if kept.any():
                index[channel] = np.column_stack((stamps[kept], offsets[kept, i])).astype(
                    '<u8').tobytes()
        held = stamps[there.any(axis=1)]
        return Block(records.tobytes(), index, int(held[0]), int(held[-1]))
