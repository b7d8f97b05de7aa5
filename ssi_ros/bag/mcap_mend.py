"""What a damaged chunk may have been: its head by its lengths, its beginning where it is cut."""
import struct

import lz4.frame
import zstandard

from .mcap_chunk import COMPRESSIONS
from .mcap_records import CHUNK, ChunkHead
from .schema import parse as parse_definition


def possible_heads(file, at, length):
    """Yield the heads that a chunk at an offset may have had, the one that stands there first."""
    file.seek(at + 9)
    front = file.read(CHUNK.size + 16)
    if len(front) < CHUNK.size + 8:
        return
    start, end, size, crc, word = CHUNK.unpack_from(front)
    written = front[CHUNK.size:CHUNK.size + word].decode(errors='replace') if word <= 8 else None
    names = sorted(COMPRESSIONS, key=lambda name: name != written)
    for name in names:
        before = CHUNK.size + len(name) + 8
        if len(front) < before:
            continue
        packed, = struct.unpack_from('<Q', front, CHUNK.size + len(name))
        sizes = {length - before: None, packed: None} if name == written else (
            {packed: None} if packed == length - before else {})
        for this in sizes:
            if this < 0:
                continue
            head = ChunkHead(start, end, size, crc, name, at + 9 + before, this)
            yield head
            if crc and name:             # the size may be what is wrong: the checksum decides
                yield ChunkHead(start, end, None, crc, name, at + 9 + before, this)


def beginning(compression, packed, limit):
    """Return what the beginning of a chunk decompresses to, at most `limit` bytes."""
    if compression == 'zstd':
        reader = zstandard.ZstdDecompressor(max_window_size=1 << limit.bit_length()) \
            .stream_reader(packed)
        return reader.read(limit)
    if compression == 'lz4':
        return lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=limit)
    return packed[:limit]


def is_definition(schema):
    """Return whether a schema can be read; one of another encoding is not judged."""
    if schema.encoding != 'ros2msg':
        return schema.name.isprintable()
    try:
        text = schema.data.decode()
        name = schema.name
        return bool(parse_definition(name, text))
    except ValueError:
        return False
