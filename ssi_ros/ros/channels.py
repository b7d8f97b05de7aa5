"""The channels of the identifier: which topic, which type, which field, and how it is stamped."""
import importlib
import importlib.util
import os
from pathlib import Path

import numpy as np
from ssi_ros.bag import Channel, definition_of, field_reader
from ssi_ros.bag.channels import DEFAULT_FIELD, DEFAULT_TYPE
from ssi_ros.bag.definitions import prefixes
from ssi_ros.bag.names import check_topic, split_type
from ssi_ros.plain_yaml import load_plain
from ssi_ros.quantity import unknown

KEYS = ('topic', 'type', 'field', 'name')


def message_class(type_name):
    """
    Return the Python class of a message type 'pkg/msg/Type'.

    A type name comes out of a bag or off the graph: only packages that lie where ROS installs
    interfaces are imported, never a module of the working folder.

    Raises
    ------
    ValueError
        If the name is not one of ROS 2, or the type is not installed.

    """
    package, name = split_type(type_name)
    definition_of(type_name)                       # ValueError if it is not installed
    try:
        found = importlib.util.find_spec(package)
        if found is None or not _installed(found):
            raise ImportError(package)
        return getattr(importlib.import_module(f'{package}.msg'), name)
    except (ImportError, AttributeError, ValueError):
        raise ValueError(f'message type {type_name!r} is not installed for Python; install or '
                         'source its package') from None


def _installed(spec):
    """Return whether a package lies under a prefix of ROS or of this Python."""
    origin = spec.origin or next(iter(spec.submodule_search_locations or ()), '')
    return any(Path(os.path.abspath(origin)).is_relative_to(os.path.abspath(p))
               for p in prefixes())


def channel_of(text):
    """
    Return the Channel that one entry of the parameter `channels` describes.

    Parameters
    ----------
    text : str
        A YAML mapping with topic, and optionally type, field and name; or only a topic.

    """
    try:
        entry = load_plain(text)
    except ValueError:
        raise ValueError(f'channel {text!r:.100} is not YAML; write {{topic: /imu, '
                         'type: sensor_msgs/msg/Imu, field: linear_acceleration.z}') from None
    if isinstance(entry, str):
        entry = {'topic': entry}
    if not isinstance(entry, dict) or 'topic' not in entry:
        raise ValueError(f'channel {text!r} names no topic; write {{topic: T, type: pkg/msg/Type, '
                         'field: a.b[0], name: N}')
    for key in entry:
        if key not in KEYS:
            raise ValueError(unknown(f'channel {text!r}: {key}', key, KEYS))
        if not isinstance(entry[key], str):
            raise ValueError(f'channel {text!r:.100}: {key} is {entry[key]!r:.40}; write text')
    return Channel(_topic(entry['topic']), entry.get('type', DEFAULT_TYPE),
                   entry.get('field', DEFAULT_FIELD), entry.get('name', ''))


def _topic(name):
    """Return a topic name, absolute or relative to the node's namespace; ValueError if none."""
    check_topic(name if name.startswith('/') else '/' + name.removeprefix('~/'))
    return name


class Source:
    """One channel as the node reads it."""

    def __init__(self, channel, stamp_source):
        self.topic, self.name, self.field = channel.topic, channel.name, channel.field
        self.resolved = channel.topic         # the name on the graph, once a node subscribes
        self.type = channel.type
        self.message_class = message_class(channel.type)
        self.reader = field_reader(channel.type, channel.field, definition_of(channel.type))
        if stamp_source == 'header' and not self.reader.has_stamp:
            raise ValueError(f'{channel.type} of {channel.topic} has no header to take the stamp '
                             "from; set stamp_source to 'receive' or 'auto'")
        self.stamp_source = stamp_source
        self.by_receive_time = False
        self.unreadable = 0

    def read(self, batch, note):
        """Return stamps [ns] and values of a batch of (raw, receive_ns)."""
        try:
            stamps, values = self.reader.read_many([raw for raw, _ in batch])
        except ValueError:
            return self._read_one_by_one(batch, note)
        received = np.array([ns for _, ns in batch], dtype=np.int64)
        return self._choose(stamps, received), values

    def _read_one_by_one(self, batch, note):
        stamps, values = [], []
        for raw, received in batch:
            try:
                stamp, value = self.reader.read(raw)
            except ValueError as error:
                self.unreadable += 1
                note(f'{self.resolved}: a message was left out: {error}')
                continue
            stamps.append(self._choose(None if stamp is None else np.array([stamp]),
                                       np.array([received]))[0])
            values.append(value)
        return np.array(stamps, dtype=np.int64), np.array(values)

    def _choose(self, stamps, received):
        if stamps is None or self.stamp_source == 'receive':
            self.by_receive_time = True
            return received
        if self.stamp_source == 'auto' and not stamps.any():
            self.by_receive_time = True       # a driver that leaves its header empty
            return received
        return stamps


def channel_sources(settings):
    """
    Return the sources of the settings' channels.

    Raises
    ------
    ValueError
        For an entry that cannot be read, an unknown type or field, or two equal names.

    """
    sources = [Source(channel_of(text), settings.stamp_source) for text in settings.channels]
    names = [s.name for s in sources]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f'two channels are named {name!r}; give each a name of its own')
    return sources
