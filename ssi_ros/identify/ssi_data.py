"""
SSI-DATA: the projection of the future on the past, from the samples themselves.

Van Overschee and De Moor, Subspace Identification for Linear Systems (Kluwer 1996), chapter 3.
The LQ factor of past and future is made block by block, so that memory does not grow with the
record.
"""
from dataclasses import replace

import numpy as np
from scipy.linalg.blas import dtrsm

from ssi_ros.identify.realise import factors_of, poles_of, RANK, RIDGE
from ssi_ros.identify.ssi_cov import checked

COLUMNS = 4096          # of past and future that one block of the LQ factorisation takes


def ssi_data(values, rate_hz, block_rows=50, orders=range(2, 61, 2), weighting='cva'):
    """
    Return the poles of a record at every model order.

    Parameters
    ----------
    values : ndarray, shape (n, l)
        The record, one column a channel, without missing samples.
    rate_hz : float
        Sampling rate [Hz].
    block_rows : int
        Block rows i of the past and of the future.
    orders : sequence of int
        Model orders, rising.
    weighting : str
        'cva' or 'upc'.

    Returns
    -------
    list of Poles
        As `ssi_cov` returns them.

    Raises
    ------
    ValueError
        For a record that cannot serve the block rows or the orders, or with missing samples.

    """
    values, orders = checked(values, block_rows, orders)
    if weighting not in ('cva', 'upc'):
        raise ValueError(f'weighting={weighting!r} is not known; known: cva, upc')
    if not np.isfinite(values).all():
        raise ValueError('a sample is missing; SSI-DATA needs all of them: use ssi_cov')
    values = values - values.mean(axis=0)
    scale = values.std(axis=0)
    if not (scale > 0.0).all():
        raise ValueError(f'channels {np.flatnonzero(~(scale > 0.0)).tolist()} are constant; leave '
                         'them out')
    factors = data_factors(values / scale, block_rows, max(orders), weighting)
    rank = len(factors.singular_values)
    return poles_of(factors, [k for k in orders if k <= rank], rate_hz, scale)


def data_factors(values, rows, rank, weighting):
    """
    Return the factorisation of the projection of the future on the past.

    Parameters
    ----------
    values : ndarray, shape (n, l)
        Rows of unit variance and no mean.
    rows : int
        Block rows i.
    rank : int
        How many columns to keep.
    weighting : str
        'cva' or 'upc'.

    Returns
    -------
    Factors
        As those of the covariances T = L21 L11^T, so that the spreads follow in the same way.

    Raises
    ------
    ValueError
        For too few samples.

    """
    width = values.shape[1]
    size = rows * width
    table = np.lib.stride_tricks.sliding_window_view(values, 2 * rows, axis=0)
    if len(table) < 2 * size:
        raise ValueError(f'{len(values)} samples give {len(table)} columns; block_rows={rows} '
                         f'needs {2 * size}: record longer or lower block_rows')
    # as much of the variance as SSI-COV adds: without noise the factors would have no inverse
    r = np.sqrt(RIDGE * len(table)) * np.eye(2 * size)
    for first in range(0, len(table), COLUMNS):
        block = table[first:first + COLUMNS].transpose(0, 2, 1).reshape(-1, 2 * size)
        r = np.linalg.qr(np.concatenate([r, block]), mode='r')
    # r^T is L: the projection of the future on the past is L21 times orthonormal rows
    r /= np.sqrt(len(table))
    l11, projected, w = np.asfortranarray(r[:size, :size].T), r[:size, size:].T, None
    if weighting == 'cva':
        future = r[:, size:]
        w = np.asfortranarray(np.linalg.cholesky(future.T @ future))
        projected = dtrsm(1.0, w, projected, lower=1)
    u, s, vt = np.linalg.svd(projected, full_matrices=False)
    rank = min(rank, int(np.count_nonzero(s > RANK * s[0])))
    u, s, vt = u[:, :rank], s[:rank], vt[:rank]
    factors = factors_of(u, s, None, w, width)
    root = np.sqrt(s)
    return replace(factors, inputs=dtrsm(1.0, l11, vt.T / root, lower=1, trans_a=1),
                   last_input=(root[:, None] * vt) @ l11[-width:].T)
