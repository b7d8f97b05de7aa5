# Licensed under the Apache License, Version 2.0.
"""Write a record as a rosbag2 MCAP bag, through the independent library rosbags."""
from functools import lru_cache
from pathlib import Path
import struct

import numpy as np

START_NS = 1_800_000_000_000_000_000     # the same in all bags: a start time says nothing
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


def stamps(craft, index):
    """Return when scans by their numbers (k,) are nominally stamped, (k, c) [ns]."""
    period = 1e9 / craft.rate_hz
    offsets = np.array([s.offset for s in craft.sensors])
    return START_NS + np.rint((index[:, None] + offsets) * period).astype(np.int64)


def write_bag(folder, craft, values, index):
    """
    Write a record; the stamps are nominal.

    Parameters
    ----------
    folder : Path
        The bag; it must not exist.
    craft : Spacecraft
        For the channels, their rate and their instants.
    values : (n, c) array
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
    frames = []
    for channel in craft.channels:
        frame = bytearray(message(channel, START_NS, 1.0))
        # z is the one 1.0 of the template: found, not counted, so that no layout is assumed
        frames.append((frame, bytes(frame).index(struct.pack('<d', 1.0))))
    when = stamps(craft, index)
    order = np.argsort([s.offset for s in craft.sensors], kind='stable')
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = [writer.add_connection(f'/accelerometer/{channel}', KIND,
                                             typestore=_typestore()) for channel in craft.channels]
        for scan, row in zip(when.tolist(), values.tolist()):
            for c in order:
                frame, z_at = frames[c]
                struct.pack_into(STAMP, frame, STAMP_AT, *divmod(scan[c], 10**9))
                struct.pack_into('<d', frame, z_at, row[c])
                writer.write(connections[c], scan[c], bytes(frame))


def read_bag(folder, craft):
    """Return values (n, c) [m/s^2] and the number of each scan (n,) of a bag of write_bag."""
    from rosbags.rosbag2 import Reader
    got = {channel: [] for channel in craft.channels}
    z_at = {c: message(c, START_NS, 1.0).index(struct.pack('<d', 1.0)) for c in got}
    with Reader(Path(folder)) as reader:
        for connection, stamp, raw in reader.messages():
            channel = connection.topic.rsplit('/', 1)[-1]
            got[channel].append((stamp, struct.unpack_from('<d', raw, z_at[channel])[0]))
    values = np.stack([[v for _, v in got[c]] for c in craft.channels], axis=1)
    first = np.array([stamp for stamp, _ in got[craft.channels[0]]], dtype=np.int64)
    index = np.rint((first - START_NS) * craft.rate_hz / 1e9 - craft.sensors[0].offset)
    return values, index.astype(int)
