"""Read the SQLite files (.db3) of rosbag2, by the standard library."""
from contextlib import closing
from dataclasses import replace
from functools import partial
import sqlite3

import yaml

from .definitions import definition_of, type_hash_of
from .layout import Topic

_ROWS = 50_000                       # messages of one piece


def open_sqlite(files):
    """
    Return the topics and the pieces of .db3 files, as `Bag` wants them.

    Raises
    ------
    ValueError
        If a file is not one of rosbag2's.

    """
    topics, sources = {}, []
    for path in files:
        try:
            with closing(_connect(path)) as db:
                for topic in _topics(db):
                    had = topics.get(topic.name)
                    topics[topic.name] = replace(
                        topic, count=topic.count + (had.count if had else 0))
                times = [r[0] for r in db.execute(
                    'select timestamp from messages order by timestamp')]
        except sqlite3.Error as error:
            raise ValueError(f'{path} is not a sound SQLite bag of rosbag2 ({error}); '
                             'try ros2 bag reindex') from None
        cuts = sorted({times[i] for i in range(0, len(times), _ROWS)})
        for first, last in zip(cuts, [*(c - 1 for c in cuts[1:]), *times[-1:]]):
            sources.append((first, last, partial(_read, path, first, last)))
    return topics.values(), sources


def _connect(path):
    return sqlite3.connect(f'{path.resolve().as_uri()}?mode=ro', uri=True)


def _topics(db):
    columns = {r[1] for r in db.execute('pragma table_info(topics)')}
    definitions = {}
    if db.execute("select 1 from sqlite_master where name='message_definitions'").fetchone():
        definitions = {name: text for name, encoding, text in db.execute(
            'select topic_type, encoding, encoded_message_definition from message_definitions')
            if encoding == 'ros2msg'}
    qos = 'offered_qos_profiles' if 'offered_qos_profiles' in columns else "''"
    digest = 'type_description_hash' if 'type_description_hash' in columns else "''"
    for key, name, type_name, encoding, profiles, type_hash in db.execute(
            f'select id, name, type, serialization_format, {qos}, {digest} from topics'):
        count = db.execute('select count(*) from messages where topic_id=?', (key,)).fetchone()[0]
        definition = definitions.get(type_name, '')
        if not definition:                # rosbag2 before Iron keeps none: take the installed one
            try:
                definition, type_hash = definition_of(type_name), type_hash_of(type_name)
            except ValueError:
                pass
        yield Topic(name, type_name, tuple(yaml.safe_load(profiles or '') or ()), definition,
                    type_hash or '', encoding, count)


def _read(path, first, last, wanted):
    found = {}
    with closing(_connect(path)) as db:
        for name, log, raw in db.execute(
                'select topics.name, timestamp, data from messages join topics on '
                'topics.id = topic_id where timestamp between ? and ? order by timestamp',
                (first, last)):
            if wanted is None or name in wanted:
                logs, publishes, raws = found.setdefault(name, ([], [], []))
                logs.append(log)
                publishes.append(log)            # SQLite bags keep no publish time
                raws.append(bytes(raw))
    return found
