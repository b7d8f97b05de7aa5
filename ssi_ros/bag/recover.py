"""Make a sound bag of one that a crash, a power loss or a full disk left behind."""
from dataclasses import dataclass
from pathlib import Path

import yaml

from .layout import ROOT
from .mcap_scan import check_magic, load, messages_in, scan
from .read import loose_files, merge, topics_of
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

    """

    out: Path
    saved: dict
    first_ns: object
    last_ns: object
    bytes_read: int
    bytes_dropped: int
    salvaged: int
    damage: tuple


def recover(path, out, progress=None):
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

    Returns
    -------
    RecoverReport

    Raises
    ------
    ValueError
        If there is nothing to recover, or `out` exists.

    """
    path, out = Path(path), Path(out)
    if out.exists():
        raise ValueError(f'{out} exists and is never overwritten; name another folder')
    files = _files(path)
    found = [(file, scan(file)) for file in files]
    topics = {}
    for file, contents in found:
        for topic in topics_of(contents, file).values():
            merge(topics, topic, file)
    if not topics:
        raise ValueError(f'{path} declares no topic in the part that can be read, so there is '
                         'nothing to recover: it was cut off before its first flush')
    times, saved, salvaged, total = [], dict.fromkeys(topics, 0), 0, _pieces(found)
    done = 0
    with BagWriter(out, custom_data=_custom_data(found)) as bag:
        for name, topic in topics.items():
            bag.add_topic(name, topic.type, list(topic.qos), definition=topic.definition,
                          type_hash=topic.type_hash)
        for file, contents in found:
            names = {c: t.name for c, t in topics_of(contents, file).items()}
            with open(file, 'rb') as f:
                for records, cut in _records(f, file, contents):
                    ends, count = _copy(records, names, bag, saved)
                    times += ends
                    salvaged += count if cut else 0
                    done += 1
                    if progress is not None:
                        progress(done / total)
    return RecoverReport(
        out, saved, min(times, default=None), max(times, default=None),
        sum(c.size for _, c in found), sum(c.size - c.sound_bytes for _, c in found), salvaged,
        tuple(f'{file.name}: {c.damage}' for file, c in found if c.damage))


def _files(path):
    if not path.exists():
        raise ValueError(f'{path} does not exist; give the folder of a bag, or its .mcap')
    files = [path] if path.is_file() else loose_files(path)
    if not files:
        raise ValueError(f'{path} holds no .mcap, so there is nothing to recover')
    if files[0].suffix == '.db3':
        raise ValueError(f'{path} is a SQLite bag; sqlite3 FILE.db3 .recover and ros2 bag reindex '
                         'repair those')
    kept = [f for f in files if f.stat().st_size]
    if not kept:
        raise ValueError(f'{path} is empty: nothing was ever written to it')
    for file in kept:
        check_magic(file)
    return kept


def _pieces(found):
    return max(1, sum(len(c.pieces) + len(c.salvaged) for _, c in found))


def _records(f, file, contents):
    """Yield the records of every piece, and whether they come of a chunk that was cut."""
    for piece in contents.pieces:
        yield load(f, piece, file), False
    for records in contents.salvaged:
        yield records, True


def _copy(records, names, bag, saved):
    """Copy messages by log time; return their first and last log time, and how many."""
    messages = sorted(
        ((log, publish, names[channel], raw)
         for channel, columns in messages_in(records).items() if channel in names
         for log, publish, raw in zip(*columns)), key=lambda m: m[0])
    for log, publish, name, raw in messages:
        bag.write(name, raw, log, publish)
        saved[name] += 1
    return [m[0] for m in messages[:1] + messages[-1:]], len(messages)


def _custom_data(found):
    """Return the custom data that the last metadata record of the files holds."""
    for _, contents in reversed(found):
        text = contents.metadata.get('rosbag2', {}).get('serialized_metadata', '')
        try:
            information = yaml.safe_load(text) or {}
        except yaml.YAMLError:
            continue
        information = information.get(ROOT, information)
        if information.get('custom_data'):
            return information['custom_data']
    return None
