"""metadata.yaml, SQLite files, definitions of types and special files that somebody was sent."""
import os
import sqlite3

from crafted import ACCEL, attempt, chunk_of, Crafted, messages, sqlite_bag, START
import numpy as np
import pytest
from ssi_ros.bag import definition_of, encode_accel, open_bag, read_channels
from ssi_ros.bag.layout import ROOT
from ssi_ros.bag.schema import numeric_fields, parse
from ssi_ros.plain_yaml import load_plain
import yaml

WRONG = (None, 3, -1.5, float('nan'), 'word', '', [], [[]], {}, {'a': 1}, [None], ['x.mcap', 3],
         True, '2001-01-01')
DEFINITION = definition_of(ACCEL)


@pytest.fixture
def folder(tmp_path):
    """Return a folder with one sound file and a sound metadata.yaml."""
    Crafted((chunk_of(messages(300)),), 300).write(tmp_path / 'x.mcap')
    save(tmp_path, {})
    return tmp_path


def save(folder, changes):
    """Write metadata.yaml with some keys changed."""
    topic = {'topic_metadata': {'name': '/a', 'type': ACCEL, 'serialization_format': 'cdr',
                                'offered_qos_profiles': []}, 'message_count': 300}
    (folder / 'metadata.yaml').write_text(yaml.safe_dump({ROOT: {
        'version': 9, 'storage_identifier': 'mcap', 'relative_file_paths': ['x.mcap'],
        'topics_with_message_count': [topic], 'compression_mode': '', **changes}}))


def check(folder, *allowed):
    """Run info and export; each is clear, and ends with one of the codes that are allowed."""
    for verb in (('info', folder, '--json'), ('export', folder, '--output', folder / 'x.csv')):
        run = attempt(*verb)
        assert run.clear and run.code in allowed, run
        (folder / 'x.csv').unlink(missing_ok=True)
    return run


@pytest.mark.parametrize('key', ('relative_file_paths', 'topics_with_message_count',
                                 'custom_data', 'compression_mode', 'version'))
def test_any_type_in_metadata_is_answered(folder, key):
    """Each key with every wrong type: the file alone is read, with a warning, or it is refused."""
    for value in WRONG:
        save(folder, {key: value})
        try:
            assert open_bag(folder).message_count == 300
        except ValueError as error:
            assert len(str(error).splitlines()) == 1
    save(folder, {key: [float('nan')]})
    assert 'warning' in check(folder, 0).words or key == 'version'


@pytest.mark.parametrize('key', ('name', 'offered_qos_profiles', 'type_description_hash'))
def test_any_type_in_a_topic_is_answered(folder, key):
    """Names, qualities of service and hashes of any type."""
    for value in (*WRONG, '- {depth: .nan}', '[' * 999, '&a [*a]', [{'depth': {'a': []}}]):
        topic = {'topic_metadata': {'name': '/a', 'type': ACCEL, key: value}}
        save(folder, {'topics_with_message_count': [topic, value]})
        assert open_bag(folder).message_count == 300
    check(folder, 0)


def bomb():
    """Return YAML of ten levels of aliases, each ten times the one before."""
    lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x, x]']
    lines += [f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 10)}]' for i in range(1, 10)]
    return '\n'.join(lines)


@pytest.mark.parametrize('text, words', (
    (bomb(), 'values'), ('[' * 100_000, 'deeper'), ('- ' * 5000, 'deeper'), ('&a [*a]', 'alias'),
    ('a: *b', 'not YAML'), ('{a: b', 'not YAML'), ('!!python/object/apply:os.system [x]', 'YAML'),
    ('? [a]\n: b', 'YAML'), ('a: 2001-13-77', 'plain YAML'), ('x' * (5 << 20), 'characters'),
    ('9' * 5000, 'YAML'), ('\0', 'YAML')))
def test_yaml_is_bounded(folder, text, words):
    """Aliases, depth, size, tags, keys and numbers: one sentence, and a bag reads without it."""
    if words != 'YAML' or '!!' in text:
        with pytest.raises(ValueError, match=words) as error:
            load_plain(text)
        assert len(str(error.value).splitlines()) == 1
    (folder / 'metadata.yaml').write_text(text)
    assert 'warning' in check(folder, 0).words


def test_aliases_that_writers_use_are_read():
    """The same mapping twice is an alias in what the yaml package writes."""
    shared = {'sec': 1, 'nsec': 2}
    assert load_plain(yaml.safe_dump([shared, shared])) == [shared, shared]


@pytest.mark.parametrize('name', ('../x.mcap', '/etc/passwd', 'a/../../x.mcap', '/dev/zero'))
def test_paths_out_of_the_folder_are_refused(folder, name):
    """A file beside the bag's folder is not the bag's."""
    save(folder, {'relative_file_paths': [name]})
    assert 'outside of the folder' in check(folder, 2).words


def test_pipes_and_devices_are_refused(folder):
    """A pipe as a split, as metadata.yaml, as the bag itself, and a link to a device."""
    os.mkfifo(folder / 'pipe.mcap')
    save(folder, {'relative_file_paths': ['pipe.mcap']})
    assert 'not a regular file' in check(folder, 2).words
    for verb in (('info',), ('recover', '--output', folder / 'new'), ('identify',)):
        run = attempt(verb[0], folder / 'pipe.mcap', *verb[1:])
        assert run.code == 2 and run.clear and 'regular' in run.words, run
    (folder / 'metadata.yaml').unlink()
    os.mkfifo(folder / 'metadata.yaml')
    (folder / 'pipe.mcap').unlink()
    check(folder, 0)
    (folder / 'zero.mcap').symlink_to('/dev/zero')
    assert 'regular' in check(folder, 2).words
    assert attempt('info', '/dev/zero').code == 2


def sqlite(path, *script):
    """Make a SQLite bag of 300 messages, then run statements on it."""
    path.unlink(missing_ok=True)
    stamps = START + np.arange(300) * 10_000_000
    sqlite_bag(path, stamps, encode_accel(stamps, np.sin(np.arange(300)), 'a'), script)


FOREVER = ('create view messages as with recursive r(n) as (select 1 union all select n + 1 from '
           'r) select n as id, 1 as topic_id, n as timestamp, zeroblob(40) as data from r')
SCRIPTS = {
    'sound': ((), 0),
    'an infinite view': (('drop table messages', FOREVER), 2),
    'text for a time': (("update messages set timestamp='soon' where id=7",), 2),
    'null for a time': (('update messages set timestamp=null where id=7',), 2),
    'a real time': (('update messages set timestamp=1.5 where id=7',), 2),
    'a negative time': (('update messages set timestamp=-5 where id=7',), 2),
    'null data': (('update messages set data=null where id=7',), 2),
    'text data': (("update messages set data='words' where id=7",), 2),
    'short data': (("update messages set data=x'00' where id=7",), 2),
    # before Python 3.11 SQLite has no limit that can be set, and the memory suffices
    'huge data': (('update messages set data=zeroblob(90000000) where id=7',),
                  2 if hasattr(sqlite3.Connection, 'setlimit') else 0),
    'no topics': (('drop table topics',), 2),
    'a virtual table': (('drop table messages', 'create virtual table messages using '
                         'fts5(topic_id, timestamp, data)'), 2),
    'no name': (('update topics set name=null',), 2),
    'a name of bytes': (("update topics set name=x'ff00'",), 2),
    'a type of any kind': (("update topics set type='../../etc/passwd'",), 2),
    'bad quality of service': (("update topics set offered_qos_profiles='[[['",), 0),
    'a deep quality of service': ((f"update topics set offered_qos_profiles='{'[' * 9999}'",), 0),
}


@pytest.mark.parametrize('name', SCRIPTS)
def test_sqlite_of_others_is_answered(tmp_path, name):
    """Views, values of other types, huge and missing ones."""
    script, code = SCRIPTS[name]
    sqlite(tmp_path / 'x.db3', *script)
    run = attempt('export', tmp_path / 'x.db3', '--output', tmp_path / 'x.csv')
    assert run.clear and run.code == code, run
    info = attempt('info', tmp_path / 'x.db3')
    assert info.clear, info


def test_corrupt_pages_of_sqlite_are_answered(tmp_path, rng):
    """Bytes overwritten anywhere: the whole of it, or a sentence."""
    sqlite(tmp_path / 'x.db3')
    data = (tmp_path / 'x.db3').read_bytes()
    for i in range(60):
        bad = bytearray(data)
        for at in rng.integers(100 if i % 2 else 0, len(data), 1 + i):
            bad[at] = rng.integers(256)
        (tmp_path / 'y.db3').write_bytes(bad)
        try:
            read_channels(tmp_path / 'y.db3')
        except ValueError as error:
            assert len(str(error).splitlines()) == 1, error
    (tmp_path / 'y.db3').write_bytes(data[:len(data) // 2])
    assert attempt('info', tmp_path / 'y.db3').code == 2


def types(body):
    """Return a definition of numbered types, from 0 on; `body(i)` is the text of one."""
    return ('\n' + '=' * 80 + '\n').join(
        (f'MSG: p/T{i}\n' if i else '') + body(i) for i in range(40))


DEFINITIONS = {
    'cyclic': ('p/msg/A', 'A a\nfloat64 x\n', 'cyclic'),
    'cyclic by another': ('p/msg/A', f'B b\n{"=" * 80}\nMSG: p/B\nA a\n', 'cyclic'),
    'deep': ('p/msg/T0', types(lambda i: f'T{i + 1} t' if i < 39 else 'float64 x'), 'deeper'),
    'very many': ('p/msg/A', 'float64 x\n' + ''.join(
        f'{"=" * 80}\nMSG: p/B{i}\nfloat64 x\n' for i in range(1500)), 'types'),
    'very long': ('p/msg/A', 'float64 x\n' * 200_000, 'characters'),
    'no elements': ('p/msg/A', 'uint8[0] a\nfloat64 x\n', 'elements'),
    'too many elements': ('p/msg/A', f'uint8[{"9" * 5000}] a\nfloat64 x\n', 'elements'),
}


@pytest.mark.parametrize('name', DEFINITIONS)
def test_definitions_are_bounded(name):
    """Types that hold themselves, depth, number, length: one sentence."""
    type_name, text, words = DEFINITIONS[name]
    with pytest.raises(ValueError, match=words) as error:
        parse(type_name, text)
    assert len(str(error.value)) < 300


def test_a_fan_out_of_twenty_is_listed_soon():
    """Twenty members a type, ten types deep, with a number only at the end or nowhere."""
    def body(i, leaf):
        return '\n'.join(f'T{i + 1} m{k}' for k in range(20)) if i < 10 else leaf
    assert len(numeric_fields('p/msg/T0', types(lambda i: body(i, 'float64 x')))) == 40
    assert numeric_fields('p/msg/T0', types(lambda i: body(i, 'string x'))) == ()


@pytest.mark.parametrize('schema', (
    'P[1000000000] p\nfloat64 x\n' + '=' * 80 + '\nMSG: q/P\nstring s\nfloat64[1000000000] y\n',
    'P[] p\nfloat64 x\n' + '=' * 80 + '\nMSG: q/P\nuint8[2147483647] y\n',
    'string[2147483647] s\nfloat64 x\n', 'uint8[2147483647] s\nfloat64 x\n',
    'float64 y\n' * 50_000 + 'float64 x\n', '', '\xff', '=' * 80, 'module p { struct A {}; };'))
def test_arrays_before_a_field_are_bounded(tmp_path, schema):
    """A thousand million elements before a field, in a message of 100 bytes."""
    path = Crafted((chunk_of(messages(300)),), 300, schema=schema.encode('latin1'),
                   type='q/msg/A').write(tmp_path / 'x.mcap')
    runs = [attempt('export', path, '--channel', '/a:x', '--output', tmp_path / 'x.npz'),
            attempt('export', path, '--output', tmp_path / 'y.npz'), attempt('info', path)]
    assert all(r.clear for r in runs) and [r.code for r in runs[:2]] == [2, 2], runs
