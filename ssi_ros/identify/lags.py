"""
Lag products of a stream: the ring of hop blocks, and the covariances of its window.

Eq. (42) to (44) of docs/theory-identification.md. Only the products of the new hop are formed;
the window is the sum of a ring of hop blocks, kept by a binary tree of partial sums, so nothing
is ever subtracted and nothing drifts.
"""
from dataclasses import dataclass

import numpy as np


def lag_products(past, rows, lags):
    """
    Return the products of every row with the rows up to `lags` before it.

    Parameters
    ----------
    past : ndarray, shape (lags, l)
        The rows before; NaN where missing.
    rows : ndarray, shape (n, l)
        The rows of the block; NaN where missing.
    lags : int
        Longest lag K.

    Returns
    -------
    products : ndarray, shape (K + 1, l, l)
        Sum over the block of y(t) y(t - k)^T over the pairs that are present, eq. (42).
    counts : ndarray, shape (K + 1, l, l), or int
        How many pairs; one number where no sample is missing.

    """
    n, width = rows.shape
    every = np.concatenate([past, rows])
    present = ~np.isnan(every)
    if present.all():
        return _products(every, rows, n, lags, width), n
    mask = present.astype(float)
    every = np.where(present, every, 0.0)
    return (_products(every, every[lags:], n, lags, width),
            np.rint(_products(mask, mask[lags:], n, lags, width)).astype(np.int64))


def _products(every, rows, n, lags, width):
    every = np.ascontiguousarray(every)
    step = every.strides[0]
    # row t holds y(t - K) ... y(t), side by side: one matrix product gives all lags
    table = np.lib.stride_tricks.as_strided(
        every, (n, (lags + 1) * width), (step, every.itemsize))
    products = rows.T @ table
    return products.reshape(width, lags + 1, width).transpose(1, 0, 2)[::-1]


@dataclass(frozen=True)
class Covariances:
    """
    Output covariances of a window.

    Attributes
    ----------
    values : ndarray, shape (K + 1, l, l)
        Lambda_k = E[y(t) y(t - k)^T] of the scaled channels, eq. (43).
    scale : ndarray, shape (l,)
        What the channels were divided by: their standard deviation in the window.
    blocks : ndarray, shape (m, (K + 1) l l)
        The same per data block, each as a share of the window: they sum to the window.
    block_s : float
        Length of a block [s].
    counts : float
        Least number of pairs behind a value.
    pairs : ndarray, shape (K + 1, l, l)
        Number of pairs behind every value.

    """

    values: np.ndarray
    scale: np.ndarray
    blocks: np.ndarray
    block_s: float
    counts: float
    pairs: np.ndarray

    @property
    def held_s(self):
        """Length of what the data blocks hold [s]."""
        return len(self.blocks) * self.block_s

    def of(self, channels):
        """Return the covariances of some of the channels, given by a mask."""
        if channels.all():
            return self
        pick = np.ix_(np.ones(len(self.values), dtype=bool), channels, channels)
        blocks = self.blocks.reshape(len(self.blocks), *self.values.shape)
        blocks = blocks[np.ix_(np.ones(len(blocks), dtype=bool),
                               np.ones(len(self.values), dtype=bool), channels, channels)]
        return Covariances(self.values[pick], self.scale[channels],
                           blocks.reshape(len(blocks), -1), self.block_s,
                           self.pairs[pick].min(), self.pairs[pick])


class Ring:
    """The hop blocks of one band over one window, and their sum."""

    def __init__(self, hops, lags, channels):
        self.hops, self.lags = hops, lags
        # node j of the tree is the sum of nodes 2j and 2j + 1; the leaves are hops ... 2 hops - 1
        self.tree = np.zeros((2 * hops, lags + 1, channels, channels))
        self.sums = np.zeros((hops, channels))
        self.present = np.zeros((hops, channels), dtype=np.int64)
        self.pairs = [0] * hops
        self.total = np.zeros((lags + 1, channels, channels), dtype=np.int64)
        self.past = np.full((lags, channels), np.nan)
        self.pushed = 0

    def push(self, rows):
        """Book the products of one hop of rows in place of the oldest hop."""
        slot = self.pushed % self.hops
        products, pairs = lag_products(self.past, rows, self.lags)
        self.past = np.concatenate([self.past, rows])[len(rows):]
        self.total += pairs - self.pairs[slot]          # whole numbers: exact, no drift
        self.pairs[slot] = pairs
        self.sums[slot] = np.nansum(rows, axis=0)
        self.present[slot] = np.count_nonzero(~np.isnan(rows), axis=0)
        node = self.hops + slot
        self.tree[node] = products
        node //= 2
        while node:
            np.add(self.tree[2 * node], self.tree[2 * node + 1], out=self.tree[node])
            node //= 2
        self.pushed += 1

    @property
    def filled(self):
        """Return the number of hops that hold data."""
        return min(self.pushed, self.hops)

    @property
    def full(self):
        """Tell whether every hop holds data."""
        return self.pushed >= self.hops

    def covariances(self, hop_s, blocks_max=20):
        """
        Return the covariances of what the ring holds, eq. (43), and their data blocks.

        The mean of the window is removed; the channels are scaled to unit variance so that
        neither units nor gains matter. A channel without variance keeps the scale 0.
        """
        counts = np.maximum(self.total, 1)
        samples = np.maximum(self.present.sum(axis=0), 1)
        mean = self.sums.sum(axis=0) / samples
        values = self.tree[1] / counts - np.outer(mean, mean)
        scale = np.sqrt(np.maximum(np.diagonal(values[0]), 0.0))
        unit = np.where(scale > 0.0, scale, 1.0)
        weight = 1.0 / np.outer(unit, unit)
        size = max(1, -(-self.filled // blocks_max))
        number = self.filled // size
        leaves = self.tree[self.hops:self.hops + number * size]
        blocks = leaves.reshape(number, size, -1).sum(axis=1)
        blocks *= (weight / counts).reshape(1, -1)
        return Covariances(values * weight, scale, blocks, size * hop_s, float(counts.min()),
                           counts)
