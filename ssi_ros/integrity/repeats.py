"""Stuck channels and repeated samples, from the samples themselves."""
import numpy as np

from ssi_ros.arrays import runs
from ssi_ros.integrity.fault import Fault
from ssi_ros.integrity.thresholds import LIMITS
from ssi_ros.integrity.values import EQUAL, limit_of, step_of

LONGER, COMMON = 5, 0.99        # times as long as so many runs of equal values are: stuck
ROUNDED = 1.5           # times the equal neighbours that rounding makes by itself
SURE = 4.0              # deviations by which they are more, counted as events by chance are
FEW_VALUES = 8          # of which any repeats itself
TOGETHER = 4096         # values that are looked at for different ones at once
FEW_ROWS = 3            # that repeat: fewer change no answer
WELL_RESOLVED = 3.0     # steps of rounding in an rms, below which values repeat anyway


def faults_of_samples(samples):
    """Return faults: stuck channels and repeated samples; NaN is a missing sample."""
    stuck, repeated, rate_hz = {}, {}, samples.rate_hz      # size and text by channel
    for channel, column in zip(samples.channels, samples.values.T):
        frozen, share, every = _equal_neighbours(column)
        if len(frozen):
            first, last = max(frozen, key=lambda run: run[1] - run[0])
            stuck[channel] = ((frozen[:, 1] - frozen[:, 0] + 1).sum() / rate_hz,
                              f'{channel} is stuck at {column[first]:.4g} m/s^2 for '
                              f'{(last - first + 1) / rate_hz:.4g} s from {first / rate_hz:.4g} s')
        if share:
            repeated[channel] = (share, f'{channel} has a new sample only every {every} samples'
                                 if every > 1 else f'{channel} repeats {100 * share:.2g} % of its '
                                 'samples')
    if not (stuck or repeated):
        rows = _repeated_rows(samples.values)
        if rows:
            share = rows / len(samples.values)
            return (Fault('repeated samples', dict.fromkeys(samples.channels, float(share)),
                          f'All channels repeat {rows} of {len(samples.values)} rows at once, as '
                          'where a recorder fills gaps with the last row.', 0.0),)
    return tuple(
        Fault(kind, {c: float(size) for c, (size, _) in found.items()},
              f'Channel {"; channel ".join(text for _, text in found.values())}.', 0.0)
        for kind, found in (('stuck channel', stuck), ('repeated samples', repeated)) if found)


def _repeated_rows(values):
    """Return how many rows all channels repeat at once, 0 where rounding may do that."""
    equal = values[1:] == values[:-1]
    rows = np.count_nonzero(equal.all(axis=1))
    if rows < FEW_ROWS:
        return 0
    # at a turning point of the motion rounded channels repeat themselves together
    fine = [c for c in values.T if not step_of(c) and _few(c[np.isfinite(c)]) == FEW_VALUES]
    own = np.sort(np.count_nonzero(equal, axis=0))[:2] - rows
    return rows if len(fine) > 1 and own.max() < rows else 0


def _few(values):
    """Return how many different values there are, FEW_VALUES if there are more."""
    different = values[:0]
    for part in np.array_split(values, max(1, len(values) // TOGETHER)):
        different = np.union1d(different, part)[:FEW_VALUES]
        if len(different) == FEW_VALUES:
            break
    return len(different)


def _equal_neighbours(column):
    """
    Return stuck intervals (r, 2) of a channel, the share of other repeated samples, their period.

    Values at a clipping limit do not count, nor equal neighbours by rounding: as many as a
    Gaussian has at 0 that has so many at 1 and 2 steps.
    """
    nothing, step, limit = (np.zeros((0, 2), int), 0.0, 1), step_of(column), limit_of(column)
    distinct = _few(column[np.isfinite(column)])
    if 1 < distinct < FEW_VALUES or step and np.nanstd(column) < WELL_RESOLVED * step:
        return nothing
    equal = column[1:] == column[:-1]
    if limit and distinct > 1:
        equal &= np.abs(column[1:]) < limit * (1 - EQUAL)
    found = np.array(runs(equal), int).reshape(-1, 2)
    if not len(found):
        return nothing
    lengths, changed = found[:, 1] - found[:, 0], ~equal & np.isfinite(np.diff(column))
    # every value begins a run, mostly of itself alone
    usual, rank = np.sort(lengths)[::-1], max(1, int((1 - COMMON) * np.count_nonzero(~equal)))
    usual = 1 + (usual[rank] if rank < len(usual) else 0)
    stuck = lengths + 1 >= max(LONGER * usual, LIMITS.stuck_samples.value)
    repeats, at = lengths[~stuck].sum(), np.flatnonzero(changed)
    every = int(np.gcd.reduce(np.diff(at))) if repeats and len(at) > 2 else 1
    if repeats and every == 1:
        # rounding too fine for `step_of` still makes equal neighbours
        jumps = np.abs(np.diff(column)[changed])
        jumps = np.rint(jumps / (step or jumps.min()))
        one, two = np.count_nonzero(jumps == 1) / 2, np.count_nonzero(jumps == 2) / 2
        rounded = one * max(one / max(two, 1), 1) ** (1 / 3)
        more = repeats - rounded
        sure = more > SURE * np.sqrt(repeats + rounded)
        repeats = more if sure and repeats > ROUNDED * rounded else 0
    share = repeats / max(repeats + len(at), 1)
    return found[stuck], float(share) * (share > LIMITS.repeated_share.value), every
