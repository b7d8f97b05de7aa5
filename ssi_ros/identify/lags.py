"""
Lag products of a stream: the ring of hop blocks, and the covariances of its window.

Eq. (42) to (44) of docs/theory-identification.md. Only the products of the new hop are formed;
the window is the sum of a ring of hop blocks, kept by a binary tree of partial sums, so nothing
is ever subtracted and nothing drifts.
"""
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, rfft

BLOCKS = 20             # data blocks of a window, from whose scatter the spreads come
PRESENT_MIN = 0.5       # share of its samples that a channel must have in a block to be there
STILL = 1e-12           # variance over mean square of a block in which a channel stands still
FAINT = 1e-140          # no signal [units of the channel]: squares of it would vanish
TOGETHER = 16           # segments transformed at a time: what they need stays in the cache


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
        self.size = max(1, -(-hops // BLOCKS))      # hops a data block
        self.blocks = np.zeros((hops // self.size, lags + 1, channels, channels))
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
        block = slot // self.size
        if block < len(self.blocks):
            first = self.hops + block * self.size
            self.tree[first:first + self.size].sum(axis=0, out=self.blocks[block])
        self.pushed += 1

    @property
    def filled(self):
        """Return the number of hops that hold data."""
        return min(self.pushed, self.hops)

    @property
    def full(self):
        """Tell whether every hop holds data."""
        return self.pushed >= self.hops

    def absent(self):
        """
        Tell where channels bring nothing: most of their samples are missing, or they stand still.

        Returns
        -------
        absent : ndarray of bool, shape (m, l)
            Of every block of hops.
        block_of : ndarray of int, shape (filled,)
            To which block a hop belongs.

        """
        filled = self.filled
        block_of = np.arange(filled) * min(BLOCKS, filled) // max(1, filled)
        first = np.searchsorted(block_of, np.arange(block_of[-1] + 1)) if filled else []
        number, total, squares = (np.add.reduceat(x[:filled], first, axis=0) for x in (
            self.present, self.sums,
            np.diagonal(self.tree[self.hops:, 0], axis1=1, axis2=2)))
        still = squares - total ** 2 / np.maximum(number, 1) <= STILL * squares
        # a block of one or two rows has no variance to speak of
        still &= number > 3
        expected = np.bincount(block_of)[:, None] * self.present.max()
        return still | (number < PRESENT_MIN * expected), block_of

    def covariances(self, hop_s, keep=None):
        """
        Return the covariances of what the ring holds, eq. (43), and their data blocks.

        The mean of the window is removed; the channels are scaled to unit variance so that
        neither units nor gains matter. A channel without variance keeps the scale 0.

        Parameters
        ----------
        hop_s : float
            Length of a hop [s].
        keep : ndarray of bool, shape (filled,), optional
            The hops that count; all of them if it is not given.

        """
        if keep is not None and not keep.all():
            own = np.flatnonzero(keep)
            groups = np.array_split(own, min(BLOCKS, len(own)))
            blocks = np.array([self.tree[self.hops + g].sum(axis=0) for g in groups])
            pairs = sum(np.broadcast_to(self.pairs[k], self.total.shape) for k in own)
            mean = self.sums[own].sum(axis=0) / np.maximum(self.present[own].sum(axis=0), 1)
            return _scaled(blocks.sum(axis=0), np.maximum(pairs, 1), mean, blocks,
                           len(own) / len(groups) * hop_s)
        counts = np.maximum(self.total, 1)
        samples = np.maximum(self.present.sum(axis=0), 1)
        size, blocks = self.size, self.blocks
        if not self.full:
            size = max(1, -(-self.filled // BLOCKS))
            leaves = self.tree[self.hops:self.hops + self.filled // size * size]
            blocks = leaves.reshape(-1, size, *leaves.shape[1:]).sum(axis=1)
        return _scaled(self.tree[1], counts, self.sums.sum(axis=0) / samples, blocks, size * hop_s)


def output_covariances(values, lags, rate_hz=1.0):
    """
    Return the covariances of a whole record, eq. (43), without data blocks.

    Cut into segments longer than the lags; the transform of each serves its pairs with itself
    and with the segment before.

    Parameters
    ----------
    values : ndarray, shape (n, l)
        The record; NaN where missing.
    lags : int
        Longest lag K.
    rate_hz : float
        Sampling rate [Hz].

    Returns
    -------
    Covariances

    """
    values = np.asarray(values, dtype=float)
    n, width = values.shape
    size = 1 << max(7, int(lags).bit_length())       # > K; of shorter ones the calls would cost
    present = ~np.isnan(values)
    if present.all():
        mean = np.ones(n) @ values / n               # BLAS: ten times the speed of mean(axis=0)
        products = _segments(values, mean, lags, size)
        counts = np.broadcast_to(np.maximum(n - np.arange(lags + 1), 1)[:, None, None],
                                 products.shape)
    else:
        mean = np.nansum(values, axis=0) / np.maximum(present.sum(axis=0), 1)
        products = _segments(np.where(present, values, mean), mean, lags, size)
        there = _segments(present.astype(float), np.zeros(width), lags, size)
        counts = np.maximum(np.rint(there), 1.0)
    none = np.empty((0, lags + 1, width, width))
    return _scaled(products, counts, np.zeros(width), none, n / rate_hz)


def _segments(values, mean, lags, size):
    """Return the sums of y(t) y(t - k)^T for k = 0 ... K by transforms of segments."""
    width = values.shape[1]
    means = np.tile(mean, TOGETHER)       # a short last axis is slow to broadcast over
    # the segment before lies one size earlier: a change of sign at every second frequency
    sign = ((-1.0) ** np.arange(size + 1))[:, None, None]
    own, lines = np.zeros((size + 1, 2 * width, 2 * width)), np.zeros((size + 1, 1, 2 * width))
    for first in range(0, len(values), TOGETHER * size):
        part = values[first:first + TOGETHER * size]
        number, whole = -(-len(part) // size), len(part) // size
        rest = len(part) - whole * size
        pieces = np.zeros((2 * size, number, width))        # time within the segment goes first
        pieces[:size, :whole] = part[:whole * size].reshape(whole, size, width).transpose(1, 0, 2)
        pieces[:rest, whole:] = part[whole * size:, None]
        pieces[:size].reshape(size, -1)[:] -= means[:number * width]
        pieces[rest:, whole:] = 0.0
        # real and imaginary parts side by side, (frequencies, segments, 2 l): real products
        before, lines = lines[:, -1:], rfft(pieces, axis=0, overwrite_x=True).view(float)
        both = np.concatenate([before, lines[:, :-1]], axis=1)
        both *= sign
        both += lines
        own += lines.transpose(0, 2, 1) @ both
    own = own.reshape(-1, width, 2, width, 2)
    cross = (own[:, :, 0, :, 0] + own[:, :, 1, :, 1]
             + 1j * (own[:, :, 1, :, 0] - own[:, :, 0, :, 1]))
    return irfft(cross, axis=0)[:lags + 1]


def _scaled(products, counts, mean, blocks, block_s):
    """Divide by counts and scales, remove the mean."""
    values = products / counts - np.outer(mean, mean)
    scale = np.sqrt(np.maximum(np.diagonal(values[0]), 0.0))
    scale = np.where(scale > FAINT, scale, 0.0)
    unit = np.where(scale > 0.0, scale, 1.0)
    weight = 1.0 / np.outer(unit, unit)
    blocks = (blocks * (weight / counts)).reshape(len(blocks), values.size)
    return Covariances(values * weight, scale, blocks, block_s, float(np.min(counts)), counts)
