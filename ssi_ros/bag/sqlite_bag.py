"""
Read the SQLite files (.db3) of rosbag2, by the standard library.

A file of others: only tables are read (a view may be infinite), read-only, with a bound on the
steps of a query and the bytes of a piece, and every value is checked to be of its type.
"""
from contextlib import closing, contextmanager
from functools import partial
import sqlite3

from ssi_ros.limits import LATEST_NS, LIMITS
from ssi_ros.quantity import shown

from .definitions import definition_of, type_hash_of
from .layout import Topic
from .metadata import profiles_in

_ROWS = 50_000                       # messages of one piece
_STEPS = 1_000_000                   # virtual machine steps between two checks


def open_sqlite(files):
    """
    Return the topics and the pieces of .db3 files, as `Bag` wants them.

    Raises
    ------
    ValueError
        If a file is not one of rosbag2's, is damaged, or larger than the limits.

    """
    from .read import merge

    topics, sources = {}, []
    for path in files:
        with _opened(path) as db:
            for topic in _topics(db):
                merge(topics, topic, path)
            for first, last in _cuts(db):
                sources.append((first, last, partial(_read, path, first, last)))
    return topics.values(), sources


@contextmanager
def _opened(path):
    """Give a connection to a sound file; what SQLite says of another becomes a ValueError."""
    budget = [LIMITS.sqlite_ops + 10 * path.stat().st_size // _STEPS]

    def spend():
        budget[0] -= 1
        return budget[0] < 0

    try:
        with closing(sqlite3.connect(f'{path.resolve().as_uri()}?mode=ro', uri=True)) as db:
            if hasattr(db, 'setlimit'):               # Python 3.11
                db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LIMITS.chunk_bytes)
            db.set_progress_handler(spend, _STEPS)
            for pragma in ('query_only=on', 'trusted_schema=off', 'cell_size_check=on'):
                db.execute(f'pragma {pragma}')
            _check_tables(db)
            yield db
    # a damaged page makes SQLite ask for more memory than it may have: MemoryError
    except (sqlite3.Error, ValueError, OverflowError, MemoryError) as error:
        why = 'it takes too many steps' if budget[0] < 0 else shown(error) or 'out of memory'
        raise ValueError(f'{path} is not a sound SQLite bag of rosbag2 ({why}); '
                         'try ros2 bag reindex') from None


def _check_tables(db):
    for name in ('topics', 'messages'):
        row = db.execute('select type, sql from sqlite_master where name=?', (name,)).fetchone()
        if row is None or row[0] != 'table' or 'virtual' in str(row[1]).lower().split()[:3]:
            raise ValueError(f'it has no table {name}')


def _topics(db):
    columns = {r[1] for r in db.execute('pragma table_info(topics)')}
    definitions = {}
    if db.execute("select 1 from sqlite_master where name='message_definitions' "
                  "and type='table'").fetchone():
        definitions = {name: text for name, encoding, text in db.execute(
            'select topic_type, encoding, encoded_message_definition from message_definitions')
            if encoding == 'ros2msg' and isinstance(text, str)}
    qos = 'offered_qos_profiles' if 'offered_qos_profiles' in columns else "''"
    digest = 'type_description_hash' if 'type_description_hash' in columns else "''"
    counts = dict(db.execute('select topic_id, count(*) from messages group by topic_id'))
    for key, name, type_name, encoding, profiles, type_hash in db.execute(
            f'select id, name, type, serialization_format, {qos}, {digest} from topics'):
        if not all(isinstance(word, str) and word for word in (name, type_name, encoding)):
            raise ValueError('a topic has a name, type or format that is no text')
        definition = definitions.get(type_name, '')
        if not definition:                # rosbag2 before Iron keeps none: take the installed one
            try:
                definition, type_hash = definition_of(type_name), type_hash_of(type_name)
            except ValueError:
                pass
        yield Topic(name, type_name, profiles_in(profiles), definition,
                    type_hash if isinstance(type_hash, str) else '', encoding,
                    counts.get(key, 0))


def _cuts(db):
    """Yield first and last log time [ns] of pieces, bounded in messages and in bytes."""
    first = last = None
    rows = size = 0
    for time, length in db.execute(
            'select timestamp, length(data) from messages order by timestamp'):
        if not isinstance(time, int) or not 0 <= time <= LATEST_NS or not isinstance(length, int):
            raise ValueError(f'a message has the time {time!r:.40} and data of length '
                             f'{length!r:.40}')
        if first is not None and time > last and (
                rows >= _ROWS or size + length > LIMITS.run_bytes):
            yield first, last
            first, rows, size = None, 0, 0
        first = time if first is None else first
        last, rows, size = time, rows + 1, size + length
        if size > max(LIMITS.chunk_bytes, length):
            raise ValueError(f'more than {LIMITS.chunk_bytes} bytes of messages have one log time')
    if first is not None:
        yield first, last


def _read(path, first, last, wanted, most=None):
    found = {}
    with _opened(path) as db:
        for name, log, raw in db.execute(
                'select topics.name, timestamp, data from messages join topics on '
                'topics.id = topic_id where timestamp between ? and ? order by timestamp',
                (first, last)):
            if wanted is None or name in wanted:
                if not isinstance(raw, bytes):
                    raise ValueError(f'a message of {name} at {log} ns is no bytes')
                logs, publishes, raws = found.setdefault(name, ([], [], []))
                logs.append(log)
                publishes.append(log)            # SQLite bags keep no publish time
                raws.append(raw[:most])
    return found
