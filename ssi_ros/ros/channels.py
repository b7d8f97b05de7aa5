"""The channels of the identifier: which topic, which type, which field, and how it is stamped."""
import importlib

import numpy as np
from ssi_ros.bag import Channel, definition_of, field_reader
from ssi_ros.bag.channels import DEFAULT_FIELD, DEFAULT_TYPE
from ssi_ros.quantity import unknown
import yaml

KEYS = ('topic', 'type', 'field', 'name')


def message_class(type_name):
    """
    Return the Python class of a message type 'pkg/msg/Type'.

    Raises
    ------
    ValueError
        If the type is not installed.

    """
    try:
        package, kind, name = type_name.split('/')
        return getattr(importlib.import_module(f'{package}.{kind}'), name)
    except (ValueError, ImportError, AttributeError):
        raise ValueError(f'message type {type_name!r} is not installed; write it as '
                         'pkg/msg/Type, and install or source its package') from None


def channel_of(text):
    """
    Return the Channel that one entry of the parameter `channels` describes.

    Parameters
    ----------
    text : str
        A YAML mapping with topic, and optionally type, field and name; or only a topic.

    """
    try:
        entry = yaml.safe_load(text)
    except yaml.YAMLError:
        raise ValueError(f'channel {text!r} is not YAML; write {{topic: /imu, '
                         'type: sensor_msgs/msg/Imu, field: linear_acceleration.z}') from None
    if isinstance(entry, str):
        entry = {'topic': entry}
    if not isinstance(entry, dict) or 'topic' not in entry:
        raise ValueError(f'channel {text!r} names no topic; write {{topic: T, type: pkg/msg/Type, '
                         'field: a.b[0], name: N}')
    for key in entry:
        if key not in KEYS:
            raise ValueError(unknown(f'channel {text!r}: {key}', key, KEYS))
    return Channel(entry['topic'], entry.get('type', DEFAULT_TYPE),
                   entry.get('field', DEFAULT_FIELD), entry.get('name', ''))


class Source:
    """One channel as the node reads it."""

    def __init__(self, channel, stamp_source):
        self.topic, self.name, self.field = channel.topic, channel.name, channel.field
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
                note(f'{self.topic}: a message was left out: {error}')
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
