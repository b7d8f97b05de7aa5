"""
One numeric field and the stamp, read from raw CDR bytes of any ROS 2 message type.

CDR has no offsets in it: a member begins where the one before it ends, aligned to its size. But
only strings and sequences vary in size, and each begins with a word that holds its length. So
the lengths met on the way to a field, in the order they are met, fix its offset: as long as they
stay what they were in the message before (the usual case: a constant frame_id), one unpack of
known offsets reads the stamp, the value and those lengths, and only a change of them needs a
walk. Sizes and alignment: OMG CORBA CDR as ROS 2 uses it (XCDR1, alignment of at most 8 counted
from behind the 4-byte encapsulation header; a wstring holds 4 bytes a character).
"""
from dataclasses import dataclass
from operator import itemgetter
import re
import struct

import numpy as np

from .cdr_walk import Step, Walk
from .mcap_runs import Rows
from .schema import HEADER, numeric_fields, parse, short_name, SIZES, TIME

_CODES = {'bool': 'B', 'byte': 'B', 'char': 'B', 'int8': 'b', 'uint8': 'B', 'int16': 'h',
          'uint16': 'H', 'int32': 'i', 'uint32': 'I', 'int64': 'q', 'uint64': 'Q',
          'float32': 'f', 'float64': 'd'}
_STEP = re.compile(r'([A-Za-z]\w*)((?:\[\d+\])?)')
_LAYOUTS_KEPT = 64


@dataclass(frozen=True)
class Layout:
    """Where things are in a message whose lengths are the `expected` ones."""

    order: str
    items: tuple            # (offset, code) of everything that is unpacked, by offset
    unpack: object
    pick: object            # takes the lengths out of what was unpacked
    expected: object
    stamp: int              # place of the seconds among the items; None without a stamp
    value: int


class FieldReader:
    """Read one numeric field and the stamp of messages of one type; see `field_reader`."""

    def __init__(self, types, steps, stamp_steps):
        self._types, self._steps, self._stamp_steps = types, steps, stamp_steps
        self._code = _CODES[steps[-1].member.base]
        self._layouts = {}
        self._layout = None
        self.has_stamp = stamp_steps is not None

    def read(self, raw):
        """
        Read one message.

        Parameters
        ----------
        raw : bytes
            The message in CDR, with its encapsulation header.

        Returns
        -------
        stamp_ns : int or None
            Stamp of the header [ns]; None if the type has none.
        value : float
            The field (integers beyond 2^53 are rounded).

        Raises
        ------
        ValueError
            If the message is cut, not plain CDR, or has no element of that index.

        """
        layout = self._layout
        try:
            parts = layout.unpack(raw)
            known = layout.pick(parts) == layout.expected
        except (struct.error, AttributeError):      # shorter than the last one, or the first one
            known = False
        if not known:
            layout = self._layout = self._layout_of(raw)
            parts = layout.unpack(raw)
        at = layout.stamp
        if at is None:
            return None, float(parts[layout.value])
        return parts[at] * 1_000_000_000 + parts[at + 1], float(parts[layout.value])

    def read_many(self, raws):
        """
        Read a list of messages, at once where all have the same layout.

        Parameters
        ----------
        raws : list of bytes, or Rows
            Messages in CDR.

        Returns
        -------
        stamps_ns : ndarray of int64, shape (n,), or None
            Stamps [ns]; None if the type has none.
        values : ndarray of float64, shape (n,)
            The field.

        Raises
        ------
        ValueError
            As `read`.

        """
        if not raws:
            return (np.empty(0, np.int64) if self.has_stamp else None), np.empty(0)
        layout = self._layout_of(raws[0])
        columns = _columns(raws, layout)
        if columns:
            first = layout.unpack(raws[0])
            lengths = layout.pick(range(len(columns)))
            lengths = lengths if isinstance(lengths, tuple) else (lengths,)
            if all((columns[i] == first[i]).all() for i in lengths):
                at, values = layout.stamp, columns[layout.value].astype(float)
                if at is None:
                    return None, values
                return columns[at].astype(np.int64) * 1_000_000_000 + columns[at + 1], values
        pairs = [self.read(raw) for raw in raws]
        values = np.array([v for _, v in pairs])
        return (np.array([s for s, _ in pairs], np.int64) if self.has_stamp else None), values

    def _layout_of(self, raw):
        walk = Walk(self._types, raw)
        offset = walk.to(self._steps)
        size = struct.calcsize(self._code)
        if offset + size > len(raw):
            raise ValueError(f'a message of {len(raw)} bytes ends before its field at byte '
                             f'{offset}; it is cut, or not of the type that was declared')
        items = {0: 'H', offset: self._code}
        lengths = list(walk.lengths)
        stamp = None
        if self._stamp_steps is not None:
            walk = Walk(self._types, raw)
            stamp = walk.to(self._stamp_steps)
            if stamp + 8 > len(raw):
                raise ValueError(f'a message of {len(raw)} bytes ends before its stamp')
            items.update({stamp: 'i', stamp + 4: 'I'})
            lengths += walk.lengths
        key = (walk.order, *sorted(set(lengths)))
        layout = self._layouts.get(key)
        if layout is None:
            items.update({at: 'I' for at, _ in lengths})
            if len(self._layouts) >= _LAYOUTS_KEPT:
                self._layouts.clear()
            layout = self._layouts[key] = _layout(
                walk.order, items, {0, *(at for at, _ in lengths)}, stamp, offset, raw)
        return layout


def _columns(raws, layout):
    """Return the columns of the items of a layout, where all messages have one size, or None."""
    if isinstance(raws, Rows):
        if np.ptp(raws.sizes()):
            return None
        return [raws.column(o, layout.order + c) for o, c in layout.items]
    width = len(raws[0])
    if any(len(r) != width for r in raws):
        return None
    block = np.frombuffer(b''.join(raws), np.uint8).reshape(len(raws), width)
    return [block[:, o:o + struct.calcsize(c)].copy().view(layout.order + c)[:, 0]
            for o, c in layout.items]


def _layout(order, items, fixed, stamp, value, raw):
    """Compile the items (offset -> code) into one unpack; those at `fixed` offsets must stay."""
    items = tuple(sorted(items.items()))
    form, end = order, 0
    for offset, code in items:
        form += f'{offset - end}x{code}'
        end = offset + struct.calcsize(code)
    unpack = struct.Struct(form).unpack_from
    places = {offset: i for i, (offset, _) in enumerate(items)}
    pick = itemgetter(*sorted(places[at] for at in fixed))
    return Layout(order, items, unpack, pick, pick(unpack(raw)), places.get(stamp), places[value])


def field_reader(type_name, field, definition_text):
    """
    Return a reader of one numeric field of a message type.

    Parameters
    ----------
    type_name : str
        `pkg/msg/Type`.
    field : str
        Dotted path with indices, such as `accel.linear.z`, `data[3]` or
        `transforms[0].transform.translation.z`.
    definition_text : str
        Definition of the type in the ros2msg form, such as `definition_of` gives.

    Returns
    -------
    FieldReader

    Raises
    ------
    ValueError
        If the field does not exist or is not a number; the message lists those that are.

    """
    types = parse(type_name, definition_text)
    root = short_name(type_name)
    steps = _steps(types, root, field, type_name, definition_text)
    stamp = None
    for m in types[root]:
        if m.plain and m.name == 'header' and m.base == HEADER:
            stamp = 'header.stamp'
        elif m.plain and m.name == 'stamp' and m.base == TIME and stamp is None:
            stamp = 'stamp'
    stamp_steps = stamp and _steps(types, root, stamp, type_name, definition_text, leaf=False)
    return FieldReader(types, steps, stamp_steps)


def _steps(types, root, field, type_name, text, leaf=True):
    def fail(why):
        numbers = ', '.join(numeric_fields(type_name, text)) or 'none'
        raise ValueError(f'field {field!r} of {type_name}: {why}; its numeric fields: {numbers}')

    steps, at = [], root
    for word in field.split('.'):
        match = _STEP.fullmatch(word)
        if match is None:
            fail(f'{word!r} is not a name or name[index]')
        name, index = match[1], match[2][1:-1]
        members = types.get(at)
        if members is None:
            fail(f'{steps[-1].member.name} is a {at} and has no members')
        place = next((i for i, m in enumerate(members) if m.name == name), None)
        if place is None:
            fail(f'{at} has no member {name!r}')
        member = members[place]
        if member.plain == bool(index):
            fail(f'{name} is not an array' if index else f'{name} is an array: '
                 f'write {name}[0] for its first element')
        if member.count is not None and int(index or 0) >= member.count:
            fail(f'{name} has only {member.count} elements')
        steps.append(Step(members[:place], member, int(index or 0)))
        at = member.base
    if leaf and at not in SIZES:
        fail(f'it is a {at}, not a number')
    return tuple(steps)
