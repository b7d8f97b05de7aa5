"""
The records of an MCAP file, each checked to be within its bounds before it is read.

A record is an opcode (1 byte), a length (8 bytes) and a body (MCAP specification 0). The mcap
package reads the bodies; what it raises for a damaged one is turned into a ValueError here.
"""
from dataclasses import dataclass
from io import BytesIO
import struct

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode

from ssi_ros.limits import LIMITS


HEAD = struct.Struct('<BQ')
CHUNK = struct.Struct('<QQQII')     # start, end, uncompressed size, CRC, length of the next word
MESSAGE = int(Opcode.MESSAGE)
_READ = {Opcode.HEADER: records.Header, Opcode.FOOTER: records.Footer,
         Opcode.SCHEMA: records.Schema, Opcode.CHANNEL: records.Channel,
         Opcode.CHUNK_INDEX: records.ChunkIndex, Opcode.STATISTICS: records.Statistics,
         Opcode.METADATA: records.Metadata, Opcode.METADATA_INDEX: records.MetadataIndex,
         Opcode.SUMMARY_OFFSET: records.SummaryOffset, Opcode.DATA_END: records.DataEnd,
         Opcode.ATTACHMENT_INDEX: records.AttachmentIndex}
KNOWN, PRIVATE = {int(o) for o in Opcode}, 0x80


@dataclass(frozen=True)
class ChunkHead:
    """
    What stands before the records of a chunk, and where those are in the file.

    `size` is that of the records decompressed [byte]; None where it is not to be trusted.
    """

    start_ns: int
    end_ns: int
    size: object
    crc: int
    compression: str
    data_at: int
    packed: int

    @property
    def stop(self):
        """Return the offset behind the chunk."""
        return self.data_at + self.packed


class _WholeReads(ReadDataStream):
    """The package's stream, which gives less than was asked for at the end of a body."""

    def read(self, length):
        data = super().read(length)
        if len(data) < length:
            raise EndOfFile()
        return data


def parse(opcode, body):
    """
    Return a record of the mcap package.

    Raises
    ------
    ValueError
        If the body ends inside a field, is larger than allowed, or holds text that is not UTF-8.

    """
    if len(body) > LIMITS.record_bytes:
        raise ValueError(f'a record of {len(body)} bytes is larger than the '
                         f'{LIMITS.record_bytes} that are read')
    stream = _WholeReads(BytesIO(body))
    try:
        found = _READ[opcode].read(stream)
    except (McapError, struct.error, UnicodeDecodeError, ValueError, OverflowError) as error:
        raise ValueError(f'a {Opcode(opcode).name.lower().replace("_", " ")} record is damaged '
                         f'({str(error) or "it ends too early"})') from None
    return found


def records_in(data, what='the data'):
    """
    Yield (opcode, start, stop) of the bodies of records one behind the other.

    Raises
    ------
    ValueError
        If one is longer than what holds it, after those before it.

    """
    at, end = 0, len(data)
    while at < end:
        length = HEAD.unpack_from(data, at)[1] if at + 9 <= end else end
        if at + 9 + length > end:
            raise ValueError(f'the record at byte {at} of {what} is longer than {what}')
        yield data[at], at + 9, at + 9 + length
        at += 9 + length


def chunk_head(file, at, length):
    """
    Return the head of the chunk whose body begins at an offset.

    Raises
    ------
    ValueError
        If its lengths do not add up to that of the record.

    """
    file.seek(at)
    front = file.read(CHUNK.size + 16)
    if len(front) >= CHUNK.size + 8:
        start, end, size, crc, word = CHUNK.unpack_from(front)
        if word <= 8 and len(front) >= CHUNK.size + word + 8:
            name = front[CHUNK.size:CHUNK.size + word]
            packed, = struct.unpack_from('<Q', front, CHUNK.size + word)
            before = CHUNK.size + word + 8
            if before + packed == length and name.isascii():
                return ChunkHead(start, end, size, crc, name.decode(), at + before, packed)
    raise ValueError(f'the lengths of the chunk at byte {at} do not add up')


def plausible(file, at, size):
    """
    Return the offset behind the record at an offset, None if nothing there is a sound record.

    The lengths inside it have to fit its own; messages, attachments and private records (opcodes
    from 0x80 on) hold none.
    """
    file.seek(at)
    head = file.read(9)
    if len(head) < 9:
        return None
    opcode, length = HEAD.unpack(head)
    stop = at + 9 + length
    if opcode not in KNOWN and opcode < PRIVATE or stop > size:
        return None
    try:
        if opcode == Opcode.CHUNK:
            chunk_head(file, at + 9, length)
        elif opcode == Opcode.MESSAGE_INDEX:
            channel_and_size = file.read(6)
            if length < 6 or struct.unpack('<HI', channel_and_size)[1] != length - 6:
                return None
        elif opcode == MESSAGE:
            if length < 22:
                return None
        elif opcode in _READ:
            if length > LIMITS.record_bytes:
                return None
            parse(opcode, file.read(length))
    except ValueError:
        return None
    return stop
