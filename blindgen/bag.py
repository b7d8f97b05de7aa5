# Licensed under the Apache License, Version 2.0.
"""Write a record as a rosbag2 MCAP bag, through the independent library rosbags."""
from functools import lru_cache
from pathlib import Path
import struct

from blindgen.scenario import CHANNELS, RATE_HZ
import numpy as np

START_NS = 1_800_000_000_000_000_000     # the same in all bags: a start time tells nothing
KIND = 'geometry_msgs/msg/AccelStamped'
STAMP_AT, STAMP = 4, '<iI'               # after the CDR header


@lru_cache(maxsize=1)
def _typestore():
    from rosbags.typesys import Stores, get_typestore
    return get_typestore(Stores.ROS2_JAZZY)


def message(channel, stamp_ns, value):
    """Return one AccelStamped in CDR, by rosbags; only z is measured, the rest is zero."""
    store = _typestore()
    t = store.types
    zero = t['geometry_msgs/msg/Vector3'](0.0, 0.0, 0.0)
    header = t['std_msgs/msg/Header'](
        t['builtin_interfaces/msg/Time'](*divmod(stamp_ns, 10**9)), channel)
    accel = t['geometry_msgs/msg/Accel'](t['geometry_msgs/msg/Vector3'](0.0, 0.0, float(value)),
                                         zero)
    return bytes(store.serialize_cdr(t[KIND](header, accel), KIND))


def write_bag(folder, values, index):
    """
    Write a record; the stamps are nominal.

    Parameters
    ----------
    folder : Path
        The bag; it must not exist.
    values : (n, 4) array
        [m/s^2]
    index : (n,) int array
        Number of each scan; a missing number is a missing scan.

    Raises
    ------
    ValueError
        If the folder exists.

    """
    from rosbags.rosbag2 import StoragePlugin, Writer
    folder = Path(folder)
    if folder.exists():
        raise ValueError(f'{folder} exists; name a new folder')
    period = round(1e9 / RATE_HZ)
    frames = []
    for channel in CHANNELS:
        frame = bytearray(message(channel, START_NS, 1.0))
        # z is the one 1.0 of the template: found, not counted, so that no layout is assumed
        frames.append((frame, bytes(frame).index(struct.pack('<d', 1.0))))
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = [writer.add_connection(f'/accelerometer/{channel}', KIND,
                                             typestore=_typestore()) for channel in CHANNELS]
        for k, row in zip(index.tolist(), values.tolist()):
            stamp = START_NS + k * period
            for (frame, z_at), connection, value in zip(frames, connections, row):
                struct.pack_into(STAMP, frame, STAMP_AT, *divmod(stamp, 10**9))
                struct.pack_into('<d', frame, z_at, value)
                writer.write(connection, stamp, bytes(frame))


def read_bag(folder):
    """Return values (n, 4) [m/s^2] and the number of each scan (n,) of a bag of write_bag."""
    from rosbags.rosbag2 import Reader
    z_at = message(CHANNELS[0], START_NS, 1.0).index(struct.pack('<d', 1.0))
    period, got = round(1e9 / RATE_HZ), {channel: [] for channel in CHANNELS}
    with Reader(Path(folder)) as reader:
        for connection, stamp, raw in reader.messages():
            # the frame is as long in all channels, their names being so
            got[connection.topic.rsplit('/', 1)[-1]].append(
                (stamp, struct.unpack_from('<d', raw, z_at)[0]))
    columns = [np.array(got[channel]) for channel in CHANNELS]
    stamps = np.array([stamp for stamp, _ in got[CHANNELS[0]]], dtype=np.int64)
    return np.stack([c[:, 1] for c in columns], axis=1), (stamps - START_NS) // period
