"""A line that moves evenly, as the straight track of most power through short segments."""
from dataclasses import dataclass

from numba import njit
import numpy as np

LOUD = 8.0              # times what is usual, above which an impulse counts hardly more
HARDLY = 0.03           # of it, e-fold: of a strong chirp the middle still stands out
EDGE = 2                # bins beside zero and half of the rate, which hold the offset
LEAST = np.finfo(np.float32).min
HALF_LAPPED = 1 / 36    # correlation of powers of Hann segments that half overlap


@dataclass(frozen=True, eq=False)
class Track:
    """A straight track from the first to the last instant of a recording."""

    path: np.ndarray        # (k,), column of the cells in every segment
    start: float            # bins above zero frequency at the start of the recording
    end: float              # and at its end


def cells(values, rows):
    """
    Return the powers (k, f) of short segments over what is usual at their frequency and time.

    What is steady is in every segment, what is short in every bin; a chirp is in a few of both. Of
    a recording (n, l) in half-overlapping segments of an even number of rows, mean over the
    channels, beyond LOUD its logarithm; the first bin is EDGE bins above zero.
    """
    taper = np.hanning(rows + 2)[1:-1]
    segments = np.lib.stride_tricks.sliding_window_view(values, rows, axis=0)[::rows // 2]
    total = np.zeros((len(segments), rows // 2 + 1 - 2 * EDGE))
    for c in range(values.shape[1]):
        power = np.abs(np.fft.rfft(segments[:, c] * taper, axis=1)[:, EDGE:-EDGE]) ** 2
        total += power / _middle(power, 0)
    # an impulse, or a modulated level, is strong at all frequencies
    total /= _middle(total, 1)
    return np.minimum(total, LOUD * (1 + HARDLY * np.log(np.maximum(total / LOUD, 1.0))))


def _middle(power, axis):
    """Return the upper median, kept in its dimension: the mean of two would cost as much more."""
    half = power.shape[axis] // 2
    return np.maximum(np.partition(power, half, axis).take([half], axis), 1e-300)


def straight(powers, least, most):
    """Return the straight track of most power within the bins of `cells` (k, f), or None."""
    # Its ends are `least` to `most` bins apart, up or down.
    count, bins = powers.shape
    ways = np.arange(least, most + 1)
    ways = np.concatenate([-ways[::-1], ways])
    # the middle of the first segment is half a segment after the start, of the last before the end
    times = np.arange(1, count + 1) / (count + 1)
    shifts = np.rint(ways[:, None] * times).astype(np.int64)
    tops, starts = best_lines(powers.astype(np.float32), shifts, 0, bins)
    if not (starts >= 0).any():
        return None
    best = int(np.argmax(tops))
    start = float(EDGE + starts[best])
    return Track(starts[best] + shifts[best], max(start, 0.0), max(start + ways[best], 0.0))


@njit(cache=True, fastmath=True)
def best_lines(power, shifts, first, last):
    """
    Return the largest sums (s,) of float32 power (k, f) along lines, and the bins they start from.

    `shifts` (s, k) are the bins by which each line has moved in every segment. A line that does
    not fit between the bins `first` and `last` has the least of all numbers, and starts from -1.
    """
    # in loops: numba takes seconds to compile a method of an array
    tops, starts = np.empty(len(shifts), np.float32), np.empty(len(shifts), np.int64)
    for s in range(len(shifts)):
        tops[s], starts[s] = LEAST, -1
        low, high = first, last
        for i in range(shifts.shape[1]):
            low, high = max(low, first - shifts[s, i]), min(high, last - shifts[s, i])
        if high <= low:
            continue
        total = np.zeros(high - low, np.float32)
        for i in range(len(power)):
            row = power[i, low + shifts[s, i]:high + shifts[s, i]]
            for k in range(high - low):
                total[k] += row[k]
        best = 0
        for k in range(1, high - low):
            if total[k] > total[best]:
                best = k
        tops[s], starts[s] = total[best], low + best
    return tops, starts


def stds_of_ends(weights, duration_s):
    """Return the deviations of the first and the last frequency of a chirp of d' = 1, [Hz]."""
    # of a parabola through phases, known where the channels answer to an input, eq. (107a)
    t = np.linspace(0, duration_s, len(weights))
    curved = t ** 2 / (2 * duration_s)
    phase = np.column_stack([np.ones_like(t), 2 * np.pi * (t - curved), 2 * np.pi * curved])
    information = (phase * weights[:, None] ** 2).T @ phase / np.sum(weights ** 2)
    return np.sqrt(np.diag(np.linalg.inv(information)))[1:]
