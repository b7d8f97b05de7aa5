"""
What is in one MCAP file record by record, whatever befell it.

A record that is not sound is passed over: the next place at which three sound records follow each
other is where the file goes on. A chunk whose head is damaged is tried with what its lengths, its
name and its checksum leave possible. Schemas and channels stand in a file twice or more; the copy
whose checksum is right is believed.
"""
from bisect import bisect_right
import os
import re
import struct

from mcap.opcode import Opcode

from ssi_ros.limits import LIMITS

from .mcap_chunk import checked, DAMAGE, messages_in, Piece, span, well_formed
from .mcap_contents import check_total, Contents, summary_of
from .mcap_mend import beginning, is_definition, possible_heads
from .mcap_records import chunk_head, HEAD, MESSAGE, parse, plausible, PRIVATE, records_in

_LIKELY = re.compile(rb'[\x01-\x0f].{5}\0\0\0', re.DOTALL)
_WINDOW = 1 << 20
_CHAIN = 3                       # sound records that must follow each other after damage
_TRIALS = 1_000_000              # places that are tried after damage, 5 s, before it is given up
CHECKED, READABLE, BROKEN = 2, 1, 0            # how far a copy of a schema is to be believed


def scan(path, limit=None):
    """
    Return the contents of a file record by record, as far as they are sound.

    A chunk that cannot be read is left out; of a last chunk that is cut, the messages before the
    cut are salvaged. Never raises for a damaged file; `damage` says what was wrong.

    Parameters
    ----------
    path : Path
        The file.
    limit : int, optional
        Largest chunk [byte]; that of LIMITS if not given.

    """
    with open(path, 'rb') as f:
        return _Scan(f, os.path.getsize(path), limit).run()


class _Scan:
    """A walk through one file."""

    def __init__(self, file, size, limit):
        self.file, self.size, self.limit = file, size, limit or LIMITS.chunk_bytes
        self.contents, self.doubtful = Contents(size=size), Contents()
        self.beliefs = {}                  # (kind, id) -> how far its record is believed
        self.copies = {}                   # id of a schema -> the different texts of it
        self.skipped, self.broken, self.unpacked, self.trials = [], [], 0, 0
        self.regained = 0                  # bytes of what was skipped that the index gave back
        self.why, self.reason, self.indexed, self.end = '', '', [], size

    def run(self):
        """Return what the file holds."""
        summary = self._summary()
        at = 8
        while at < self.end:
            behind = self._take(at)
            at = behind if behind is not None else self._resync(at, at + 1)
        self._judge_doubtful()
        self._from_index()
        if summary is not None and summary.checked and summary.channels:
            self.contents.schemas = dict(summary.schemas)
            self.contents.channels = dict(summary.channels)
        elif summary is not None:
            for record in (*summary.schemas.values(), *summary.channels.values()):
                self._believe(record, CHECKED if summary.checked else READABLE)
        if summary is None or not summary.checked:
            self.contents.unsure = {number: len(texts) > 1 for number, texts in self.copies.items()
                                    if self.beliefs[True, number] < CHECKED}
        return self._finish()

    def _summary(self):
        """Return the summary if there is a sound one, and end the walk before it."""
        try:
            summary = summary_of(self.file, self.size)
        except ValueError as error:
            self.why = f'{error}'.removeprefix('it ')
            return None
        if summary is not None:
            self.end = summary.start
            self.indexed = [(c.chunk_start_offset, c.chunk_length) for c in summary.indexes]
        return summary

    def _take(self, at):
        """Take the record at an offset; return the offset behind it, None if it is not sound."""
        behind = plausible(self.file, at, self.size)
        self.file.seek(at)
        opcode, length = HEAD.unpack(self.file.read(9).ljust(9, b'\0'))
        if behind is None or opcode == Opcode.CHUNK:
            return self._chunk(at, length, behind)
        if opcode >= PRIVATE:              # one bit makes it of a chunk
            return self._chunk(at, length, None) or behind
        if opcode == MESSAGE:
            self._note(at, length)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
            self._learn(opcode, self.file.read(length), READABLE)
        elif opcode == Opcode.FOOTER:
            return self.size
        return behind

    def _chunk(self, at, length, behind):
        """Take a chunk as it stands or as it can be mended; else pass over it."""
        reason = ''
        for head in possible_heads(self.file, at, length):
            if head.stop > self.size:
                continue
            try:
                records = self._records(head)
            except ValueError as error:
                reason = reason or f'{error}'
                continue
            if records or behind is not None:
                self._keep(at, head, records)
                return head.stop
        if behind is None:
            return self._cut(at, length)
        self.broken.append((at, behind))
        self.reason = self.reason or reason
        return behind

    def _records(self, head):
        """Return the records of a chunk that is sound; ValueError for one that is not."""
        cost = self.limit if head.size is None else min(head.size, self.limit)
        check_total(self.unpacked + cost, self.size)
        self.unpacked += cost
        records = checked(self.file, head, self.limit)
        self.unpacked += len(records) - cost
        if not head.crc:                   # only its own times vouch for it
            if not well_formed(records):
                raise ValueError('its records do not follow each other')
            for times, _, _ in messages_in(records, most=0).values():
                first, last = span(times)
                if not head.start_ns <= first <= last <= head.end_ns:
                    raise ValueError('its messages have other log times than it declares')
        return records

    def _keep(self, at, head, records):
        logs = self._learn_from(records, CHECKED if head.crc else READABLE)
        size = head.stop - at - 9
        self.contents.unchecked += not head.crc
        if logs:
            self.contents.pieces.append(Piece(at + 9, size, min(logs), max(logs), True, head))
        self.contents.compressions.add(head.compression)

    def _learn_from(self, records, belief):
        """Keep a chunk's schemas and channels, count its messages, and return their log times."""
        try:
            for opcode, start, stop in records_in(records):
                if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self._learn(opcode, records[start:stop], belief)
        except ValueError:
            pass                          # a salvaged part ends inside a record
        logs = []
        for channel, (times, _, _) in messages_in(records, most=0, strict=False).items():
            counts = self.contents.counts
            counts[channel] = counts.get(channel, 0) + len(times)
            logs += span(times)
        return logs

    def _learn(self, opcode, body, belief):
        try:
            record = parse(opcode, bytes(body))
        except ValueError:
            return
        if opcode == Opcode.METADATA:
            self.contents.metadata[record.name] = record.metadata
        else:
            self._believe(record, belief)

    def _believe(self, record, belief):
        """Keep the copy of a schema or channel that is to be believed the most."""
        schema = hasattr(record, 'encoding')
        if belief == READABLE and not (is_definition(record) if schema else
                                       record.topic.isprintable() and record.topic):
            belief = BROKEN
        key = (schema, record.id)
        if schema:
            self.copies.setdefault(record.id, set()).add((record.name, record.data))
        if belief > self.beliefs.get(key, -1):
            self.beliefs[key] = belief
            (self.contents.schemas if schema else self.contents.channels)[record.id] = record

    def _note(self, at, length):
        """Count a message outside of any chunk, and lengthen the run it belongs to."""
        channel, _, log, _ = struct.unpack('<HIQQ', self.file.read(22))
        contents = self.doubtful if self.skipped else self.contents
        contents.counts[channel] = contents.counts.get(channel, 0) + 1
        contents.compressions.add('')
        last = contents.pieces[-1] if contents.pieces else None
        if (last is not None and not last.chunk and last.offset + last.size == at
                and last.size + length <= LIMITS.run_bytes):
            contents.pieces[-1] = Piece(last.offset, last.size + 9 + length,
                                        min(last.start_ns, log), max(last.end_ns, log), False)
        else:
            contents.pieces.append(Piece(at, 9 + length, log, log, False))

    def _judge_doubtful(self):
        """
        Take the messages that were found outside of chunks behind damage, or leave them out.

        In a file that has chunks they lay in one whose head is gone: no checksum vouches for them.
        """
        if self.broken or self.indexed or any(p.chunk for p in self.contents.pieces):
            self.skipped += [(p.offset, p.offset + p.size) for p in self.doubtful.pieces]
            return
        for channel, count in self.doubtful.counts.items():
            self.contents.counts[channel] = self.contents.counts.get(channel, 0) + count
        self.contents.pieces += self.doubtful.pieces
        self.contents.compressions |= self.doubtful.compressions

    def _resync(self, bad, at):
        """Return where sound records go on after damage at `bad`; the end if nowhere."""
        while at < self.end:
            self.file.seek(at)
            window = self.file.read(_WINDOW + 9)
            for match in _LIKELY.finditer(window):
                if match.start() >= _WINDOW or self.trials > _TRIALS:
                    break
                self.trials += 1
                if self._chain(at + match.start()):
                    self.skipped.append((bad, at + match.start()))
                    return at + match.start()
            at += _WINDOW
        self.skipped.append((bad, self.end))
        return self.end

    def _chain(self, at):
        for _ in range(_CHAIN):
            behind = plausible(self.file, at, self.size)
            if behind is None:
                return False
            if behind >= self.end or self.size - behind < 9:
                return True
            at = behind
        return True

    def _from_index(self):
        """Take the chunks of a sound index that the walk has passed over."""
        known = {p.offset - 9 for p in self.contents.pieces} | {at for at, _ in self.broken}
        skipped = sorted(self.skipped)
        for at, length in self.indexed:
            if at in known or at + length > self.size:
                continue
            behind = self._chunk(at, length - 9, None)
            i = bisect_right(skipped, (at, self.size)) - 1
            if behind is not None and i >= 0 and behind <= skipped[i][1]:
                self.regained += behind - at
        self.contents.pieces.sort(key=lambda p: p.offset)

    def _cut(self, at, length):
        """Take the whole messages out of a chunk that the file ends in; None for another."""
        if at + 9 + length <= self.size or length > 1 << 40:
            return None
        try:
            head = chunk_head(self.file, at + 9, length)
            self.file.seek(head.data_at)
            records = beginning(head.compression, self.file.read(self.limit), self.limit)
        except (*DAMAGE, ValueError):
            return None
        if self._learn_from(records, READABLE):
            self.contents.salvaged.append(records)
        self.skipped.append((at, self.size))
        return self.size

    def _finish(self):
        contents = self.contents
        contents.unchecked += sum(not p.chunk for p in contents.pieces)
        words = [self.why] if self.why else []
        if self.skipped:
            words.append(f'{len(self.skipped)} damaged part(s) from byte {self.skipped[0][0]} on')
        if self.broken:
            words.append(f'{len(self.broken)} damaged chunk(s): {self.reason}')
        unknown = sum(n for c, n in contents.counts.items() if c not in contents.channels)
        if unknown:
            words.append(f'{unknown} messages of channels that nothing declares')
        contents.damage = '; '.join(words)
        contents.dropped_bytes = sum(b - a for a, b in (*self.skipped, *self.broken)) \
            - self.regained
        return contents
