"""What is in one MCAP file that was closed, from its summary, checked before it is believed."""
from dataclasses import dataclass, field
import os
import struct
import zlib

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from ssi_ros.limits import LATEST_NS, LIMITS

from .mcap_chunk import COMPRESSIONS, Piece
from .mcap_records import HEAD, parse

_FOOTER = 9 + 20 + 8                # footer record and magic at the end of a file


@dataclass
class Contents:
    """
    What one file holds.

    Attributes
    ----------
    schemas, channels : dict
        By id: the records of the mcap package.
    counts : dict
        Messages of each channel id.
    pieces : list of Piece
        In file order.
    metadata : dict
        Name -> words to words; the last record of a name.
    compressions : set of str
        Of the chunks.
    dropped_bytes, size : int
        What of the file could not be read, and its size [byte].
    damage : str
        What is wrong with it; empty for a sound file.
    salvaged : list of bytes
        Message records that were got out of a damaged last chunk.
    unchecked : int
        Chunks without a checksum, and runs of messages outside of chunks.
    unsure : dict
        Id of every schema that no checksum vouches for -> whether its copies differ.

    """

    schemas: dict = field(default_factory=dict)
    channels: dict = field(default_factory=dict)
    counts: dict = field(default_factory=dict)
    pieces: list = field(default_factory=list)
    metadata: dict = field(default_factory=dict)
    compressions: set = field(default_factory=set)
    dropped_bytes: int = 0
    size: int = 0
    damage: str = ''
    salvaged: list = field(default_factory=list)
    unchecked: int = 0
    unsure: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Summary:
    """The records of a summary section; `checked` by its checksum."""

    schemas: dict
    channels: dict
    indexes: list
    statistics: object
    checked: bool
    start: int


def check_magic(path):
    """
    Say what a file is if it is not MCAP.

    Raises
    ------
    ValueError
        For a file that is empty, a ROS 1 bag or something else.

    """
    with open(path, 'rb') as f:
        magic = f.read(13)
    if not magic:
        raise ValueError(f'{path} is empty: nothing was ever written to it')
    if magic.startswith(b'#ROSBAG'):
        raise ValueError(f'{path} is a ROS 1 bag; convert it first: rosbags-convert '
                         f'--src {path} --dst NEW_BAG')
    if not magic.startswith(MCAP0_MAGIC) and not MCAP0_MAGIC.startswith(magic):
        raise ValueError(f'{path} is not an MCAP file; give the folder of a rosbag2 bag, '
                         'an .mcap or a .db3')


def summary_of(file, size):
    """
    Return the Summary of an open file, None if it was closed without one.

    Raises
    ------
    ValueError
        If the file was not closed, or its summary is damaged.

    """
    file.seek(max(0, size - _FOOTER))
    tail = file.read(_FOOTER)
    if len(tail) < _FOOTER or not tail.endswith(MCAP0_MAGIC):
        raise ValueError('it was cut off: it has no end, as after a crash or a full disk')
    opcode, length = HEAD.unpack_from(tail)
    start, _, crc = struct.unpack_from('<QQI', tail, 9)
    if opcode != Opcode.FOOTER or length != 20:
        raise ValueError('it has a damaged footer')
    if not start:
        return None
    end = size - _FOOTER
    if not 8 <= start <= end:
        raise ValueError('it has a damaged footer')
    schemas, channels, indexes, statistics = {}, {}, [], None
    actual, at = 0, start
    file.seek(start)
    while at < end:
        head = file.read(9)
        opcode, length = HEAD.unpack(head) if len(head) == 9 else (0, size)
        if at + 9 + length > end or length > LIMITS.record_bytes:
            raise ValueError(f'it has a damaged summary (the record at byte {at})')
        body = file.read(length)
        actual = zlib.crc32(body, zlib.crc32(head, actual))
        at += 9 + length
        if opcode == Opcode.SCHEMA:
            schema = parse(opcode, body)
            schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = parse(opcode, body)
            channels[channel.id] = channel
        elif opcode == Opcode.CHUNK_INDEX:
            indexes.append(_without_offsets(parse(opcode, body)))
            if len(indexes) > LIMITS.chunks:
                raise ValueError(f'it has more than {LIMITS.chunks} chunks, the most that are '
                                 'read; split the bag')
        elif opcode == Opcode.STATISTICS:
            statistics = parse(opcode, body)
    if crc and zlib.crc32(tail[:9 + 16], actual) != crc:
        raise ValueError('it has a damaged summary (its checksum is wrong)')
    return Summary(schemas, channels, indexes, statistics, bool(crc), start)


def _without_offsets(index):
    """Return a chunk index without the offsets of its message indexes, which nobody reads."""
    index.message_index_offsets = None
    return index


def contents_of(path, limit=None):
    """
    Return the contents of a file that was closed.

    Parameters
    ----------
    path : Path
        The file.
    limit : int, optional
        Largest chunk [byte]; that of LIMITS if not given.

    Raises
    ------
    ValueError
        If the file is not MCAP, was not closed, is damaged, or larger than allowed.

    """
    from .mcap_scan import scan

    check_magic(path)
    size = os.path.getsize(path)
    with open(path, 'rb') as f:
        try:
            summary = summary_of(f, size)
            pieces = None if summary is None else _pieces(summary, size, limit)
        except ValueError as error:
            raise ValueError(f'{path}: {error}; run ssi_ros recover {path}') from None
    statistics = summary.statistics if summary else None
    if statistics is None or len(pieces) != statistics.chunk_count or (
            statistics.message_count and not pieces):
        contents = scan(path, limit)    # a writer may leave the summary, or the chunks, out
        if contents.damage:
            raise ValueError(f'{path}: {contents.damage}; run ssi_ros recover {path}')
        return contents
    counts = dict(statistics.channel_message_counts)
    if sum(counts.values()) != statistics.message_count:
        raise ValueError(f'{path} declares {statistics.message_count} messages, and '
                         f'{sum(counts.values())} over its channels; run ssi_ros recover {path}')
    return Contents(
        schemas=summary.schemas, channels=summary.channels, counts=counts, size=size,
        pieces=pieces, compressions={c.compression for c in summary.indexes})


def _pieces(summary, size, limit):
    """Return the pieces that an index names, once they can all be true; ValueError if not."""
    limit = LIMITS.chunk_bytes if limit is None else limit
    indexes = sorted(summary.indexes, key=lambda c: c.chunk_start_offset)
    behind, total = 8, 0
    for c in indexes:
        if c.chunk_start_offset < behind or c.chunk_length < 9:
            raise ValueError('its index names chunks that overlap')
        behind = c.chunk_start_offset + c.chunk_length
        if c.uncompressed_size > limit:
            raise ValueError(f'a chunk claims {c.uncompressed_size} bytes; {limit} are read '
                             '(ssi_ros recover --largest-chunk-mib reads larger ones)')
        total += c.uncompressed_size
        if c.compression not in COMPRESSIONS:
            raise ValueError(f'chunks are compressed as {c.compression!r}; zstd, lz4 or none is '
                             'needed')
        if not c.message_start_time <= c.message_end_time <= LATEST_NS:
            raise ValueError(f'its index gives a chunk the times {c.message_start_time} to '
                             f'{c.message_end_time} ns')
    if behind > summary.start:
        raise ValueError('its index names chunks beyond its data')
    check_total(total, size)
    return [Piece(c.chunk_start_offset + 9, c.chunk_length - 9, c.message_start_time,
                  c.message_end_time) for c in indexes]


def check_total(total, size):
    """Raise ValueError if the chunks of a file hold more than one of its size may."""
    if total > LIMITS.total_bytes(size):
        raise ValueError(f'its {size} bytes would become {total} or more; a file of this size may '
                         f'hold {LIMITS.total_bytes(size)}')
