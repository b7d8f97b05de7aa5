"""From a bag's channels, each with its own stamps, to samples on one even grid."""
from dataclasses import replace

import numpy as np

from ssi_ros.identify.grid import Grid
from ssi_ros.identify.offsets import compared_there, EDGE, late_by, offsets, together
from ssi_ros.identify.pace import misfit
from ssi_ros.identify.stamps import batches, nothing_on
from ssi_ros.records import Samples

TOGETHER_NS = 300_000_000_000       # of all channels, well below the gap of a new segment


def samples_of(recording, rate_hz=0.0, say=None, *, staggered=False):
    """
    Bring the channels of a recording onto one even grid; a missing sample is NaN.

    Parameters
    ----------
    recording : Recording
        Of `bag.read_channels`.
    rate_hz : float
        Sampling rate [Hz]; 0 estimates it from the stamps.
    say : callable, optional
        Called with a sentence where channels are sampled at different instants.
    staggered : bool
        Whether they stay as they were sampled, `Samples.late`; else they are moved.

    Returns
    -------
    Samples

    Raises
    ------
    ValueError
        Without samples, if a channel comes at another rate than the one given or that of the
        others, or if the clock or a rate jumps in the record.

    """
    if rate_hz:
        _check_rate(recording, rate_hz)
    grid = Grid(recording.names, rate_hz)
    # as they came: a whole channel before the next would seem to turn the clock back
    for parts in batches(recording.arrivals_ns, TOGETHER_NS):
        for i, part in enumerate(parts):
            grid.push(i, recording.stamps_ns[i][part], recording.values[i][part])
    rows = grid.rows(flush=True)
    if not rows:
        raise ValueError(nothing_on(grid))
    for at_ns, name in grid.turns:
        at_s = (at_ns - rows[0].origin_ns) * 1e-9
        raise ValueError(f'the rate of {name} changes before {at_s:.1f} s; cut the record there '
                         'and give one end')
    if not rate_hz:
        _check_rate(recording, grid.rate_hz)
    if len({r.segment for r in rows}) > 1:
        raise ValueError('the clock of the bag jumps; cut the bag there and give one end')
    found = _offsets(recording, rows, grid.offsets())
    sampled = rows[0].values if len(rows) == 1 else np.concatenate([r.values for r in rows])
    if staggered:
        late = late_by(found, recording.names)
        if any(late) and say is not None:
            say(compared_there(late, recording.names, rows[0].rate_hz))
        return Samples(sampled, rows[0].rate_hz, recording.names, rows[0].origin_ns,
                       late=late if any(late) else ())
    values, moved = together(sampled, found, recording.names, rows[0].rate_hz)
    if moved and say is not None:
        say(moved)
    first, last = (EDGE, -EDGE) if moved and len(values) > 4 * EDGE else (0, None)
    return Samples(values[first:last], rows[0].rate_hz, recording.names,
                   rows[0].origin_ns + round(first * 1e9 / rows[0].rate_hz),
                   sampled[first:last] if moved else None,
                   tuple(f.offset for f in found) if moved else ())


def _offsets(recording, rows, placed):
    """Return the Offset of every channel within the rows, where a grid has placed them."""
    last = rows[-1]
    end_ns = last.origin_ns + round((last.first + len(last.values)) * 1e9 / last.rate_hz)
    found = offsets(recording.stamps_ns, last.rate_hz, last.origin_ns, end_ns)
    # stamps alone do not say which of its samples is in the row of another channel
    return [f if np.isnan(p) else replace(f, offset=f.offset + float(np.rint(p - f.offset)))
            for f, p in zip(found, placed)]


def _check_rate(recording, rate_hz):
    """Raise ValueError where channels do not come at the rate, given or that of the others."""
    wrong, fitting = {}, np.empty(0, np.int64)
    for name, stamps in zip(recording.names, recording.stamps_ns):
        # channels of one message have the same stamps
        if not np.array_equal(stamps, fitting):
            if word := misfit(name, stamps, rate_hz):
                wrong[name] = word
            else:
                fitting = stamps
    if not wrong:
        return
    some = list(wrong.values())[:1 if len(wrong) == len(recording.names) else None]
    sentence = ', '.join(some) + f', not at the {rate_hz:.5g} Hz'
    if len(wrong) == len(recording.names):
        raise ValueError(f'{sentence} asked for; set rate_hz to its rate, in the spacecraft YAML '
                         'if there is a model')
    raise ValueError(f'{sentence} of the others: channels of one record have to share a rate, for '
                     'samples interpolated from one to another are not what was measured; '
                     'record them at one rate, or leave the channel out of the bag')
