"""
Between records and messages: windows of modes as DiagnosticArray and Float64MultiArray.

Numbers are written with `repr`, so that what is read back is equal to the bit.
"""
import array
import json
import math
import time

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
import numpy as np
from ssi_ros.identify.traced import TracedWindow
from ssi_ros.records import Mode
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

DATES_S = 86400 * 365       # stamps of a simulated clock that begins at 0 are no dates
EVENTS = ('births', 'deaths', 'splits', 'merges')
SERIES = ('frequency_hz', 'frequency_std_hz', 'damping_ratio', 'damping_ratio_std')
SLOTTED = (*SERIES, 'identity')         # one number a mode, published in slots


def time_of(stamp_ns):
    """Return a Time message of a stamp [ns]; ValueError beyond 1970 to 2038, which it can hold."""
    seconds, rest = divmod(int(stamp_ns), 1_000_000_000)
    if not 0 <= seconds < 2 ** 31:
        raise ValueError(f'the time {stamp_ns} ns is outside of those of a ROS message, 1970 to '
                         '2038')
    return Time(sec=seconds, nanosec=rest)


def stamp_of(stamp):
    """Return the stamp [ns] of a Time message."""
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def clock_words(stamp_ns):
    """Return a stamp as words: the time of day in UTC, or seconds where it is no date."""
    seconds, rest = divmod(int(stamp_ns), 1_000_000_000)
    if seconds < DATES_S:
        return f'{stamp_ns * 1e-9:.3f} s'
    return time.strftime('%H:%M:%S', time.gmtime(seconds)) + f'.{rest // 100_000_000} UTC'


def status(name, level, message, **values):
    """Return a DiagnosticStatus; level is 'ok', 'warn', 'error' or 'stale'."""
    return DiagnosticStatus(
        name=name, level=getattr(DiagnosticStatus, level.upper()), message=message,
        values=[KeyValue(key=k, value=_text(v)) for k, v in values.items()])


def _text(value):
    return value if isinstance(value, str) else repr(value)


def modes_message(window, slots=None):
    """
    Return a window as DiagnosticArray: the window's own status, then one a mode.

    The header carries the window's end. A mode that is surely of the structure is OK, an input
    line or an undecided pole is WARN.
    """
    slots = slots or {}
    reason = window.reason or f'{len(window.modes)} modes'
    out = [status('window', 'ok' if window.modes else 'warn', reason,
                  start_ns=window.start_ns, end_ns=window.end_ns, reason=window.reason,
                  **{name: json.dumps(getattr(window, name, ())) for name in EVENTS})]
    for m in window.modes:
        out.append(status(
            f'mode {m.identity}', 'ok' if m.label == 'structural' else 'warn',
            f'{m.frequency_hz:.4f} Hz, damping {100 * m.damping_ratio:.2f} %, {m.label}',
            identity=m.identity, slot=slots.get(m.identity, -1), label=m.label,
            **{name: float(getattr(m, name)) for name in SERIES},
            shape=json.dumps([[z.real, z.imag] for z in m.shape.tolist()]),
            shape_std=json.dumps(m.shape_std.tolist()), note=m.note))
    msg = DiagnosticArray(status=out)
    msg.header.stamp = time_of(window.end_ns)
    return msg


def window_of(msg):
    """Return the window that `modes_message` wrote, equal to the bit."""
    head, *rest = ({kv.key: kv.value for kv in s.values} for s in msg.status)
    modes = [Mode(identity=int(v['identity']), label=v['label'], note=v['note'],
                  shape=[complex(re, im) for re, im in json.loads(v['shape'])],
                  shape_std=json.loads(v['shape_std']) if 'shape_std' in v else None,
                  **{name: float(v[name]) for name in SERIES}) for v in rest]
    events = {name: tuple(tuple(e) if isinstance(e, list) else e
                          for e in json.loads(head.get(name, '[]'))) for name in EVENTS}
    return TracedWindow(int(head['start_ns']), int(head['end_ns']), tuple(modes), head['reason'],
                        **events)


def series_message(window, name, slots, size):
    """
    Return one number of every mode in fixed slots; NaN in a slot without a mode.

    The message has no header, so the second dimension's label carries the window's end.
    """
    values = array.array('d', [math.nan]) * size
    for m in window.modes:
        slot = slots.get(m.identity, -1)
        if slot >= 0:
            values[slot] = float(getattr(m, name))
    layout = MultiArrayLayout(dim=[
        MultiArrayDimension(label='slot', size=size, stride=size),
        MultiArrayDimension(label=f'window_end_ns={window.end_ns}', size=1, stride=1)])
    return Float64MultiArray(layout=layout, data=values)


def shape_message(window, slots, size, channels):
    """
    Return the shape of every mode in fixed slots: slot x channel x (real, imaginary part).

    The labels name the channels and the window's end; NaN in a slot without a mode.
    """
    values = np.full((size, len(channels), 2), math.nan)
    for m in window.modes:
        slot = slots.get(m.identity, -1)
        if slot >= 0:
            values[slot] = np.stack([m.shape.real, m.shape.imag], axis=-1)
    width = 2 * len(channels)
    layout = MultiArrayLayout(dim=[
        MultiArrayDimension(label='slot', size=size, stride=size * width),
        MultiArrayDimension(label=','.join(channels), size=len(channels), stride=width),
        MultiArrayDimension(label=f'window_end_ns={window.end_ns}', size=2, stride=2)])
    message = Float64MultiArray(layout=layout)
    message.data.frombytes(values.tobytes())
    return message


class Slots:
    """
    Which slot a mode's numbers are published in: the lowest free one, kept for its life.

    A mode that misses a window keeps its slot; one that died frees it.
    """

    def __init__(self, size):
        self.size = size
        self.of = {}

    def update(self, window):
        """Follow a window; return the identities that found no slot."""
        without = []
        for identity in window.deaths:
            self.of.pop(identity, None)
        for m in window.modes:
            if m.identity not in self.of:
                free = set(range(self.size)) - set(self.of.values())
                if free:
                    self.of[m.identity] = min(free)
                else:
                    without.append(m.identity)
        return without
