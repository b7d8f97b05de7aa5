"""Read channels of a bag, one number of one topic each, into arrays."""
from collections import Counter
from dataclasses import dataclass

import numpy as np

from ssi_ros.limits import LIMITS

from .cdr import field_reader
from .mcap_runs import LEAST, Rows
from .read import Bag, open_bag
from .schema import numeric_fields, short_name

DEFAULT_TYPE, DEFAULT_FIELD = 'geometry_msgs/msg/AccelStamped', 'accel.linear.z'
_BATCH = 50_000                 # messages of a topic that are turned into arrays at once
# numbers of a column in one piece: memory of that size goes back to the system when it is let go
_PIECE = 1 << 23


@dataclass(frozen=True)
class Channel:
    """One number of one topic; without a type, the bag's."""

    topic: str
    type: str = ''  # noqa: A003, the word of ROS
    field: str = DEFAULT_FIELD
    name: str = ''

    def __post_init__(self):
        if not self.name:
            leaf = self.topic.rsplit('/', 1)[-1]
            object.__setattr__(self, 'name', leaf if self.field == DEFAULT_FIELD
                               else f'{leaf}.{self.field}')


@dataclass(frozen=True)
class Recording:
    """
    Channels read from a bag; each has its own stamps.

    Attributes
    ----------
    channels : tuple of Channel
        What was read.
    stamps_ns : tuple of ndarray of int64
        Header stamps [ns] in the order of arrival; log times where `by_log_time` says so.
    values : tuple of ndarray
        The field's values.
    arrivals_ns : tuple of ndarray of int64
        Log times [ns], not falling.
    by_log_time : tuple of bool
        Whether a channel is stamped by log time: its type has no header, or all its header
        stamps are 0.

    """

    channels: tuple
    stamps_ns: tuple
    values: tuple
    arrivals_ns: tuple
    by_log_time: tuple

    @property
    def names(self):
        """Return the names of the channels."""
        return tuple(c.name for c in self.channels)


def find_channels(bag):
    """
    Return the accelerometer channels of a bag.

    Raises
    ------
    ValueError
        If it has none; lists the numeric topics it has.

    """
    topics = [t.name for t in bag.topics if t.type == DEFAULT_TYPE and t.count]
    if topics:
        leaves = Counter(t.rsplit('/', 1)[-1] for t in topics)
        return tuple(Channel(t, DEFAULT_TYPE, DEFAULT_FIELD, t.rsplit('/', 1)[-1]
                             if leaves[t.rsplit('/', 1)[-1]] == 1 else t.strip('/'))
                     for t in topics)
    if not bag.message_count:
        raise ValueError(f'{bag.path} holds no messages; record again, with the topics published')
    numeric = []
    for t in bag.topics:
        try:
            fields = numeric_fields(t.type, t.definition) if t.definition else ()
        except ValueError:
            fields = ()
        likely = [f for f in fields if '.stamp.' not in f]
        if likely:
            numeric.append(f'{t.name} ({t.type}: {", ".join(likely[:4])}'
                           f'{", ..." if len(likely) > 4 else ""})')
    raise ValueError(f'{bag.path} has no {DEFAULT_TYPE} topic; name channels as TOPIC:FIELD. '
                     'Its numeric topics: ' + ('; '.join(numeric) or 'none'))


def parse_channel(text):
    """Return the Channel that TOPIC or TOPIC:FIELD names; ValueError if it is neither."""
    topic, _, field = text.partition(':')
    if not topic.startswith('/') or text.endswith(':'):
        raise ValueError(f'channel {text!r} must be /topic or /topic:field, such as '
                         '/imu:linear_acceleration.z')
    return Channel(topic, '', field or DEFAULT_FIELD)


class _Column:
    """A growing column in large pieces: a heap full of small ones would not shrink again."""

    def __init__(self, count):
        """Begin; so many numbers are expected."""
        self.full, self.piece, self.held, self.size = [], None, 0, min(max(count, 1), _PIECE)

    def append(self, some):
        """Add numbers (n,); None stands for the stamps of a type that has none."""
        if some is None:
            return
        if self.piece is None:
            self.piece = np.empty(self.size, some.dtype)
        while self.held + len(some) > self.size:
            room = self.piece[self.held:]
            room[:], some = some[:len(room)], some[len(room):]
            self.full.append(_packed(self.piece))
            self.piece, self.held = np.empty(self.size, self.piece.dtype), 0
        self.piece[self.held:self.held + len(some)] = some
        self.held += len(some)

    def whole(self):
        """Return all of it, None where nothing was added; its pieces are let go."""
        if self.piece is None:
            return None
        last, full = self.piece[:self.held], self.full
        if not full:
            return last
        whole, at = np.empty(self.size * len(full) + self.held, last.dtype), 0
        while full:
            whole[at:at + self.size] = full.pop(0)
            at += self.size
        whole[at:] = last
        return whole


class _Steps:
    """Times [ns] by their steps in half the room, where they follow each other within 2 s."""

    def __init__(self, first, steps):
        self.first, self.steps = first, steps

    def __len__(self):
        return len(self.steps) + 1

    def __array__(self, dtype=None, copy=None):
        """Return the times."""
        times = np.empty(len(self), np.int64)
        times[0] = self.first
        np.cumsum(self.steps, out=times[1:])
        times[1:] += self.first
        return times


def _packed(column):
    """Return a column that waits to be joined: times by their steps where these are small."""
    if column.dtype != np.int64:
        return column
    steps = np.diff(column)
    small = np.abs(steps).max(initial=0) < 2 ** 31
    return _Steps(column[0], steps.astype(np.int32)) if small else column


def _shared(column, *others):
    """Return one of the others where it is the same as a column, so that one of them is kept."""
    return next((o for o in others if o is not None and np.array_equal(o, column)), column)


def _readers(bag, channels):
    readers = {}
    for i, c in enumerate(channels):
        topic = bag.topic(c.topic)
        if c.type and short_name(c.type) != short_name(topic.type):
            raise ValueError(f'{c.topic} is of type {topic.type} in {bag.path}, not {c.type}; '
                             'correct the type of the channel')
        if topic.encoding != 'cdr' or not topic.definition:
            raise ValueError(f'{c.topic} is of type {topic.type} encoded as {topic.encoding!r} '
                             f'in {bag.path}, without a ros2msg definition; only CDR messages '
                             'with their definition can be read')
        readers.setdefault(c.topic, []).append(
            (i, field_reader(topic.type, c.field, topic.definition)))
    return readers


def read_channels(path, channels=None, progress=None):
    """
    Read channels of a bag into arrays.

    Parameters
    ----------
    path : str, Path or Bag
        The bag.
    channels : sequence of Channel, optional
        What to read; its accelerometer channels if not given.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Recording

    Raises
    ------
    ValueError
        If the bag or a channel cannot be read; lists what exists.

    """
    bag = path if isinstance(path, Bag) else open_bag(path)
    channels = tuple(channels) if channels is not None else find_channels(bag)
    readers = _readers(bag, channels)
    waiting = {topic: ([], []) for topic in readers}
    counts = [bag.topic(c.topic).count for c in channels]
    parts = [(_Column(n), _Column(n), _Column(n)) for n in counts]
    begun = set()

    def convert(topic):
        logs, raws = waiting[topic]
        if not logs and topic in begun:
            return
        begun.add(topic)
        times = np.concatenate(logs) if logs else np.empty(0, np.int64)
        for i, reader in readers[topic]:
            try:
                stamps, values = reader.read_many(raws)
            except ValueError as error:
                raise ValueError(f'{topic} in {bag.path}: {error}') from None
            for part, column in zip(parts[i], (stamps, values, times)):
                part.append(column)
        waiting[topic], held[topic] = ([], []), 0

    held = dict.fromkeys(readers, 0)
    for done, (_, _, found) in enumerate(bag.pieces(topics=list(readers))):
        for topic, (logs, _, raws) in found.items():
            if isinstance(raws, Rows) and len(raws) >= LEAST:
                # columns of what lies in one chunk need no messages one by one
                convert(topic)
                waiting[topic] = [np.array(logs, np.int64)], raws
                convert(topic)
                continue
            waiting[topic][0].append(np.array(logs, np.int64))
            waiting[topic][1].extend(raws)
            held[topic] += sum(map(len, raws))
            if len(waiting[topic][1]) >= _BATCH or held[topic] > LIMITS.run_bytes:
                convert(topic)
        if progress is not None:
            progress((done + 1) / len(bag.sources))
    for topic in readers:
        convert(topic)
    return _recording(channels, parts)


def _recording(channels, parts):
    columns, by, before = [], [], (None, None, None)
    while parts:        # a channel in pieces is let go before the next one is joined
        stamps, values, logs = (column.whole() for column in parts.pop(0))
        # channels of one message, or of one instant, have the same times
        logs = _shared(logs, before[2])
        by_log = stamps is None
        stamps = logs if by_log else _shared(stamps, logs, before[0])
        if len(stamps) > 1 and not stamps.any():
            stamps, by_log = logs, True
        if (np.diff(logs) < 0).any():                # pieces overlap: back to order of arrival
            order = np.argsort(logs, kind='stable')
            stamps, values, logs = stamps[order], values[order], logs[order]
        columns.append(before := (stamps, values, logs))
        by.append(by_log)
    return Recording(channels, *zip(*columns), tuple(by)) if columns else (
        Recording((), (), (), (), ()))
