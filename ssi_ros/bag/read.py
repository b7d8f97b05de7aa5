"""Open a bag and read its messages: rosbag2 or a foreign .mcap, split, compressed."""
from collections import Counter
from dataclasses import dataclass, field, replace
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

from ssi_ros.limits import LIMITS

from .layout import Topic
from .mcap_chunk import load, messages_in, span
from .mcap_contents import contents_of
from .metadata import path_of, profiles_in, read_metadata
from .sqlite_bag import open_sqlite

_OF_A_MESSAGE = 200            # bytes that a message takes beside its own


class Message(NamedTuple):
    """One message of a bag: topic, log and publish time [ns], CDR bytes."""

    topic: str
    log_ns: int
    publish_ns: int
    raw: bytes


@dataclass(frozen=True)
class Bag:
    """
    An open bag; `messages` reads it.

    Attributes
    ----------
    path : Path
        As it was given.
    files : tuple of Path
        Its splits.
    topics : tuple of Topic
        With type, qos, definition, type_hash and count.
    start_ns, end_ns : int
        First and last log time [ns]; 0 for a bag without messages.
    compressions : tuple of str
        Of its chunks: 'zstd', 'lz4', 'none'.
    custom_data : dict
        Words to words, from metadata.yaml.
    warnings : tuple of str
        What of metadata.yaml was not believed.
    sources : tuple
        (start_ns, end_ns, load) of each piece: load(topics, most) -> {topic: log and publish
        times, CDR bytes}, of each message at most `most` bytes.

    """

    path: Path
    files: tuple
    topics: tuple
    start_ns: int
    end_ns: int
    compressions: tuple = ()
    custom_data: dict = field(default_factory=dict)
    warnings: tuple = ()
    sources: tuple = field(default=(), repr=False)

    @property
    def message_count(self):
        """Return the number of messages of all topics."""
        return sum(t.count for t in self.topics)

    def topic(self, name):
        """Return a topic; ValueError lists those that exist."""
        for topic in self.topics:
            if topic.name == name:
                return topic
        raise ValueError(f'{self.path} has no topic {name}; it has '
                         + (', '.join(f'{t.name} ({t.type})' for t in self.topics) or 'none'))

    def pieces(self, topics=None, start_ns=None, end_ns=None, most=None):
        """
        Yield (start_ns, end_ns, {topic: (log, publish, raw)}), not sorted inside.

        Raises
        ------
        ValueError
            If a piece is damaged, or, where all were read, not as many messages are there as the
            bag declares.

        """
        chosen = [self.topic(t) for t in topics] if topics is not None else self.topics
        wanted = {t.name for t in chosen} if topics is not None else None
        held = Counter()
        for first, last, read in sorted(self.sources, key=itemgetter(0, 1)):
            if (start_ns is None or last >= start_ns) and (end_ns is None or first < end_ns):
                found = read(wanted, most)
                held.update({name: len(columns[0]) for name, columns in found.items()})
                yield first, last, found
        for topic in chosen if start_ns is None and end_ns is None else ():
            if held[topic.name] != topic.count:
                raise ValueError(f'{self.path} declares {topic.count} messages of {topic.name} '
                                 f'and holds {held[topic.name]}; run ssi_ros recover {self.path}')

    def messages(self, topics=None, start_ns=None, end_ns=None):
        """
        Yield Messages by rising log time.

        Parameters
        ----------
        topics : sequence of str, optional
            Topics to read; all if not given.
        start_ns, end_ns : int, optional
            Log times from, and up to but not including [ns].

        """
        waiting = []
        for first, _, found in self.pieces(topics, start_ns, end_ns):
            # What is older than all that is still to come can go.
            at = next((i for i, m in enumerate(waiting) if m.log_ns >= first), len(waiting))
            yield from waiting[:at]
            del waiting[:at]
            waiting += [Message(topic, log, publish, raw)
                        for topic, columns in found.items()
                        for log, publish, raw in zip(*columns)
                        if (start_ns is None or log >= start_ns)
                        and (end_ns is None or log < end_ns)]
            waiting.sort(key=itemgetter(1))
            held = sum(len(m.raw) + _OF_A_MESSAGE for m in waiting)
            if held > LIMITS.waiting_bytes:
                raise ValueError(f'{self.path}: its chunks overlap in log time, so that more than '
                                 f'{LIMITS.waiting_bytes} bytes of messages would wait for '
                                 'older ones; sort it first (ros2 bag convert)')
        yield from waiting


def open_bag(path, largest_chunk=None):
    """
    Open a bag.

    Parameters
    ----------
    path : str or Path
        Folder of a rosbag2 bag (MCAP or SQLite), one of its files, or any .mcap.
    largest_chunk : int, optional
        Largest chunk that is read [byte]; that of LIMITS if not given.

    Returns
    -------
    Bag

    Raises
    ------
    ValueError
        If there is no bag, or it was cut off, is damaged, foreign or larger than the limits;
        says what to do.

    """
    path = path_of(path)
    metadata = read_metadata(path)
    if metadata.files[0].suffix == '.db3':
        topics, sources = open_sqlite(metadata.files)
        compressions = {'none'}
    else:
        topics, sources, compressions = _open_mcap(metadata.files, largest_chunk)
    # metadata.yaml fills in what a file's channel leaves out
    topics = tuple(replace(t, qos=t.qos or metadata.qos.get(t.name, ()),
                           type_hash=t.type_hash or metadata.hashes.get(t.name, ''))
                   for t in topics)
    return Bag(path, metadata.files, topics, min((s[0] for s in sources), default=0),
               max((s[1] for s in sources), default=0), tuple(sorted(compressions)),
               metadata.custom_data, metadata.warnings, tuple(sources))


def _open_mcap(files, limit):
    topics, sources, compressions = {}, [], set()
    for path in files:
        contents = contents_of(path, limit)
        found = topics_of(contents, path)
        for topic in found.values():
            merge(topics, topic, path)
        names = {c: t.name for c, t in found.items()}
        for piece in contents.pieces:
            sources.append((piece.start_ns, piece.end_ns, _loader(path, piece, names, limit)))
        compressions |= {c or 'none' for c in contents.compressions}
    return topics.values(), sources, compressions


def merge(topics, topic, path):
    """Add a topic, or its count to the one of that name."""
    had = topics.get(topic.name)
    if len(topics) > LIMITS.topics:
        raise ValueError(f'{path} has more than {LIMITS.topics} topics, the most that are read')
    if had is not None and had.type != topic.type:
        raise ValueError(f'{path}: topic {topic.name} has two types, {had.type} and {topic.type};'
                         ' split the bag by type first')
    topics[topic.name] = replace(had, count=had.count + topic.count) if had else topic


def topics_of(contents, path):
    """Return the Topic of each channel id of a file."""
    topics = {}
    for channel in contents.channels.values():
        schema = contents.schemas.get(channel.schema_id)
        known = schema is not None and schema.encoding == 'ros2msg'
        name = schema.name if schema is not None else ''
        if known and name.count('/') == 1:            # foreign writers leave out the /msg
            name = name.replace('/', '/msg/')
        topics[channel.id] = Topic(
            channel.topic, name or 'unknown',
            profiles_in(channel.metadata.get('offered_qos_profiles', '')),
            schema.data.decode(errors='replace') if known else '',
            channel.metadata.get('topic_type_hash', ''), channel.message_encoding,
            contents.counts.get(channel.id, 0))
    return topics


def _loader(path, piece, names, limit):
    def read(wanted, most=None):
        ids = None if wanted is None else {c for c, n in names.items() if n in wanted}
        with open(path, 'rb') as f:
            records = load(f, piece, path, limit)
        found = {}
        try:
            messages = messages_in(records, ids, most)
        except ValueError as error:
            raise ValueError(f'{path}: the piece at byte {piece.offset} is damaged: {error}; '
                             f'run ssi_ros recover {path}') from None
        for channel, columns in messages.items():
            name = names.get(channel)
            if name is None:
                raise ValueError(f'{path} has messages of channel {channel}, which it does not '
                                 f'declare; run ssi_ros recover {path}')
            first, last = span(columns[0])
            if not piece.start_ns <= first <= last <= piece.end_ns:
                raise ValueError(f'{path} has messages in the piece at byte {piece.offset} whose '
                                 'log times are not those of its index; run ssi_ros recover '
                                 f'{path}')
            if name in found:                        # two publishers on one topic
                columns = tuple(a + b for a, b in zip(found[name], columns))
            found[name] = columns
        return found
    return read
