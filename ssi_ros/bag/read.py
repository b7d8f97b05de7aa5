"""Open a bag and read its messages: rosbag2 or a foreign .mcap, split, compressed."""
from dataclasses import dataclass, field, replace
from operator import itemgetter
from pathlib import Path
import re
from typing import NamedTuple

import yaml

from .layout import ROOT, Topic
from .mcap_scan import contents_of, load, messages_in
from .sqlite_bag import open_sqlite


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
    sources : tuple
        (start_ns, end_ns, load) of each piece: load(topics) -> {topic: three lists}.

    """

    path: Path
    files: tuple
    topics: tuple
    start_ns: int
    end_ns: int
    compressions: tuple = ()
    custom_data: dict = field(default_factory=dict)
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

    def pieces(self, topics=None, start_ns=None, end_ns=None):
        """Yield (start_ns, end_ns, {topic: (log, publish, raw) lists}), not sorted inside."""
        wanted = {self.topic(t).name for t in topics} if topics is not None else None
        for first, last, read in sorted(self.sources, key=itemgetter(0, 1)):
            if (start_ns is None or last >= start_ns) and (end_ns is None or first < end_ns):
                yield first, last, read(wanted)

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
        yield from waiting


def open_bag(path):
    """
    Open a bag.

    Parameters
    ----------
    path : str or Path
        Folder of a rosbag2 bag (MCAP or SQLite), one of its files, or any .mcap.

    Returns
    -------
    Bag

    Raises
    ------
    ValueError
        If there is no bag, or it was cut off, is damaged or foreign; says what to do.

    """
    path = Path(path)
    files, information = _files_of(path)
    if files[0].suffix == '.db3':
        topics, sources = open_sqlite(files)
        compressions = {'none'}
    else:
        topics, sources, compressions = _open_mcap(files)
    known = {t['topic_metadata']['name']: t['topic_metadata']
             for t in information.get('topics_with_message_count') or ()}
    topics = tuple(_completed(t, known.get(t.name, {})) for t in topics)
    return Bag(path, tuple(files), topics, min((s[0] for s in sources), default=0),
               max((s[1] for s in sources), default=0), tuple(sorted(compressions)),
               information.get('custom_data') or {}, tuple(sources))


def _completed(topic, known):
    """Fill in from metadata.yaml what a file's channel does not tell."""
    qos = known.get('offered_qos_profiles')
    qos = yaml.safe_load(qos) if isinstance(qos, str) else qos
    return replace(topic, qos=topic.qos or tuple(qos or ()),
                   type_hash=topic.type_hash or known.get('type_description_hash', ''))


def _files_of(path):
    """Return the files of a bag in order, and what its metadata.yaml says."""
    if not path.exists():
        raise ValueError(f'{path} does not exist; give the folder of a bag, or its .mcap')
    if path.is_file():
        return [path], {}
    metadata = path / 'metadata.yaml'
    if metadata.is_file():
        try:
            information = yaml.safe_load(metadata.read_text())[ROOT]
            names = information['relative_file_paths']
        except (yaml.YAMLError, KeyError, TypeError, UnicodeDecodeError):
            raise ValueError(f'{metadata} is not that of a rosbag2 bag; '
                             f'run ssi_ros recover {path}') from None
        files = [path / name for name in names]
        missing = [f.name for f in files if not f.is_file()]
        if missing or not files:
            raise ValueError(f'{path} lacks the file {", ".join(missing) or "of its messages"} '
                             'that its metadata.yaml names; restore it, or run ssi_ros recover '
                             f'{path} for the rest')
        mode = (information.get('compression_mode') or 'none').lower()
        if mode in ('file', 'message'):
            raise ValueError(f'{path} was compressed by rosbag2 {mode} by {mode}; convert it to '
                             'plain MCAP first (ros2 bag convert)')
        return files, information
    files = loose_files(path)
    if not files:
        raise ValueError(f'{path} is not a bag: it has no metadata.yaml, .mcap or .db3')
    return files, {}


def loose_files(folder):
    """Return the .mcap (or else .db3) files of a folder, NAME_2 before NAME_10."""
    def number(path):
        return [int(w) if w.isdigit() else w for w in re.split(r'(\d+)', path.name)]
    for suffix in ('*.mcap', '*.db3'):
        files = sorted(folder.glob(suffix), key=number)
        if files:
            return files
    return []


def _open_mcap(files):
    topics, sources, compressions = {}, [], set()
    for path in files:
        contents = contents_of(path)
        found = topics_of(contents, path)
        for topic in found.values():
            merge(topics, topic, path)
        names = {c: t.name for c, t in found.items()}
        for piece in contents.pieces:
            sources.append((piece.start_ns, piece.end_ns, _loader(path, piece, names)))
        compressions |= {c or 'none' for c in contents.compressions}
    return topics.values(), sources, compressions


def merge(topics, topic, path):
    """Add a topic, or its count to the one of that name."""
    had = topics.get(topic.name)
    if had is not None and had.type != topic.type:
        raise ValueError(f'{path}: topic {topic.name} has two types, {had.type} and {topic.type};'
                         ' split the bag by type first')
    topics[topic.name] = replace(had, count=had.count + topic.count) if had else topic


def topics_of(contents, path):
    """Return the Topic of each channel id of a file."""
    topics = {}
    for channel in contents.channels.values():
        schema = contents.schemas.get(channel.schema_id)
        qos = channel.metadata.get('offered_qos_profiles', '')
        try:
            qos = yaml.safe_load(qos) or ()
        except yaml.YAMLError:
            qos = ()
        known = schema is not None and schema.encoding == 'ros2msg'
        name = schema.name if schema is not None else ''
        if known and name.count('/') == 1:            # foreign writers leave out the /msg
            name = name.replace('/', '/msg/')
        topics[channel.id] = Topic(
            channel.topic, name or 'unknown', tuple(qos) if isinstance(qos, list) else (),
            schema.data.decode(errors='replace') if known else '',
            channel.metadata.get('topic_type_hash', ''), channel.message_encoding,
            contents.counts.get(channel.id, 0))
    return topics


def _loader(path, piece, names):
    def read(wanted):
        ids = None if wanted is None else {c for c, n in names.items() if n in wanted}
        with open(path, 'rb') as f:
            records = load(f, piece, path)
        found = {}
        for channel, columns in messages_in(records, ids).items():
            name = names.get(channel)
            if name is None:
                raise ValueError(f'{path} has messages of channel {channel}, which it does not '
                                 f'declare; run ssi_ros recover {path}')
            if name in found:                        # two publishers on one topic
                columns = tuple(a + b for a, b in zip(found[name], columns))
            found[name] = columns
        return found
    return read
