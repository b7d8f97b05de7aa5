"""Files that no recorder writes, and a verb run on them in a process with bounds of its own."""
from contextlib import suppress
from dataclasses import dataclass
import os
import resource
import signal
import sqlite3
import sys
import tempfile
import time
import traceback
import zlib

import lz4.frame
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, Message, Schema, Statistics)
from mcap.writer import MCAP0_MAGIC
import numpy as np
from ssi_ros.bag import definition_of, encode_accel
from ssi_ros.cli.main import main
import zstandard

ACCEL = 'geometry_msgs/msg/AccelStamped'
START = 1_700_000_000_000_000_000
# of the processor; on a busy machine it may take minutes
SECONDS, LONGEST_S, MEMORY = 10, 300, 1 << 30


@dataclass(frozen=True)
class Outcome:
    """How a verb ended: exit code (or minus the signal), words, time [s], largest memory [MB]."""

    code: int
    words: str
    seconds: float
    memory_mb: float

    @property
    def clear(self):
        """Whether it is an answer, or one sentence."""
        lines = [w for w in self.words.splitlines() if w.startswith('ssi_ros ')]
        return (self.code in (0, 1, 2) and 'Traceback' not in self.words
                and (self.code != 2 or len(lines) == 1 or 'usage:' in self.words))


def attempt(*words):
    """Run a verb in a child that may take 10 s of the processor and 1 GB more than this one."""
    with tempfile.TemporaryFile() as out:
        began = time.monotonic()
        child = os.fork()
        if not child:
            _in_child([str(w) for w in words], out)
        _, status, usage = os.wait4(child, 0)
        seconds = time.monotonic() - began
        out.seek(0)
        return Outcome(os.waitstatus_to_exitcode(status), out.read().decode(errors='replace'),
                       seconds, usage.ru_maxrss / 1024)


def _in_child(words, out):
    code = 99
    try:
        os.dup2(out.fileno(), 1)
        os.dup2(out.fileno(), 2)
        sys.stdout, sys.stderr = open(1, 'w', closefd=False), open(2, 'w', closefd=False)
        with open('/proc/self/statm') as f:
            size = int(f.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, size + MEMORY))
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        signal.alarm(LONGEST_S)
        code = main(words)
    except SystemExit as end:
        code = end.code
    except BaseException:               # whatever it is, it is what the test is to find
        traceback.print_exc()
    finally:
        with suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 98)


def packed(records):
    """Return the bytes of records of the mcap package."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()


def messages(count, channel=1, start=START, step=10_000_000, name='a'):
    """Return messages of AccelStamped in MCAP."""
    stamps = start + np.arange(count, dtype=object) * step
    header = np.clip(stamps.astype(float), 0, 2e18).astype(np.int64)
    return [Message(channel, int(s), raw, int(s), i) for i, (s, raw) in enumerate(
        zip(stamps, encode_accel(header, np.sin(np.arange(count)), name)))]


def chunk_of(records, compression='zstd', size=None, data=None, crc=None, start=START, end=None):
    """Return a chunk of records, or with sizes and data of one's own."""
    raw = records if isinstance(records, bytes) else packed(records)
    if data is None:
        data = {'zstd': zstandard.ZstdCompressor().compress, 'lz4': lz4.frame.compress,
                '': bytes}[compression](raw)
    return Chunk(compression=compression, data=data, message_start_time=start,
                 message_end_time=start + 10 ** 12 if end is None else end,
                 uncompressed_crc=zlib.crc32(raw) if crc is None else crc,
                 uncompressed_size=len(raw) if size is None else size)


def sqlite_bag(path, stamps, raws, script=()):
    """Write messages of one topic to a SQLite bag, then run statements on it."""
    with sqlite3.connect(path) as db:
        db.execute('create table topics(id integer primary key, name text, type text, '
                   'serialization_format text, offered_qos_profiles text)')
        db.execute('create table messages(id integer primary key, topic_id integer, '
                   'timestamp integer, data blob)')
        db.execute('insert into topics values (1, ?, ?, ?, ?)', ('/a', ACCEL, 'cdr', ''))
        db.executemany('insert into messages(topic_id, timestamp, data) values (1, ?, ?)',
                       zip(stamps.tolist(), raws))
        for statement in script:
            db.execute(statement)
    db.close()


@dataclass
class Crafted:
    """An MCAP file of which every part can be given."""

    chunks: tuple = ()
    count: int = None
    repeat: int = 1                       # entries of the index a chunk
    schema: bytes = None
    type: str = ACCEL  # noqa: A003
    topic: str = '/a'
    indexed: dict = None                  # fields of the chunk indexes
    counted: dict = None                  # fields of the statistics
    summary: bool = True
    extra: bytes = b''

    def write(self, path):
        """Write the file."""
        schema = Schema(id=1, name=self.type, encoding='ros2msg',
                        data=definition_of(ACCEL).encode() if self.schema is None
                        else self.schema)
        channel = Channel(id=1, topic=self.topic, message_encoding='cdr', schema_id=1,
                          metadata={})
        data = MCAP0_MAGIC + packed([Header('ros2', 'crafted'), schema, channel]) + self.extra
        indexes = []
        for chunk in self.chunks:
            whole = packed([chunk])
            fields = {'chunk_length': len(whole), 'chunk_start_offset': len(data),
                      'compression': chunk.compression, 'compressed_size': len(chunk.data),
                      'message_end_time': chunk.message_end_time, 'message_index_offsets': {},
                      'message_index_length': 0, 'message_start_time': chunk.message_start_time,
                      'uncompressed_size': chunk.uncompressed_size, **(self.indexed or {})}
            indexes += [ChunkIndex(**fields)] * self.repeat
            data += whole
        data += packed([DataEnd(0)])
        if self.summary:
            count = self.count if self.count is not None else 0
            statistics = Statistics(**{
                'attachment_count': 0, 'channel_count': 1, 'channel_message_counts': {1: count},
                'chunk_count': len(indexes), 'message_count': count, 'metadata_count': 0,
                'message_start_time': START, 'message_end_time': START, 'schema_count': 1,
                **(self.counted or {})})
            start = len(data)
            data += packed([schema, channel, statistics, *indexes, Footer(start, 0, 0)])
        else:
            data += packed([Footer(0, 0, 0)])
        path.write_bytes(data + MCAP0_MAGIC)
        return path


def opcode_and(body, opcode=Opcode.MESSAGE, length=None):
    """Return a record with a length of one's own."""
    return bytes([opcode]) + (len(body) if length is None else length).to_bytes(8, 'little') + body


def zeros(size, compression='zstd', sized=True):
    """Return so many zeros compressed, in little memory."""
    block, out = bytes(1 << 20), []
    if compression == 'zstd':
        packer = zstandard.ZstdCompressor(write_content_size=sized).compressobj(
            size=size if sized else -1)
        out = [packer.compress(block) for _ in range(size >> 20)] + [packer.flush()]
        return b''.join(out)
    packer = lz4.frame.LZ4FrameCompressor()
    out = [packer.begin(source_size=size if sized else 0)]
    out += [packer.compress(block) for _ in range(size >> 20)] + [packer.flush()]
    return b''.join(out)
