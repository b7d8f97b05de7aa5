"""
Frequency bins in which errors of a model do alike, merged: eq. (196).

Between resonances an error changes hundreds of bins in the same way. Their sum tells nearly as
much of it as each of them, and costs as one.
"""
from dataclasses import dataclass

from numba import njit
import numpy as np

from ssi_ros.hermitian import hermitian, inverse_root, traces_of_cubes, white_vectors

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

    def split(self, vectors, finer):
        """Return projected vectors, (n, g m), as on runs that these are made of, (n, h, m)."""
        at = np.searchsorted(self.edges, finer.edges[:-1], side='right') - 1
        shares = np.sqrt(np.diff(finer.edges) / np.diff(self.edges)[at])
        each = vectors.reshape(len(vectors), len(self.edges) - 1, -1)
        return each[:, at] * shares[:, None].astype(vectors.dtype)

    def means(self, values):
        """Return means over the bins of every run: (k, ...) becomes (g, ...)."""
        sums = np.add.reduceat(values, self.edges[:-1])
        return sums / np.diff(self.edges).reshape(-1, *(1,) * (values.ndim - 1))

    def cubes(self, vectors, channels):
        """Return sums of tr X^3 over all bins of projected vectors, (n, g l l), shape (n,)."""
        counts = np.diff(self.edges)
        return traces_of_cubes(vectors.reshape(
            len(vectors), len(counts), channels, channels)) @ counts ** -0.5


@dataclass(frozen=True, eq=False)
class WhiteChanges:
    """Changes of a spectrum S = L L^H as L^-1 whitens them, in runs of bins."""

    vectors: np.ndarray     # (n, g l l), float32, real vectors, projected
    factor: np.ndarray      # (k, l, l), complex64, L
    runs: BinRuns

    @classmethod
    def read(cls, file, number=''):
        """Return those of `arrays` in a file of arrays by name."""
        return cls(file[f'vectors{number}'], file[f'factor{number}'],
                   BinRuns(file[f'edges{number}']))

    def arrays(self, number=''):
        """Return its arrays by name, each with a number of this one."""
        return {f'vectors{number}': self.vectors, f'factor{number}': self.factor,
                f'edges{number}': self.runs.edges}

    def by(self, lower, runs, vectors):
        """
        Return changes as another model whitens them, by `lower`, (k, l, l), in finer runs.

        `vectors` are those of the record, or others in the same runs.
        """
        turn = runs.means(lower @ self.factor).astype(np.complex64)
        out = np.empty((len(vectors), turn.size), np.float32)
        for begin in range(0, len(vectors), TOGETHER):
            part = slice(begin, begin + TOGETHER)
            each = self.runs.split(vectors[part], runs).reshape(-1, *turn.shape)
            out[part] = white_vectors(turn, hermitian(each).astype(np.complex64))
        return out


def white_changes(changes, spectrum):
    """Return the WhiteChanges of changes (n, k, l, l) of a spectrum, (k, l, l), in every bin."""
    factor = np.linalg.cholesky(spectrum).astype(np.complex64)
    lower = inverse_root(spectrum).astype(np.complex64)
    bins = BinRuns(np.arange(len(spectrum) + 1))
    return WhiteChanges(bins.white(lower, changes), factor, bins)


def merged(vectors, factor):
    """Return WhiteChanges, of every bin by itself, in runs in which all of them do alike."""
    # and in which the model hardly changes: those are the runs of a record that it fits
    runs = runs_beside(runs_of_scores(vectors, len(factor)),
                       factor @ factor.conj().swapaxes(1, 2))
    return WhiteChanges(runs.projected(vectors), factor, runs)


def runs_beside(runs, model):
    """Return BinRuns in which a model, (k, l, l), hardly changes either."""
    logs = np.log(np.maximum(np.einsum('kii->ki', model).real, 1e-300))
    own = np.flatnonzero(_begins(logs[None], np.ones(1), RESOLVED ** 2 * logs.shape[1]))
    return BinRuns(np.union1d(runs.edges, own))


def runs_of_scores(vectors, bins):
    """Return the BinRuns of whitened changes of a spectrum, real vectors (n, k l l)."""
    if not len(vectors):
        return BinRuns(np.arange(bins + 1))
    # no array of all squares: those of many channels are gigabytes
    scales = 1 / np.sqrt(np.maximum(np.einsum('ni,ni->n', vectors, vectors), 1e-60))
    return BinRuns(np.append(np.flatnonzero(_begins(
        vectors.reshape(len(vectors), bins, -1), scales, OF_SCORES * len(vectors) / bins)), bins))


def _runs(vectors, bins, weight, information):
    """Return where runs of bins begin, (g,)."""
    # in deviations beside the record: sums over orthogonal errors do not depend on their choice
    squares, turn = np.linalg.eigh(information)
    shown = squares > SEEN * (1 + squares)
    if not shown.any():
        return np.zeros(1, int)         # of nothing all bins tell as much
    turn = turn[:, shown] * np.sqrt(weight / (1 + squares[shown]))
    looks = turn.T.astype(np.float32) @ vectors.astype(np.float32, copy=False)
    return np.flatnonzero(_begins(looks.reshape(len(looks), bins, -1), np.ones(len(looks)),
                                  LOST / bins))


@njit(cache=True, error_model='numpy')
def _begins(values, scales, limit):
    """Return which bins of (n, k, m), by scales (n,), a run begins at: squares stay below."""
    # in loops: numba takes five seconds to compile what copies a slice
    number, bins, width = values.shape
    begins, mean = np.empty(bins, np.bool_), np.empty((number, width), values.dtype)
    for n in range(number):
        for i in range(width):
            mean[n, i] = values[n, 0, i]
    begins[0], count, squares = True, 1, 0.0
    for k in range(1, bins):
        apart = 0.0
        for n in range(number):
            own = 0.0
            for i in range(width):
                own += (values[n, k, i] - mean[n, i]) ** 2
            apart += scales[n] ** 2 * own
        squares += apart * count / (count + 1)
        count += 1
        begins[k] = squares > limit * count
        if begins[k]:
            count, squares = 1, 0.0
            for n in range(number):
                for i in range(width):
                    mean[n, i] = values[n, k, i]
        else:
            for n in range(number):
                for i in range(width):
                    mean[n, i] += (values[n, k, i] - mean[n, i]) / count
    return begins
