"""The way to a member of a CDR message: each begins where the one before it ends, aligned."""
from dataclasses import dataclass
import struct

from ssi_ros.limits import LIMITS

from .schema import SIZES, STRINGS

_ORDERS = {b'\x00\x00': '>', b'\x00\x01': '<'}


@dataclass(frozen=True)
class Step:
    """One step of a path: skip the members before it, then enter `member` at `index`."""

    before: tuple
    member: object
    index: int


class Walk:
    """A position in one message, and the lengths that were met on the way."""

    def __init__(self, types, raw):
        self.types, self.raw, self.pos, self.lengths, self.steps = types, raw, 4, [], 0
        head = bytes(raw[:2])
        if head not in _ORDERS:
            raise ValueError(f'a message begins with the bytes {bytes(raw[:4]).hex(" ") or "none"}'
                             '; 00 00 or 00 01 (plain CDR) is needed')
        self.order = _ORDERS[head]

    def align(self, size):
        """Go to the next multiple of a size, counted from behind the encapsulation header."""
        self.pos += (4 - self.pos) % size

    def length(self):
        """Return the length of the string or sequence that begins here."""
        self.align(4)
        left = len(self.raw) - self.pos - 4
        count = struct.unpack_from(self.order + 'I', self.raw, self.pos)[0] if left >= 0 else 0
        if left < 0 or count > left:      # an element takes at least one byte
            raise ValueError(f'a message of {len(self.raw)} bytes ends inside a string or '
                             f'sequence of length {count} at byte {self.pos}')
        self.lengths.append((self.pos, count))
        self.pos += 4
        return count

    def skip(self, base, count):
        """Pass over so many elements of a type."""
        if base in SIZES:
            if count:
                self.align(SIZES[base])
                self.pos += SIZES[base] * count
        elif base in STRINGS:
            for _ in range(count):
                self.step()
                held = self.length()          # first: it moves the position itself
                self.pos += held * (4 if base == 'wstring' else 1)
        else:
            for _ in range(count):
                self.step()
                for m in self.types[base]:
                    self.skip(m.base, self.length() if m.count is None else m.count)

    def step(self):
        """Count an element; each takes a byte or more, so a message bounds how many there are."""
        self.steps += 1
        if self.pos > len(self.raw):
            raise ValueError(f'a message of {len(self.raw)} bytes ends inside an array')
        if self.steps > LIMITS.schema_steps:
            raise ValueError(f'a message has more than {LIMITS.schema_steps} elements before the '
                             'field; that is more than is read')

    def to(self, steps):
        """Return the offset at which the last step's member begins."""
        for step in steps:
            for m in step.before:
                self.skip(m.base, self.length() if m.count is None else m.count)
            count = self.length() if step.member.count is None else step.member.count
            if step.index >= count:
                raise ValueError(f'{step.member.name}[{step.index}] does not exist in a message '
                                 f'whose {step.member.name} has {count} elements')
            self.skip(step.member.base, step.index)
        self.align(SIZES.get(steps[-1].member.base, 4))
        return self.pos
