"""
Frequency bins in which errors of a model do alike, merged: eq. (196).

Between resonances an error changes hundreds of bins in the same way. Their sum tells nearly as
much of it as each of them, and costs as one.
"""
from dataclasses import dataclass

from numba import njit
import numpy as np

LOST = 0.01             # deviations squared that all errors together may lose, of what is known
SEEN = 0.02             # share of its variance that a record takes off an error that counts here


@dataclass(frozen=True, eq=False)
class MergedBins:
    """Runs of neighbouring bins, and the directions of errors in them."""

    vectors: np.ndarray     # (n, g l l), means over the bins of a run, as real vectors
    starts: np.ndarray      # (g,), first bins
    counts: np.ndarray      # (g,), bins of each

    def sums(self, values, axis=0):
        """Return sums over the bins of every run: (k, ...) becomes (g, ...)."""
        return np.add.reduceat(values, self.starts, axis=axis)

    def change(self, errors):
        """Return the change by errors (n,) in every run, (g, l l)."""
        # products of single precision take half of the time; what is summed of them does not
        return (errors.astype(self.vectors.dtype) @ self.vectors).astype(float).reshape(
            len(self.starts), -1)

    def slopes(self, values):
        """Return the products of all directions with values (g l l), (n,)."""
        return (self.vectors @ values.astype(self.vectors.dtype)).astype(float)


def merged_bins(vectors, bins, weight, information):
    """
    Return the MergedBins of directions.

    Parameters
    ----------
    vectors : ndarray, shape (n, k l l)
        Change of the whitened spectrum by every error.
    bins : int
        k.
    weight : float
        Periodograms that a bin of the record stands for.
    information : ndarray, shape (n, n)
        What the record tells of the errors, without their prior.

    """
    starts = _runs(vectors, bins, weight, information)
    counts = np.diff(np.append(starts, bins))
    means = np.add.reduceat(vectors.reshape(len(vectors), bins, -1), starts, axis=1) / (
        counts[:, None].astype(vectors.dtype))
    return MergedBins(means.reshape(len(vectors), -1), starts, counts)


def _runs(vectors, bins, weight, information):
    """Return where runs of bins begin, (g,)."""
    # in deviations beside the record: sums over orthogonal errors do not depend on their choice
    squares, turn = np.linalg.eigh(information)
    shown = squares > SEEN * (1 + squares)
    if not shown.any():
        return np.zeros(1, int)         # of nothing all bins tell as much
    turn = turn[:, shown] * np.sqrt(weight / (1 + squares[shown]))
    looks = turn.T.astype(np.float32) @ vectors.astype(np.float32, copy=False)
    return np.flatnonzero(_begins(np.ascontiguousarray(
        looks.reshape(len(looks), bins, -1).swapaxes(0, 1).reshape(bins, -1)), LOST / bins))


@njit(cache=True, error_model='numpy')
def _begins(rows, limit):
    """Return which rows (k, m) a run begins at: squares about its mean stay below a limit each."""
    begins = np.zeros(len(rows), np.bool_)
    mean, count, squares = rows[0].copy(), 1, 0.0
    begins[0] = True
    for k in range(1, len(rows)):
        apart = 0.0
        for i in range(rows.shape[1]):
            apart += (rows[k, i] - mean[i]) ** 2
        squares += apart * count / (count + 1)
        count += 1
        begins[k] = squares > limit * count
        if begins[k]:
            mean[:] = rows[k]
            count, squares = 1, 0.0
        else:
            for i in range(rows.shape[1]):
                mean[i] += (rows[k, i] - mean[i]) / count
    return begins
