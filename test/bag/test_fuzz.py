"""
Files, bytes, YAML and parameters drawn at random: an answer that is right, or one sentence.

Seeded, half a minute in `make test`. By hand, so many seconds with other seeds:
SSI_ROS_FUZZ_S=3600 SSI_ROS_FUZZ_SEED=1 python -m pytest test/bag/test_fuzz.py
"""
from contextlib import contextmanager
import os
import resource
import shutil
import signal
import struct
import time

from crafted import ACCEL, chunk_of, Crafted, messages, sqlite_bag, START
import numpy as np
import pytest
from ssi_ros.bag import (
    BagWriter, encode_accel, field_reader, open_bag, read_channels, recover)
from ssi_ros.bag.layout import ROOT
from ssi_ros.bag.names import check_topic, split_type
from ssi_ros.bag.schema import numeric_fields
from ssi_ros.bag.summary import as_text, summarise
from ssi_ros.effects import load_configuration
from ssi_ros.identify import Identification
from ssi_ros.identify.stamped import identify_stamped
from ssi_ros.plain_yaml import load_plain
from ssi_ros.quantity import shown
import yaml

hypothesis = pytest.importorskip('hypothesis', reason='hypothesis is not installed')
st = pytest.importorskip('hypothesis.strategies')
FUZZ_S = float(os.environ.get('SSI_ROS_FUZZ_S', '0'))
SEED = int(os.environ.get('SSI_ROS_FUZZ_SEED', '0'))
TESTS = 7                          # that share the time
MEMORY = 1 << 30
# 10 s of the processor; on a busy machine these may take a minute
TIMERS = ((signal.ITIMER_PROF, signal.SIGPROF, 10.0), (signal.ITIMER_REAL, signal.SIGALRM, 60.0))
COUNT = 300
VALUES = np.sin(np.arange(COUNT))
STAMPS = START + np.arange(COUNT) * 10_000_000


class TooLongError(BaseException):
    """What takes too long; no handler of the package may catch it."""


@contextmanager
def bounded():
    """Allow 10 s of the processor, 1 GB more than now, and errors that were meant for a user."""
    with open('/proc/self/statm') as f:
        size = int(f.read().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)

    def end(*_):
        raise TooLongError()

    outer = [(timer, number, signal.signal(number, end), signal.setitimer(timer, limit_s)[0])
             for timer, number, limit_s in TIMERS]
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, before[1]))
    try:
        yield
    except (ValueError, OSError) as error:
        # ValueError has children that nobody meant to say anything to a user with
        assert type(error) is ValueError or isinstance(error, OSError), repr(error)
        # names out of a file are escaped where the sentence is printed
        assert str(error) and len(shown(error).splitlines()) == 1, error
    except TooLongError:
        raise AssertionError('it takes too long') from None
    finally:
        for timer, number, handler, rest_s in outer:
            signal.setitimer(timer, rest_s)
            signal.signal(number, handler)
        resource.setrlimit(resource.RLIMIT_AS, before)


def fuzz(check, *strategies, examples):
    """Try examples of strategies, seeded; by hand, round after round until the time is over."""
    until, rounds = time.monotonic() + FUZZ_S / TESTS, 0
    phases = [hypothesis.Phase.generate, hypothesis.Phase.shrink][:1 + bool(FUZZ_S)]
    while not rounds or time.monotonic() < until:
        @hypothesis.seed(SEED + rounds)
        @hypothesis.settings(max_examples=examples, deadline=None, database=None, phases=phases,
                             suppress_health_check=list(hypothesis.HealthCheck))
        @hypothesis.given(st.tuples(*strategies))
        def run(case):
            with bounded():
                check(*case)
        run()
        rounds += 1


NUMBERS = st.sampled_from((0, 1, 7, 255, 2 ** 16, 2 ** 31 - 1, 2 ** 32 - 1, 2 ** 40, 2 ** 62,
                           2 ** 63 - 1, 2 ** 63, 2 ** 64 - 1)) | st.integers(0, 2 ** 64 - 1)
PLACES = st.floats(0.0, 1.0, exclude_max=True)
MUTATIONS = st.lists(st.tuples(
    st.sampled_from(('bit', 'bytes', 'number', 'cut', 'insert', 'repeat', 'end')), PLACES,
    NUMBERS, st.integers(1, 64)), min_size=1, max_size=5)


def mutated(data, mutations):
    """Return bytes with bits flipped, numbers set, parts cut out, inserted or doubled."""
    data = bytearray(data)
    for kind, place, number, size in mutations:
        at = int(place * len(data))
        if kind == 'bit' and data:
            data[at] ^= 1 << number % 8
        elif kind == 'bytes':
            data[at:at + size] = (number % 256).to_bytes(1, 'little') * len(data[at:at + size])
        elif kind == 'number':
            data[at:at + 8] = number.to_bytes(8, 'little')[:len(data) - at]
        elif kind == 'cut':
            del data[at:at + size]
        elif kind == 'insert':
            data[at:at] = number.to_bytes(8, 'little') * (size // 8)
        elif kind == 'repeat':
            data[at:at] = data[at:at + size * 40]
        elif number % 4 == 0:
            del data[at:]
    return bytes(data)


@pytest.fixture(scope='module')
def sound(tmp_path_factory):
    """Return the bytes of sound files: MCAP of three compressions with checksums, and SQLite."""
    folder, found = tmp_path_factory.mktemp('sound'), {}
    raws = encode_accel(STAMPS, VALUES, 'a')
    for compression in ('zstd', 'lz4', 'none'):
        with BagWriter(folder / compression, compression=compression, flush_s=1e9) as bag:
            bag.add_topic('/a', ACCEL)
            for i, (stamp, raw) in enumerate(zip(STAMPS.tolist(), raws)):
                bag.write('/a', raw, stamp, stamp)
                if i % 100 == 99:
                    bag._seal()
        found[compression] = (folder / compression / f'{compression}_0.mcap').read_bytes()
    path = folder / 'x.db3'
    sqlite_bag(path, STAMPS, raws)
    found['sqlite'] = path.read_bytes()
    return found


def is_true(recording, complete):
    """Check that all samples are of the original; of one that is complete, that none lacks."""
    for stamps, values in zip(recording.stamps_ns, recording.values):
        places = (stamps - START) // 10_000_000
        assert ((places >= 0) & (places < COUNT)).all()
        assert np.array_equal(VALUES[places], values)
        assert not complete or np.array_equal(places, np.arange(COUNT))


def test_files_with_checksums_are_read_right_or_refused(sound, tmp_path):
    """Bytes changed anywhere: what `info` and `export` answer, and `recover` saves, is true."""
    path, out = tmp_path / 'x.mcap', tmp_path / 'out'

    def check(compression, mutations):
        path.write_bytes(mutated(sound[compression], mutations))
        shutil.rmtree(out, ignore_errors=True)
        with bounded():
            assert '300 messages' in as_text(summarise(open_bag(path)))
        with bounded():
            is_true(read_channels(path), complete=True)
        report = recover(path, out)
        assert report.bytes_dropped <= report.bytes_read
        # what is salvaged of a chunk that is cut has no checksum
        if any(report.saved.values()) and not report.salvaged:
            is_true(read_channels(out), complete=False)

    fuzz(check, st.sampled_from(('zstd', 'lz4', 'none')), MUTATIONS, examples=120)


def test_files_that_lie_are_answered(tmp_path):
    """Sizes, times, offsets and counts of any size in a file that is well formed."""
    path, out = tmp_path / 'x.mcap', tmp_path / 'out'
    good = messages(30)

    def check(chunk, index, counts, count, repeat, summary, topic, kind):
        one = chunk_of(good)
        for name, value in chunk.items():
            setattr(one, name, value)
        try:
            Crafted((one, chunk_of(good)), count, repeat, indexed=index, counted=counts,
                    summary=summary, topic=topic, type=kind).write(path)
        except (struct.error, UnicodeEncodeError):     # the format has no room for it
            return
        shutil.rmtree(out, ignore_errors=True)
        with bounded():
            summary = summarise(open_bag(path))
            assert summary['messages'] in (0, 30, 60) or index or counts
            as_text(summary)
        with bounded():
            read_channels(path)
        recover(path, out)
        open_bag(out)

    names = ('message_start_time', 'message_end_time', 'uncompressed_size')
    fields = (*names, 'chunk_length', 'chunk_start_offset', 'compressed_size')
    totals = ('message_count', 'chunk_count', 'message_start_time')
    fuzz(check, st.dictionaries(st.sampled_from((*names, 'uncompressed_crc')), NUMBERS,
                                max_size=2),
         st.dictionaries(st.sampled_from(fields), NUMBERS, max_size=2),
         st.dictionaries(st.sampled_from(totals), NUMBERS, max_size=1),
         st.just(60) | NUMBERS, st.sampled_from((1, 1, 1, 2, 50)), st.booleans(),
         st.just('/a') | st.text(max_size=9), st.just(ACCEL) | st.text(max_size=9), examples=80)


def test_sqlite_is_read_right_or_refused(sound, tmp_path):
    """Pages with bytes changed; SQLite keeps no checksums, so numbers in a message may change."""
    path = tmp_path / 'x.db3'

    def check(mutations):
        path.write_bytes(mutated(sound['sqlite'], mutations))
        with bounded():
            as_text(summarise(open_bag(path)))
        read_channels(path)

    fuzz(check, MUTATIONS, examples=150)


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
    | st.sampled_from(('/a', 'x.mcap', '../x.mcap', '/dev/zero', 'cdr', 'file', ROOT)),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(
        st.text(max_size=5) | st.sampled_from((
            'name', 'type', 'topic_metadata', 'offered_qos_profiles', 'depth', 'reliability',
            'rate_hz', 'sensors', 'arrays', 'hub', 'mass_kg', 'array', 'effects')),
        inner, max_size=4), max_leaves=12)
KEYS = ('version', 'storage_identifier', 'duration', 'starting_time', 'message_count',
        'topics_with_message_count', 'compression_format', 'compression_mode',
        'relative_file_paths', 'files', 'custom_data', 'ros_distro')


def test_metadata_is_believed_only_where_it_is_right(sound, tmp_path):
    """metadata.yaml of any types: the samples of the file, or a sentence."""
    (tmp_path / 'x.mcap').write_bytes(sound['zstd'])

    def check(changes, mutations):
        text = yaml.safe_dump({ROOT: {'version': 9, 'relative_file_paths': ['x.mcap'],
                                      **changes}})
        (tmp_path / 'metadata.yaml').write_bytes(mutated(text.encode(), mutations))
        bag = open_bag(tmp_path)
        as_text(summarise(bag))
        is_true(read_channels(bag), complete=True)

    fuzz(check, st.dictionaries(st.sampled_from(KEYS), PLAIN, max_size=4),
         st.just([]) | MUTATIONS, examples=150)


TYPES = st.sampled_from(('bool', 'byte', 'int8', 'uint16', 'int32', 'uint64', 'float32', 'float64',
                         'string', 'wstring', 'string<=5', 'A', 'B', 'C', 'Header', 'q/Gone',
                         'builtin_interfaces/Time'))
ENDS = st.sampled_from(('', '', '', '[3]', '[]', '[<=4]', '[0]', '[1000000000]', ' =', ' = 1'))
MEMBERS = st.lists(st.tuples(TYPES, ENDS, st.sampled_from('abcdef')), max_size=6).map(
    lambda rows: '\n'.join(f'{t}{e if e[:1] == "[" else ""} {n}{e if "=" in e[:2] else ""}'
                           for t, e, n in rows))


def test_any_message_of_any_type_is_read_or_refused():
    """Definitions of a grammar and of random text, messages of random bytes."""
    def check(bodies, bytes_, extra, garbage):
        text = ('\n' + '=' * 80 + '\n').join(
            [bodies[0], *(f'MSG: p/{n}\n{b}' for n, b in zip('ABC', bodies[1:]))])
        text = garbage if garbage else text
        fields = ()
        with bounded():
            fields = numeric_fields('p/msg/Root', text)
        for field in (*fields[:6], extra):
            with bounded():
                reader = field_reader('p/msg/Root', field, text)
                for head in (b'\0\1\0\0', b'\0\0\0\0', b''):
                    with bounded():
                        stamp, value = reader.read(head + bytes_)
                        assert isinstance(value, float)
                        many = reader.read_many([head + bytes_] * 3)[1]
                        assert np.array_equal(many, [value] * 3, equal_nan=True)

    fuzz(check, st.tuples(*[MEMBERS] * 4), st.binary(max_size=200),
         st.text('abc.[]019', max_size=12), st.just('') | st.text(max_size=200), examples=200)


def test_yaml_and_names_of_anybody(tmp_path):
    """YAML of random text and of random data, as a spacecraft; names of topics and types."""
    path = tmp_path / 'x.yaml'

    def check(text, plain, name):
        with bounded():
            load_plain(text)
        for content in (text.encode('utf-8', 'replace'), yaml.safe_dump(plain).encode()):
            path.write_bytes(content)
            with bounded():
                load_configuration(path)
        with bounded():
            check_topic(name)
            assert name.isascii() and '//' not in name and ' ' not in name
        with bounded():
            package, kind = split_type(name)
            assert package.isidentifier() and kind.isidentifier()

    fuzz(check, st.text('ab:-[]{}&*!?|>\n \'"#%@,0.~', max_size=60), PLAIN,
         st.text('/_aA9~ {}', max_size=12) | st.text(max_size=12), examples=250)


SPANS = st.lists(st.tuples(
    st.sampled_from(('even', 'reversed', 'equal', 'random', 'shuffled')),
    st.integers(1, 400), st.sampled_from((0, 10 ** 3, 10 ** 7, 10 ** 9, 10 ** 11, 7 * 10 ** 11)),
    st.sampled_from((0, START, START + 10 ** 10, 2 ** 62, 2 ** 63 - 1, -5)) | NUMBERS),
    min_size=1, max_size=4)


def test_stamps_of_any_order_are_answered():
    """Spans of even, reversed, equal, random and shuffled stamps one behind the other."""
    settings_ = Identification(window_s=2.0, hop_s=1.0, block_rows=10, order_max=8)

    def check(spans, rate_hz, lateness_s, number):
        rng, parts = np.random.default_rng(number), []
        for kind, count, step, start in spans:
            stamps = min(start, 2 ** 62) + np.arange(count) * step
            parts.append({'even': stamps, 'reversed': stamps[::-1], 'equal': stamps * 0 + start
                          if start < 2 ** 63 else stamps, 'shuffled': rng.permutation(stamps),
                          'random': rng.integers(0, 2 ** 63 - 1, count)}[kind].astype(np.int64))
        stamps = np.concatenate(parts)
        windows, grid = identify_stamped(
            ('a', 'b'), [stamps, stamps[::2]], [rng.standard_normal(len(stamps)),
                                                rng.standard_normal(len(stamps[::2]))],
            settings_, arrivals_ns=[np.arange(len(stamps)), 2 * np.arange(len(stamps[::2]))],
            rate_hz=rate_hz, lateness_s=lateness_s)
        assert windows and all(c.placed <= c.received for c in grid.counts)

    fuzz(check, SPANS, st.sampled_from((0.0, 0.0, 1e-3, 100.0, 1e6)),
         st.sampled_from((0.0, 1.0, 60.0)), st.integers(0, 99), examples=40)
