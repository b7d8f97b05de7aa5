"""When to play each message of a bag, and stamps that never jump back in a loop."""
import itertools
import math
import struct

from .schema import HEADER, parse, short_name, TIME

_S = 1_000_000_000


def schedule(bag, *, rate=1.0, topics=None, start_s=0.0, duration_s=0.0, loop=False):
    """
    Return when each message of a bag is due.

    In a loop a pass begins one mean period of the fastest topic behind the end of the one before
    it, and log times and header stamps are shifted by that whole length. Log times never jump
    back; nor do the header stamps of a topic, unless its latency varies by more than a period.

    Parameters
    ----------
    bag : Bag
        An open bag.
    rate : float
        Seconds of the bag a second of time due.
    topics : sequence of str, optional
        Topics to play; all if not given.
    start_s, duration_s : float
        Part of the bag to play, from its first message [s]; a duration of 0 is to its end.
    loop : bool
        Begin anew at the end, for ever.

    Returns
    -------
    iterator of (due_s, topic, raw, stamp_ns)
        Time due since the start [s], rising; the message with shifted stamps; its shifted log
        time [ns].

    Raises
    ------
    ValueError
        If an option is out of range, a topic does not exist, or the part holds no message.

    """
    if not (math.isfinite(rate) and rate > 0):
        raise ValueError(f'rate={rate} must be a positive number')
    if not (math.isfinite(start_s) and start_s >= 0 and math.isfinite(duration_s)
            and duration_s >= 0):
        raise ValueError(f'start_s={start_s} and duration_s={duration_s} must be 0 or more [s]')
    first = bag.start_ns + round(start_s * _S)
    end = first + round(duration_s * _S) if duration_s else bag.end_ns + 1
    counts = [t.count for t in (bag.topics if topics is None else map(bag.topic, topics))]
    if next(bag.messages(topics, first, end), None) is None:
        part = f' for {duration_s:g} s' if duration_s else ''
        raise ValueError(f'{bag.path} has no message from {start_s:g} s on{part}; it is '
                         f'{(bag.end_ns - bag.start_ns) / _S:g} s long')
    last = min(end - 1, bag.end_ns)
    # A period of the fastest topic parts two passes, so that its grid goes on.
    gap = (bag.end_ns - bag.start_ns) // max(1, max(counts, default=1) - 1)
    length = max(end - first if duration_s and end <= bag.end_ns else last - first + gap, 1)
    passes = itertools.count() if loop else (0,)
    shifters = {t.name: stamp_shifter(t.type, t.definition) for t in bag.topics
                if topics is None or t.name in topics} if loop else {}

    def plan():
        for n in passes:
            by = n * length
            for topic, log_ns, _, raw in bag.messages(topics, first, end):
                if by and shifters[topic] is not None:
                    raw = shifters[topic](raw, by)
                yield (log_ns + by - first) / (rate * _S), topic, raw, log_ns + by
    return plan()


def stamp_shifter(type_name, definition_text):
    """
    Return a function that shifts the stamp of a message.

    Parameters
    ----------
    type_name, definition_text : str
        `pkg/msg/Type` and its definition in the ros2msg form.

    Returns
    -------
    callable or None
        `shift(raw, by_ns) -> raw`, which adds to the stamp of the header (or a top-level stamp)
        and leaves a stamp of 0 as it is; None for a type that does not begin with one.

    """
    try:
        first = parse(type_name, definition_text)[short_name(type_name)][0]
    except ValueError:                # no definition in the bag: its stamps cannot be found
        return None
    if not first.plain or (first.name, first.base) not in (
            ('header', HEADER), ('stamp', TIME), ('clock', TIME)):
        return None
    return shift_first_stamp


def shift_first_stamp(raw, by_ns):
    """
    Return a CDR message whose first 8 bytes, a time, are moved on by `by_ns`.

    One that is too short to hold it, or whose time would leave those of ROS, stays as it is.
    """
    if len(raw) < 12:
        return raw
    form = struct.Struct('<iI' if raw[1] else '>iI')
    sec, nanosec = form.unpack_from(raw, 4)
    if not (sec or nanosec):
        return raw
    moved = divmod(sec * _S + nanosec + by_ns, _S)
    return raw[:4] + form.pack(*moved) + raw[12:] if moved[0] < 2 ** 31 else raw
