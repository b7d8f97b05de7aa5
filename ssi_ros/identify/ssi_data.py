"""
SSI-DATA: the projection of the future on the past, from the samples themselves.

Van Overschee and De Moor, Subspace Identification for Linear Systems (Kluwer 1996), chapter 3.
The LQ factor of past and future is made block by block, so that memory does not grow with the
record.
"""
import numpy as np
from scipy.linalg.blas import dtrsm

from ssi_ros.identify.realise import factors_of, poles_of
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
    n, width = values.shape
    size = block_rows * width
    table = np.lib.stride_tricks.sliding_window_view(values / scale, 2 * block_rows, axis=0)
    r = np.empty((0, 2 * size))
    for first in range(0, len(table), COLUMNS):
        rows = table[first:first + COLUMNS].transpose(0, 2, 1).reshape(-1, 2 * size)
        r = np.linalg.qr(np.concatenate([r, rows]), mode='r')
    if len(r) < 2 * size:
        raise ValueError(f'{n} samples give {len(table)} columns; block_rows={block_rows} needs '
                         f'{2 * size}: record longer or lower block_rows')
    # r^T is L: the projection of the future on the past is L21 times orthonormal rows
    past = r[:size, size:].T
    w = None
    if weighting == 'cva':
        future = r[:, size:]
        w = np.asfortranarray(np.linalg.cholesky(future.T @ future))
        past = dtrsm(1.0, w, past, lower=1)
    u, s, _ = np.linalg.svd(past, full_matrices=False)
    rank = max(orders)
    factors = factors_of(u[:, :rank], s[:rank], None, w, width)
    return poles_of(factors, orders, rate_hz, scale)
