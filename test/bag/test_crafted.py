"""Files that somebody was sent: each is answered or refused in one sentence, within bounds."""
from crafted import (
    attempt, chunk_of, Crafted, messages, opcode_and, packed, START, zeros)
import pytest

GIB = 1 << 30
SMALL = ('--window-s', '2', '--block-rows', '10', '--order-max', '10')
GOOD = messages(300)
LATE = messages(300, start=2 ** 63 - 10 ** 9, step=2)


def bomb(compression, size, claimed=None, sized=True):
    """Return a chunk that holds zeros."""
    return chunk_of(b'', compression, size=size if claimed is None else claimed,
                    data=zeros(size, compression, sized), crc=0)


def long_record(length, crc=None):
    """Return a chunk whose last message claims to be longer."""
    raw = packed(GOOD) + opcode_and(bytes(60), length=length)
    return chunk_of(raw, crc=crc)


CASES = {
    'a sound one': lambda: Crafted((chunk_of(GOOD),), 300),
    **{f'{c} of {size >> 20} MiB, claims {claimed}, {sized}': (
        lambda c=c, size=size, claimed=claimed, sized=sized: Crafted(
            (chunk_of(GOOD), bomb(c, size, claimed, sized)), 300))
       for c in ('zstd', 'lz4') for size, claimed in (
           (GIB, None), (GIB, 1000), (GIB // 4, 60 << 20)) for sized in (True, False)},
    'claims 8 GiB': lambda: Crafted((chunk_of(GOOD, size=8 * GIB),), 300),
    'claims 2^63': lambda: Crafted((chunk_of(GOOD, size=2 ** 63),), 300),
    'claims none': lambda: Crafted((chunk_of(GOOD, size=0),), 300),
    'many of 60 MiB': lambda: Crafted((bomb('zstd', 60 << 20),) * 100, 0),
    'many without a summary': lambda: Crafted((bomb('zstd', 60 << 20),) * 100, 0, summary=False),
    'index repeats a chunk': lambda: Crafted((chunk_of(GOOD),), 900_000, repeat=3000),
    'index repeats, counts once': lambda: Crafted((chunk_of(GOOD),), 300, repeat=3000),
    'index far beyond': lambda: Crafted((chunk_of(GOOD),), 300, indexed={
        'chunk_start_offset': 2 ** 63}),
    'index of length 2^63': lambda: Crafted((chunk_of(GOOD),), 300, indexed={
        'chunk_length': 2 ** 63}),
    'index of length 0': lambda: Crafted((chunk_of(GOOD),), 300, indexed={'chunk_length': 0}),
    'index of other times': lambda: Crafted((chunk_of(GOOD),), 300, indexed={
        'message_start_time': START + 10 ** 12, 'message_end_time': START + 10 ** 13}),
    'index of times 2^64': lambda: Crafted((chunk_of(GOOD),), 300, indexed={
        'message_end_time': 2 ** 64 - 1}),
    'counts too many': lambda: Crafted((chunk_of(GOOD),), 3000),
    'counts 2^63': lambda: Crafted((chunk_of(GOOD),), 2 ** 63),
    'counts of no channel': lambda: Crafted((chunk_of(GOOD),), 300, counted={
        'channel_message_counts': {}}),
    'record longer than its chunk': lambda: Crafted((long_record(10_000),), 301),
    'record of 2^63': lambda: Crafted((long_record(2 ** 63),), 301),
    'record of 2^64 - 1': lambda: Crafted((long_record(2 ** 64 - 1),), 301),
    'record shorter than a message': lambda: Crafted((chunk_of(
        packed(GOOD) + opcode_and(bytes(5))),), 301),
    'undeclared channel': lambda: Crafted((chunk_of(messages(300, channel=7)),), 300),
    'times near 2^63': lambda: Crafted((chunk_of(LATE, start=0, end=2 ** 63 - 1),), 300),
    'times of 2^64': lambda: Crafted((chunk_of(messages(
        300, start=2 ** 64 - 10 ** 6, step=1), start=0, end=2 ** 63 - 1),), 300),
    'unknown compression': lambda: Crafted((chunk_of(GOOD, '', data=b'x' * 99, size=99, crc=0),),
                                           300, indexed={'compression': 'br'}),
    'a record of 2^62 outside': lambda: Crafted((chunk_of(GOOD),), 300, summary=False,
                                                extra=opcode_and(b'', 0x80, 2 ** 62)),
    'ten thousand empty records': lambda: Crafted((chunk_of(GOOD),), 300, summary=False,
                                                  extra=opcode_and(b'', 0x80) * 10_000),
    'a topic of newlines': lambda: Crafted((chunk_of(GOOD),), 300, topic='/a\n# b\n'),
    'a topic of nothing': lambda: Crafted((chunk_of(GOOD),), 300, topic=''),
}


@pytest.mark.parametrize('name', CASES)
def test_every_crafted_file_is_answered(tmp_path, name):
    """Bombs, lengths near 2^63, indexes that lie: info, export, identify and recover."""
    path = CASES[name]().write(tmp_path / 'x.mcap')
    runs = {
        'info': attempt('info', path), 'json': attempt('info', path, '--json'),
        'export': attempt('export', path, '--output', tmp_path / 'x.npz'),
        'identify': attempt('identify', path, *SMALL, '--json', tmp_path / 'x.json'),
        'recover': attempt('recover', path, '--output', tmp_path / 'sound')}
    for verb, run in runs.items():
        assert run.clear, (verb, run)
        if name != 'a sound one' and verb in ('info', 'json', 'export') and run.code == 0:
            # what is answered is the truth
            assert '300' in run.words, (verb, run)
    if runs['recover'].code == 0:
        again = attempt('info', tmp_path / 'sound')
        assert again.clear and again.code in (0, 1), again
    if name == 'a sound one':
        assert [r.code for r in runs.values()] == [0] * 5, runs


@pytest.mark.parametrize('name', ('many of 60 MiB', 'zstd of 1024 MiB, claims None, True'))
def test_info_takes_little_memory(tmp_path, name):
    """Below 300 MB, this process included, for any file."""
    path = CASES[name]().write(tmp_path / 'x.mcap')
    before = attempt('info', CASES['a sound one']().write(tmp_path / 'y.mcap')).memory_mb
    assert attempt('info', path).memory_mb < before + 230


def test_a_larger_chunk_is_read_when_asked_for(tmp_path):
    """A chunk of 80 MiB is refused with the option that reads it, and then read."""
    records = packed([*GOOD]) + opcode_and(bytes(80 << 20), 0x80)
    path = Crafted((chunk_of(records),), 300).write(tmp_path / 'x.mcap')
    refused = attempt('info', path)
    assert refused.code == 2 and '--largest-chunk-mib' in refused.words, refused
    assert attempt('recover', path, '--output', tmp_path / 'no').code != 0
    done = attempt('recover', path, '--output', tmp_path / 'sound', '--largest-chunk-mib', '100')
    assert done.code == 0 and '300 messages saved' in done.words, done
    assert attempt('info', tmp_path / 'sound').code == 0
    assert attempt('recover', path, '--largest-chunk-mib', 'nan').code == 2
