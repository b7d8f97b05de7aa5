"""The messages of one MCAP chunk: decompressed within bounds, checked, sorted by channel."""
from array import array
from dataclasses import dataclass
import zlib

import lz4.frame
import numpy as np
from ssi_ros.limits import LATEST_NS, LIMITS
import zstandard

from .mcap_file import MESSAGE_HEAD
from .mcap_records import chunk_head, ChunkHead, HEAD, KNOWN, MESSAGE, PRIVATE, records_in
from .mcap_runs import LEAST, Rows, run, take

COMPRESSIONS = ('zstd', 'lz4', '')
DAMAGE = (zstandard.ZstdError, RuntimeError, EOFError)


@dataclass(frozen=True)
class Piece:
    """
    A chunk, or a run of messages outside of any: where its body is, and its log times.

    `head` is given where that of the file is damaged and was mended.
    """

    offset: int
    size: int
    start_ns: int
    end_ns: int
    chunk: bool = True
    head: ChunkHead = None


def unpack(compression, packed, size, limit=None):
    """
    Return the records of a chunk, at most `size` bytes; where that is None, at most `limit`.

    Raises
    ------
    ValueError
        If the chunk claims or holds more than allowed, does not decompress, or is compressed in
        a way that is not of MCAP.

    """
    limit = LIMITS.chunk_bytes if limit is None else limit
    if size is not None and size > limit:
        raise ValueError(f'a chunk claims {size} bytes; {limit} are read '
                         '(ssi_ros recover --largest-chunk-mib reads larger ones)')
    most = limit if size is None else size
    try:
        if compression == 'zstd':
            records = _zstd(packed, most, size, limit)
        elif compression == 'lz4':
            records = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=most + 1)
        elif compression == '':
            records = packed
        else:
            raise ValueError(f'chunks are compressed as {compression!r}; zstd, lz4 or none is '
                             'needed')
    except DAMAGE as error:
        raise ValueError(f'it does not decompress ({error})') from None
    if len(records) > most or (size is not None and len(records) != size):
        raise ValueError(f'it decompresses to other than the {most} bytes that it claims')
    return records


def _zstd(packed, most, size, limit):
    claimed = zstandard.get_frame_parameters(packed).content_size
    if claimed not in (zstandard.CONTENTSIZE_UNKNOWN, zstandard.CONTENTSIZE_ERROR) and (
            claimed > most or (size is not None and claimed != size)):
        raise ValueError(f'it claims {claimed} bytes inside, and {most} outside')
    # a window larger than all that is read would be taken before the first byte
    window = max(1 << 23, 1 << limit.bit_length())
    return zstandard.ZstdDecompressor(max_window_size=window).decompress(
        packed, max_output_size=most)


def load(file, piece, path='', limit=None):
    """
    Return the message, schema and channel records of a piece, decompressed.

    Raises
    ------
    ValueError
        If the chunk is larger than allowed, does not decompress, or its checksum is wrong.

    """
    if not piece.chunk:
        file.seek(piece.offset)
        return file.read(piece.size)
    try:
        head = piece.head or chunk_head(file, piece.offset, piece.size)
        return checked(file, head, limit)
    except ValueError as error:
        raise ValueError(f'{path}: the chunk at byte {piece.offset} is damaged: {error}; '
                         f'run ssi_ros recover {path}') from None


def checked(file, head, limit=None):
    """Return the records of a chunk whose checksum is right; ValueError says what is wrong."""
    file.seek(head.data_at)
    packed = file.read(head.packed)
    if len(packed) < head.packed:
        raise ValueError('the file ends inside it')
    records = unpack(head.compression, packed, head.size, limit)
    if head.crc and zlib.crc32(records) != head.crc:
        raise ValueError('its checksum is wrong')
    return records


def well_formed(records):
    """Return whether records one behind the other are all of MCAP and end where they should."""
    try:
        return all(opcode in KNOWN or opcode >= PRIVATE
                   for opcode, _, _ in records_in(records))
    except ValueError:
        return False


def span(times):
    """Return the first and the last of an array of times [ns]."""
    times = np.frombuffer(times, np.uint64)
    return int(times.min()), int(times.max())


def messages_in(records, wanted=None, most=None, strict=True):
    """
    Return the messages of a piece by channel id.

    Parameters
    ----------
    records : bytes
        Records one behind the other.
    wanted : container of int, optional
        Channel ids to return; all if not given.
    most : int, optional
        Bytes of each message that are returned; all if not given.
    strict : bool
        Whether a record that is longer than the piece is an error, or the end.

    Returns
    -------
    dict
        Channel id -> (log times [ns], publish times [ns], CDR bytes): two arrays, `Rows`.

    Raises
    ------
    ValueError
        If a record is longer than the piece, or a time is beyond those of ROS.

    """
    found, at, end, before, retry = {}, 0, len(records), None, 0
    unpack_message, unpack_head = MESSAGE_HEAD.unpack_from, HEAD.unpack_from

    def columns(channel):
        if channel not in found:
            found[channel] = array('Q'), array('Q'), Rows(records, most)
        return found[channel]

    while at + 9 <= end:
        if records[at] != MESSAGE:
            at += 9 + unpack_head(records, at)[1]
            continue
        if at + 31 > end:
            break
        _, length, channel, _, log, publish = unpack_message(records, at)
        stop = at + 9 + length
        if stop > end or length < 22:
            break
        if length == before and at >= retry:
            heads = run(records, at, stop - at)
            retry = at + LEAST * (stop - at)
            if len(heads) >= LEAST:
                take(heads, at, columns, wanted)
                at += len(heads) * (stop - at)
                continue
        before = length
        if wanted is None or channel in wanted:
            logs, publishes, rows = columns(channel)
            logs.append(log)
            publishes.append(publish)
            rows.append(at + 31, stop)
        at = stop
    if strict and at != end:
        raise ValueError(f'the record at byte {min(at, end)} of a piece of {end} bytes is longer '
                         'than the piece')
    for logs, publishes, _ in found.values():
        latest = max(span(logs)[1], span(publishes)[1])
        if latest > LATEST_NS and strict:
            raise ValueError(f'a message has the time {latest} ns; ROS knows times up to '
                             f'{LATEST_NS} ns, the year 2262')
    return found
