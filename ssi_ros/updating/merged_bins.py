"""
Frequency bins in which errors of a model do alike, merged: eq. (196).

Between resonances an error changes hundreds of bins in the same way. Their sum tells nearly as
much of it as each of them, and costs as one.
"""
from dataclasses import dataclass

from numba import njit
import numpy as np

from ssi_ros.hermitian import traces_of_cubes, white_vectors

LOST = 0.01             # deviations squared that all errors together may lose, of what is known
OF_SCORES = 0.003       # share of what a record shows of effects that their scores may lose,
RESOLVED = 0.1          # beside models whose logarithm hardly differs within a run
TOGETHER = 32           # directions that are whitened at a time
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


@dataclass(frozen=True, eq=False)
class BinRuns:
    """Runs of bins that count as one in scores; what they lose is power, never validity."""

    edges: np.ndarray       # (g + 1,), first bins, and how many bins there are

    def projected(self, vectors):
        """Return vectors (n, k m) as (n, g m): sums over roots of counts, which keep products."""
        starts, bins = self.edges[:-1], self.edges[-1]
        if len(starts) == bins:
            return vectors
        width = vectors.shape[1] // bins
        each = np.add.reduceat(vectors.reshape(len(vectors), bins, width), starts, axis=1)
        each /= np.sqrt(np.diff(self.edges), dtype=vectors.dtype)[:, None]
        return each.reshape(len(each), len(starts) * width)

    def white(self, lower, changes):
        """Return changes (n, k, l, l) whitened, as real vectors, projected."""
        size = (len(self.edges) - 1) * lower.shape[-1] ** 2
        out = np.empty((len(changes), size), lower.real.dtype)
        for begin in range(0, len(changes), TOGETHER):
            part = slice(begin, begin + TOGETHER)
            out[part] = self.projected(white_vectors(lower, changes[part]))
        return out

    def cubes(self, vectors, channels):
        """Return sums of tr X^3 over all bins of projected vectors, (n, g l l), shape (n,)."""
        counts = np.diff(self.edges)
        return traces_of_cubes(vectors.reshape(
            len(vectors), len(counts), channels, channels)) @ counts ** -0.5


def runs_beside(runs, model):
    """Return BinRuns in which a model, (k, l, l), hardly changes either; of None every bin."""
    if runs is None:
        return BinRuns(np.arange(len(model) + 1))
    logs = np.log(np.maximum(np.einsum('kii->ki', model).real, 1e-300))
    own = np.flatnonzero(_begins(np.ascontiguousarray(logs), RESOLVED ** 2 * logs.shape[1]))
    return BinRuns(np.union1d(runs.edges, own))


def runs_of_scores(lower, changes):
    """Return the BinRuns of changes of a spectrum, (n, k, l, l), as `lower`, L^-1, whitens."""
    bins = changes.shape[1]
    if not len(changes):
        return BinRuns(np.arange(bins + 1))
    vectors = white_vectors(lower.astype(np.complex64), changes).reshape(len(changes), bins, -1)
    vectors /= np.maximum(np.linalg.norm(vectors, axis=(1, 2)), 1e-30)[:, None, None]
    rows = np.ascontiguousarray(vectors.swapaxes(0, 1)).reshape(bins, -1)
    return BinRuns(np.append(np.flatnonzero(
        _begins(rows, OF_SCORES * len(changes) / bins)), bins))


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
