"""Make a sound bag of one that a crash, a power loss or a full disk left behind."""
from dataclasses import dataclass, replace
from pathlib import Path

from ssi_ros.limits import LATEST_NS

from .definitions import definition_of, type_hash_of
from .layout import profiles_of
from .mcap_chunk import load, messages_in
from .mcap_contents import check_magic
from .mcap_records import plausible
from .mcap_scan import scan
from .metadata import kept_custom_data, loose_files, path_of, regular
from .read import merge, topics_of
from .writer import BagWriter


@dataclass(frozen=True)
class RecoverReport:
    """
    What was saved and what was lost.

    Attributes
    ----------
    out : Path
        The sound bag.
    saved : dict
        Topic -> number of messages.
    first_ns, last_ns : int or None
        First and last log time that was saved [ns].
    bytes_read, bytes_dropped : int
        Size of the old files and how much of it held nothing that could be read [byte].
    salvaged : int
        Messages out of chunks that were cut in the middle; among `saved`.
    damage : tuple of str
        What was wrong, a line a file; empty if only metadata.yaml was missing.
    unchecked : int
        Chunks without a checksum, and runs of messages outside of chunks: damage inside them
        cannot be noticed.

    """

    out: Path
    saved: dict
    first_ns: object
    last_ns: object
    bytes_read: int
    bytes_dropped: int
    salvaged: int
    damage: tuple
    unchecked: int = 0


def recover(path, out, progress=None, largest_chunk=None):
    """
    Write all that can be read of a damaged bag to a new one.

    Parameters
    ----------
    path : str or Path
        Folder of the bag, with or without metadata.yaml, or one .mcap. It is not changed.
    out : str or Path
        Folder to make.
    progress : callable, optional
        Called with the share done, 0 to 1.
    largest_chunk : int, optional
        Largest chunk that is read [byte]; that of LIMITS if not given. The new bag has chunks of
        1 MiB.

    Returns
    -------
    RecoverReport

    Raises
    ------
    ValueError
        If there is nothing to recover, or `out` exists.

    """
    path, out = path_of(path), path_of(out)
    if out.exists():
        raise ValueError(f'{out} exists and is never overwritten; name another folder')
    files = _files(path)
    found = [(file, scan(file, largest_chunk)) for file in files]
    topics = _topics(found)
    if not topics:
        raise ValueError(f'{path} declares no topic in the part that can be read, so there is '
                         'nothing to recover: it was cut off before its first flush, or its '
                         'schemas and channels are damaged')
    times, saved, salvaged, total = [], dict.fromkeys(topics, 0), 0, _pieces(found)
    done = late = 0
    with BagWriter(out, custom_data=_custom_data(found)) as bag:
        for name, topic in topics.items():
            bag.add_topic(name, topic.type, _profiles(topic), definition=topic.definition,
                          type_hash=topic.type_hash, encoding=topic.encoding)
        for file, contents in found:
            names = {c: t.name for c, t in topics_of(contents, file).items() if t.name in topics}
            with open(file, 'rb') as f:
                for records, cut in _records(f, file, contents, largest_chunk):
                    ends, count, beyond = _copy(records, names, bag, saved)
                    times, late = times + ends, late + beyond
                    salvaged += count if cut else 0
                    done += 1
                    if progress is not None:
                        progress(done / total)
    return RecoverReport(
        out, saved, min(times, default=None), max(times, default=None),
        sum(c.size for _, c in found), sum(c.dropped_bytes for _, c in found), salvaged,
        tuple(f'{file.name}: {c.damage}' for file, c in found if c.damage)
        + ((f'{late} messages have times beyond those of ROS, and are left out',) if late else ()),
        sum(c.unchecked for _, c in found))


def _topics(found):
    """Return the topics of all files by name; of two types of a topic the first one is kept."""
    topics = {}
    for file, contents in found:
        for channel, topic in topics_of(contents, file).items():
            try:
                merge(topics, _vouched(topic, channel, contents), file)
            except ValueError as error:
                _note(contents, f'{error}')
    return topics


def _note(contents, words):
    contents.damage += ('; ' if contents.damage else '') + words


def _vouched(topic, channel, contents):
    """
    Return a topic with a definition that something vouches for, where there is one.

    A definition that is damaged can still be one, of other members, and values read by it are
    wrong. Where no checksum holds, the hash that the channel keeps of its type says whether the
    definition that is installed here is the same.
    """
    differ = contents.unsure.get(contents.channels[channel].schema_id)
    if differ is None or topic.encoding != 'cdr':
        return topic
    try:
        same = bool(topic.type_hash) and type_hash_of(topic.type) == topic.type_hash
        text = definition_of(topic.type) if same else topic.definition
    except (ValueError, OSError):
        same, text = False, topic.definition
    if not same and differ:
        _note(contents, f'the copies of the definition of {topic.type} differ and no checksum '
              f'says which is right: values of {topic.name} may be wrong')
    if differ and text != topic.definition:
        _note(contents, f'the definition of {topic.type} is that of this machine, whose hash is '
              'the same')
    return replace(topic, definition=text)


def _profiles(topic):
    """Return the qualities of service of a topic that rosbag2 has words for."""
    try:
        return profiles_of(list(topic.qos))
    except (ValueError, TypeError):
        return []


def _files(path):
    if not path.exists():
        raise ValueError(f'{path} does not exist; give the folder of a bag, or its .mcap')
    files = [path] if not path.is_dir() else loose_files(path)
    if not files:
        raise ValueError(f'{path} holds no .mcap, so there is nothing to recover')
    if files[0].suffix == '.db3':
        raise ValueError(f'{path} is a SQLite bag; sqlite3 FILE.db3 .recover and ros2 bag reindex '
                         'repair those')
    kept = [f for f in files if regular(f).stat().st_size]
    if not kept:
        raise ValueError(f'{path} is empty: nothing was ever written to it')
    for file in kept:
        with open(file, 'rb') as f:
            header = plausible(f, 8, f.seek(0, 2))
        if header is None:                 # a damaged magic before a sound header is no reason
            check_magic(file)
    return kept


def _pieces(found):
    return max(1, sum(len(c.pieces) + len(c.salvaged) for _, c in found))


def _records(f, file, contents, limit):
    """Yield the records of every piece, and whether they come of a chunk that was cut."""
    for piece in contents.pieces:
        yield load(f, piece, file, limit), False
    for records in contents.salvaged:
        yield records, True


def _copy(records, names, bag, saved):
    """Copy messages by log time; return the first and last one, how many, and those too late."""
    every = sorted(
        ((log, publish, names[channel], raw)
         for channel, columns in messages_in(records, names, strict=False).items()
         for log, publish, raw in zip(*columns)), key=lambda m: m[0])
    messages = [m for m in every if max(m[:2]) <= LATEST_NS]
    for log, publish, name, raw in messages:
        bag.write(name, raw, log, publish)
        saved[name] += 1
    return ([m[0] for m in messages[:1] + messages[-1:]], len(messages),
            len(every) - len(messages))


def _custom_data(found):
    """Return the custom data that the last metadata record of the files holds."""
    for _, contents in reversed(found):
        custom = kept_custom_data(
            contents.metadata.get('rosbag2', {}).get('serialized_metadata', ''))
        if custom:
            return custom
    return None
