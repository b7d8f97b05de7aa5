"""Spectra that differ between the parts of a record, as sums of a few."""
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class WeightedSum:
    """
    Arrays of all parts of a record, by weights of a few: parts of an hour would take 0.1 GB.

    Attributes
    ----------
    few : ndarray, (n, ...)
        Real or complex.
    weights : ndarray, (a, n)
        Real, of these in every part.

    """

    few: np.ndarray
    weights: np.ndarray

    def changed(self, change):
        """Return what a linear function makes of it, a WeightedSum."""
        return replace(self, few=change(self.few))

    @property
    def each(self):
        """Return the arrays of all parts, (a, ...)."""
        few = np.ascontiguousarray(self.few)
        flat = few.reshape(len(few), -1).view(few.real.dtype)
        found = self.weights.astype(flat.dtype, copy=False) @ flat
        return found.view(few.dtype).reshape(len(found), *few.shape[1:])


def few_of(array):
    """Return the few of a WeightedSum; another array as it is."""
    return array.few if isinstance(array, WeightedSum) else array


def mean_of(array):
    """Return the mean over the parts of a WeightedSum, or of an array, (a, ...), shape (...)."""
    if isinstance(array, WeightedSum):
        return np.tensordot(array.weights.mean(axis=0), array.few, 1)
    return array.mean(axis=0)


def each_of(array):
    """Return a WeightedSum as an array, (a, ...); another array as it is."""
    return array.each if isinstance(array, WeightedSum) else array


def changed(array, change):
    """Return what a linear function makes of an array or a WeightedSum, such a one."""
    return array.changed(change) if isinstance(array, WeightedSum) else change(array)


def total_of(arrays):
    """Return the sum of arrays, (1, ...) or (a, ...), and WeightedSums: one of these if any is."""
    steady, varying = np.zeros(()), []
    for array in arrays:
        if isinstance(array, WeightedSum):
            varying.append(array)
        else:
            steady = steady + array if steady.ndim else array
    if not varying:
        return steady
    if len(np.atleast_1d(steady)) > 1:
        return steady + sum(a.each for a in varying)
    if np.any(steady):
        varying.append(WeightedSum(steady, np.ones((len(varying[0].weights), 1))))
    return WeightedSum(*(np.concatenate(x, axis) for x, axis in (
        ([a.few for a in varying], 0), ([a.weights for a in varying], 1))))


def interpolated(weights, arrays):
    """Return an array at times by weights (a, n) of those at n nodes, each as for `total_of`."""
    def at_times(i, array):
        column = weights[:, i:i + 1]
        if isinstance(array, WeightedSum):
            return replace(array, weights=column * array.weights)
        if len(array) > 1:
            return column.reshape(-1, *(1,) * (array.ndim - 1)) * array
        return WeightedSum(array, column)
    return total_of([at_times(i, a) for i, a in enumerate(arrays)])
