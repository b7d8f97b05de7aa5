"""What is in one MCAP file: from its summary if it was closed, else record by record."""
from dataclasses import dataclass, field
from io import BytesIO
import os
import struct
import zlib

import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel, Metadata, Schema
from mcap.writer import MCAP0_MAGIC
import zstandard

from .mcap_file import MESSAGE_HEAD

_HEAD = struct.Struct('<BQ')
_CHUNK = struct.Struct('<QQQII')     # start, end, uncompressed size, CRC, length of the next word
_MESSAGE, _DAMAGE = int(Opcode.MESSAGE), (zstandard.ZstdError, RuntimeError, EOFError)


@dataclass(frozen=True)
class Piece:
    """A chunk, or a run of messages outside of any: where its bytes are, and its log times."""

    offset: int
    size: int
    start_ns: int
    end_ns: int
    chunk: bool = True


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
    sound_bytes, size : int
        How far the file is sound, and its size [byte].
    damage : str
        What is wrong with it; empty for a sound file.
    salvaged : list of bytes
        Message records that were got out of a damaged last chunk.

    """

    schemas: dict = field(default_factory=dict)
    channels: dict = field(default_factory=dict)
    counts: dict = field(default_factory=dict)
    pieces: list = field(default_factory=list)
    metadata: dict = field(default_factory=dict)
    compressions: set = field(default_factory=set)
    sound_bytes: int = 0
    size: int = 0
    damage: str = ''
    salvaged: list = field(default_factory=list)

    @property
    def start_ns(self):
        """Smallest log time [ns], None without messages."""
        return min((p.start_ns for p in self.pieces), default=None)

    @property
    def end_ns(self):
        """Largest log time [ns], None without messages."""
        return max((p.end_ns for p in self.pieces), default=None)


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


def contents_of(path):
    """
    Return the contents of a file that was closed.

    Raises
    ------
    ValueError
        If the file is not MCAP, or was not closed.

    """
    check_magic(path)
    size = os.path.getsize(path)
    with open(path, 'rb') as f:
        f.seek(max(0, size - 8))
        if size < 16 or f.read(8) != MCAP0_MAGIC:
            raise ValueError(f'{path} was cut off: it has no end, as after a crash or a full '
                             f'disk; run ssi_ros recover {path}')
        f.seek(0)
        try:
            reader = SeekingReader(f)
            summary = reader.get_summary()
            metadata = {m.name: m.metadata for m in reader.iter_metadata()} if summary else {}
        except (McapError, struct.error, UnicodeDecodeError, ValueError) as error:
            raise ValueError(f'{path} has a damaged summary ({error}); '
                             f'run ssi_ros recover {path}') from None
    statistics = summary.statistics if summary else None
    chunks = summary.chunk_indexes if summary else []
    if statistics is None or len(chunks) != statistics.chunk_count or (
            statistics.message_count and not chunks):
        contents = scan(path)           # a writer may leave the summary, or the chunks, out
        if contents.damage:
            raise ValueError(f'{path}: {contents.damage}; run ssi_ros recover {path}')
        return contents
    chunks = sorted(chunks, key=lambda c: c.chunk_start_offset)
    return Contents(
        schemas=summary.schemas, channels=summary.channels, metadata=metadata,
        counts=dict(statistics.channel_message_counts), size=size, sound_bytes=size,
        pieces=[Piece(c.chunk_start_offset + 9, c.chunk_length - 9, c.message_start_time,
                      c.message_end_time) for c in chunks],
        compressions={c.compression for c in chunks})


def load(file, piece, path=''):
    """
    Return the message, schema and channel records of a piece, decompressed.

    Raises
    ------
    ValueError
        If the chunk does not decompress, or its checksum is wrong.

    """
    file.seek(piece.offset)
    body = file.read(piece.size)
    if not piece.chunk:
        return body
    _, _, size, crc, word = _CHUNK.unpack_from(body)
    at = _CHUNK.size + word
    compression, packed = body[_CHUNK.size:at].decode(), memoryview(body)[at + 8:]
    try:
        records = unpack(compression, packed, size)
    except _DAMAGE as error:
        raise ValueError(f'{path}: the chunk at byte {piece.offset} does not decompress ({error})'
                         f'; run ssi_ros recover {path}') from None
    if len(records) != size or (crc and zlib.crc32(records) != crc):
        raise ValueError(f'{path}: the chunk at byte {piece.offset} is damaged (its checksum is '
                         f'wrong); run ssi_ros recover {path}')
    return records


def unpack(compression, packed, size):
    """Return the records of a chunk; ValueError for a compression that is not of MCAP."""
    if compression == 'zstd':
        return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    if compression == 'lz4':
        return lz4.frame.decompress(packed)
    if compression == '':
        return bytes(packed)
    raise ValueError(f'chunks are compressed as {compression!r}; zstd, lz4 or none is needed')


def messages_in(records, wanted=None):
    """
    Return the messages of a piece by channel id.

    Parameters
    ----------
    records : bytes
        Records one behind the other.
    wanted : container of int, optional
        Channel ids to return; all if not given.

    Returns
    -------
    dict
        Channel id -> (log times [ns], publish times [ns], CDR bytes), three lists.

    """
    found, columns = {}, {}
    at, end = 0, len(records)
    unpack_message, unpack_head = MESSAGE_HEAD.unpack_from, _HEAD.unpack_from
    while at + 9 <= end:
        if records[at] != _MESSAGE:
            at += 9 + unpack_head(records, at)[1]
            continue
        if at + 31 > end:
            break
        _, length, channel, _, log, publish = unpack_message(records, at)
        stop = at + 9 + length
        if stop > end:
            break
        add = columns.get(channel)
        if add is None:
            lists = ([], [], [])
            if wanted is None or channel in wanted:
                found[channel] = lists
                add = columns[channel] = tuple(c.append for c in lists)
            else:
                add = columns[channel] = ()
        if add:
            add[0](log)
            add[1](publish)
            add[2](records[at + 31:stop])
        at = stop
    return found


def scan(path):
    """
    Return the contents of a file record by record, as far as it is sound.

    A chunk that does not decompress is left out; of a last chunk that is cut, the messages
    before the cut are salvaged. Never raises for a damaged file; `damage` says what was wrong.
    """
    check_magic(path)
    contents = Contents(size=os.path.getsize(path), sound_bytes=min(8, os.path.getsize(path)))
    broken = 0
    with open(path, 'rb') as f:
        at = 8
        while True:
            f.seek(at)
            head = f.read(9)
            if len(head) < 9:
                contents.damage = 'the file was cut off and has no end'
                break
            opcode, length = _HEAD.unpack(head)
            if not 1 <= opcode <= 0x0F and opcode < 0x80 or length > 1 << 40:
                contents.damage = f'at byte {at} there is no MCAP record'
                break
            if at + 9 + length > contents.size:
                contents.damage = f'the file was cut off inside the record at byte {at}'
                if opcode == Opcode.CHUNK:
                    _salvage(f, at, contents)
                break
            if opcode == Opcode.CHUNK:
                broken += not _scan_chunk(f, at, length, contents, path)
            elif opcode == _MESSAGE:
                _note(f, at, length, contents)
            else:
                _learn(opcode, f.read(length), contents)
            at += 9 + length
            contents.sound_bytes = at
            if opcode == Opcode.FOOTER:
                contents.sound_bytes = contents.size
                break
    if broken:
        contents.damage = (contents.damage and contents.damage + '; ') + \
            f'{broken} damaged chunks'
    return contents


def _learn(opcode, body, contents):
    """Keep a schema, a channel or metadata."""
    stream = ReadDataStream(BytesIO(body))
    if opcode == Opcode.SCHEMA:
        schema = Schema.read(stream)
        contents.schemas[schema.id] = schema
    elif opcode == Opcode.CHANNEL:
        channel = Channel.read(stream)
        contents.channels[channel.id] = channel
    elif opcode == Opcode.METADATA:
        metadata = Metadata.read(stream)
        contents.metadata[metadata.name] = metadata.metadata


def _learn_from(records, contents):
    """Keep a chunk's schemas and channels, count its messages, and return their log times."""
    at = 0
    while at + 9 <= len(records):
        opcode, length = _HEAD.unpack_from(records, at)
        if opcode != _MESSAGE and at + 9 + length <= len(records):
            _learn(opcode, records[at + 9:at + 9 + length], contents)
        at += 9 + length
    logs = []
    for channel, (times, _, _) in messages_in(records).items():
        contents.counts[channel] = contents.counts.get(channel, 0) + len(times)
        logs += times
    return logs


def _scan_chunk(f, at, length, contents, path):
    piece = Piece(at + 9, length, 0, 0)
    try:
        records = load(f, piece, path)
    except (ValueError, struct.error):
        return False
    logs = _learn_from(records, contents)
    if logs:
        contents.pieces.append(Piece(at + 9, length, min(logs), max(logs)))
    f.seek(at + 9 + _CHUNK.size - 4)
    word = struct.unpack('<I', f.read(4))[0]
    contents.compressions.add(f.read(word).decode())
    return True


def _note(f, at, length, contents):
    """Count a message outside of any chunk, and lengthen the run it belongs to."""
    channel, _, log, _ = struct.unpack('<HIQQ', f.read(22))
    contents.counts[channel] = contents.counts.get(channel, 0) + 1
    contents.compressions.add('')
    last = contents.pieces[-1] if contents.pieces else None
    if last is not None and not last.chunk and last.offset + last.size == at:
        contents.pieces[-1] = Piece(last.offset, last.size + 9 + length, min(last.start_ns, log),
                                    max(last.end_ns, log), False)
    else:
        contents.pieces.append(Piece(at, 9 + length, log, log, False))


def _salvage(f, at, contents):
    """Take the whole messages out of the part of a chunk that is there."""
    f.seek(at + 9)
    body = f.read()
    if len(body) < _CHUNK.size:
        return
    word = _CHUNK.unpack_from(body)[4]
    start = _CHUNK.size + word
    packed = body[start + 8:]
    try:
        compression = body[_CHUNK.size:start].decode()
        if compression == 'zstd':
            records = zstandard.ZstdDecompressor().decompressobj().decompress(packed)
        elif compression == 'lz4':
            records = lz4.frame.LZ4FrameDecompressor().decompress(packed)
        else:
            records = packed
        _learn_from(records, contents)
    except (*_DAMAGE, UnicodeDecodeError):
        return
    contents.salvaged.append(records)
