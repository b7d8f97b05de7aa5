"""A line that moves evenly, as the straight track of most power through short pieces."""
from dataclasses import dataclass

from numba import njit
import numpy as np

LOUD = 8.0              # times what is usual, above which a knock counts hardly more
HARDLY = 0.03           # of it, e-fold: of a loud sweep the middle still stands out
EDGE = 2                # bins beside zero and half of the rate, which see the offset
HALF_LAPPED = 1 / 36    # correlation of powers of Hann pieces that half overlap


@dataclass(frozen=True, eq=False)
class Track:
    """
    A straight track from the first to the last instant of a recording.

    Attributes
    ----------
    path : ndarray of int, shape (k,)
        Row of the cells' bins in every piece.
    start, end : float
        Bins above zero frequency at both ends of the recording.

    """

    path: np.ndarray
    start: float
    end: float


def cells(values, rows):
    """
    Return the powers of short pieces over what is usual at their frequency and at their time.

    What is steady is in every piece, what is short in every bin; a sweep is in a few of both.

    Parameters
    ----------
    values : ndarray, shape (n, l)
        A recording.
    rows : int
        Of a piece, even; pieces half overlap.

    Returns
    -------
    ndarray, shape (k, f)
        Mean over the channels; beyond LOUD its logarithm. The first bin is EDGE bins above zero.

    """
    taper = np.hanning(rows + 2)[1:-1]
    pieces = np.lib.stride_tricks.sliding_window_view(values, rows, axis=0)[::rows // 2]
    total = np.zeros((len(pieces), rows // 2 + 1 - 2 * EDGE))
    for c in range(values.shape[1]):
        power = np.abs(np.fft.rfft(pieces[:, c] * taper, axis=1)[:, EDGE:-EDGE]) ** 2
        total += power / _middle(power, 0)
    # a pulse, or a level that swings, is loud at all frequencies
    total /= _middle(total, 1)
    return np.minimum(total, LOUD * (1 + HARDLY * np.log(np.maximum(total / LOUD, 1.0))))


def _middle(power, axis):
    """Return the upper median, kept in its dimension: the mean of two would cost as much more."""
    half = power.shape[axis] // 2
    return np.maximum(np.partition(power, half, axis).take([half], axis), 1e-300)


def straight(powers, least, most):
    """
    Return the straight track of most power, of all that stay within the bins.

    Parameters
    ----------
    powers : ndarray, shape (k, f)
        By piece and bin, of pieces that half overlap.
    least, most : int
        Bins between its ends, up or down.

    Returns
    -------
    Track or None
        None where there is none.

    """
    count, bins = powers.shape
    ways = np.arange(least, most + 1)
    ways = np.concatenate([-ways[::-1], ways])
    # the middle of the first piece is half a piece after the start, of the last before the end
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
    Return the largest sum of power along each of many lines, wherever it begins.

    Parameters
    ----------
    power : ndarray of float32, shape (k, f)
        By piece and bin.
    shifts : ndarray of int64, shape (s, k)
        Bins by which each line has moved in every piece.
    first, last : int
        Bins between which all of a line must lie.

    Returns
    -------
    tops : ndarray of float32, shape (s,)
        Least of all numbers for a line that does not fit between them.
    starts : ndarray of int64, shape (s,)
        Bin from which the best is shifted; -1 for none.

    """
    tops = np.full(len(shifts), np.finfo(np.float32).min, np.float32)
    starts = np.full(len(shifts), -1, np.int64)
    for s in range(len(shifts)):
        low, high = first - shifts[s].min(), last - shifts[s].max()
        low, high = max(low, first), min(high, last)
        if high <= low:
            continue
        total = np.zeros(high - low, np.float32)
        for i in range(len(power)):
            row = power[i, low + shifts[s, i]:high + shifts[s, i]]
            for k in range(high - low):
                total[k] += row[k]
        best = np.argmax(total)
        tops[s], starts[s] = total[best], low + best
    return tops, starts
