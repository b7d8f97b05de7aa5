"""
One MCAP file, written chunk by chunk.

The records are those of the mcap package. Its Writer is not used because it takes messages one
at a time (10 us each), cannot compress beside the caller, and leaves half a chunk behind when the
disk is full. Here a chunk comes ready made, and a write that fails is taken back, so that the
file always ends with a whole record.
"""
from dataclasses import dataclass
import os
import struct
import zlib

import lz4.frame
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, Metadata,
                          MetadataIndex, Schema, Statistics, SummaryOffset)
from mcap.writer import MCAP0_MAGIC
import zstandard

MESSAGE_HEAD = struct.Struct('<BQHIQQ')     # opcode, length, channel, sequence, log, publish
CHUNK_BYTES = 1 << 20
# Level 1 packs accelerometer messages within 10 % of level 3 at half its CPU time.
_ZSTD_LEVEL = 1
COMPRESSIONS = ('zstd', 'lz4', 'none')


@dataclass(frozen=True)
class Block:
    """
    The messages of one chunk.

    Attributes
    ----------
    records : bytes-like
        Message records one behind the other.
    index : dict
        Channel id -> bytes of little-endian uint64 pairs (log time [ns], offset in `records`).
    start_ns, end_ns : int
        Smallest and largest log time [ns].

    """

    records: bytes
    index: dict
    start_ns: int
    end_ns: int

    def counts(self):
        """Return the number of messages of each channel id."""
        return {channel: len(pairs) // 16 for channel, pairs in self.index.items()}


def pack(records, compression):
    """Return the records of a chunk compressed."""
    if compression == 'zstd':
        return zstandard.ZstdCompressor(level=_ZSTD_LEVEL).compress(records)
    if compression == 'lz4':
        return lz4.frame.compress(records)
    return bytes(records)


def _bytes_of(*records):
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()


class McapFile:
    """
    Write one MCAP file of profile ros2; `finish` adds the summary and closes it.

    Parameters
    ----------
    path : Path
        File to make; it must not exist.
    compression : str
        'zstd', 'lz4' or 'none'.

    """

    def __init__(self, path, compression='zstd'):
        if compression not in COMPRESSIONS:
            raise ValueError(f'compression={compression!r} must be one of '
                             + ', '.join(COMPRESSIONS))
        self.path, self.size = path, 0
        self.start_ns, self.end_ns, self.counts = None, None, {}
        self._compression = compression
        self._schemas, self._channels = {}, {}
        self._chunk_indices, self._metadata_indices = [], []
        self._crc = 0
        self._file = open(path, 'xb', buffering=0)
        try:
            self._append(MCAP0_MAGIC + _bytes_of(Header('ros2', 'ssi_ros')))
        except OSError:
            self._file.close()
            path.unlink()
            raise

    def _append(self, data):
        """Write all of the data or nothing; return the offset at which it begins."""
        at, left = self.size, memoryview(data)
        try:
            while left:
                left = left[self._file.write(left):]
        except OSError:
            self._file.truncate(at)
            self._file.seek(at)
            raise
        self.size += len(data)
        self._crc = zlib.crc32(data, self._crc)
        return at

    def add_schema(self, name, text):
        """Add the definition of a type once; return its id."""
        if name not in self._schemas:
            schema = Schema(id=len(self._schemas) + 1, name=name, encoding='ros2msg',
                            data=text.encode())
            self._append(_bytes_of(schema))
            self._schemas[name] = schema
        return self._schemas[name].id

    def add_channel(self, channel_id, topic, schema_id, metadata, encoding='cdr'):
        """Add a channel under the given id."""
        channel = Channel(id=channel_id, topic=topic, message_encoding=encoding,
                          schema_id=schema_id, metadata=metadata)
        self._append(_bytes_of(channel))
        self._channels[channel_id] = channel

    def add_metadata(self, name, mapping):
        """Add a metadata record: words to words."""
        data = _bytes_of(Metadata(name=name, metadata=mapping))
        self._metadata_indices.append(MetadataIndex(self._append(data), len(data), name))

    def add_block(self, block):
        """Add one chunk with its message indexes, in one write."""
        packed = pack(block.records, self._compression)
        words = '' if self._compression == 'none' else self._compression
        chunk = _bytes_of(Chunk(
            compression=words, data=packed, message_start_time=block.start_ns,
            message_end_time=block.end_ns, uncompressed_crc=zlib.crc32(block.records),
            uncompressed_size=len(block.records)))
        parts, offsets, at = [chunk], {}, self.size + len(chunk)
        for channel, pairs in block.index.items():
            offsets[channel] = at
            parts.append(struct.pack('<BQHI', Opcode.MESSAGE_INDEX, 6 + len(pairs), channel,
                                     len(pairs)) + bytes(pairs))
            at += len(parts[-1])
        start = self._append(b''.join(parts))
        self._chunk_indices.append(ChunkIndex(
            chunk_start_offset=start, chunk_length=len(chunk), compression=words,
            message_start_time=block.start_ns, message_end_time=block.end_ns,
            message_index_offsets=offsets, message_index_length=at - start - len(chunk),
            compressed_size=len(packed), uncompressed_size=len(block.records)))
        first = self.start_ns is None
        self.start_ns = block.start_ns if first else min(self.start_ns, block.start_ns)
        self.end_ns = block.end_ns if first else max(self.end_ns, block.end_ns)
        for channel, count in block.counts().items():
            self.counts[channel] = self.counts.get(channel, 0) + count

    def sync(self):
        """Have everything that was written so far on the disk itself."""
        os.fsync(self._file.fileno())

    def abandon(self):
        """Close the file without a summary; it ends with a whole record."""
        self._file.close()

    def finish(self):
        """Write the summary and close the file."""
        end = _bytes_of(DataEnd(self._crc))
        start = self.size + len(end)
        statistics = Statistics(
            attachment_count=0, channel_count=len(self._channels),
            channel_message_counts=self.counts, chunk_count=len(self._chunk_indices),
            message_count=sum(self.counts.values()), message_start_time=self.start_ns or 0,
            message_end_time=self.end_ns or 0, metadata_count=len(self._metadata_indices),
            schema_count=len(self._schemas))
        summary, groups = b'', []
        for opcode, records in ((Opcode.SCHEMA, self._schemas.values()),
                                (Opcode.CHANNEL, self._channels.values()),
                                (Opcode.STATISTICS, (statistics,)),
                                (Opcode.CHUNK_INDEX, self._chunk_indices),
                                (Opcode.METADATA_INDEX, self._metadata_indices)):
            group = _bytes_of(*records)
            if group:
                groups.append(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        offsets_at = start + len(summary)
        summary += _bytes_of(*groups)
        # The summary's CRC also covers the footer up to the CRC itself (MCAP specification).
        crc = zlib.crc32(struct.pack('<BQQQ', Opcode.FOOTER, 20, start, offsets_at),
                         zlib.crc32(summary))
        self._append(end + summary + _bytes_of(Footer(start, offsets_at, crc)) + MCAP0_MAGIC)
        self.sync()
        self._file.close()
