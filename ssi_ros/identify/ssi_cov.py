"""
The core of SSI-COV in one call: covariances, one factorisation, the poles of every order.

What `Monitor` does to each band of each window, without bands, selection and spreads: for those
who judge the poles themselves.
"""
import numpy as np

from ssi_ros.identify.lags import output_covariances
from ssi_ros.identify.realise import factorise, poles_of
from threadpoolctl import ThreadpoolController

BLAS = ThreadpoolController()   # more threads only slow these small matrices down


def ssi_cov(values, rate_hz, block_rows=50, orders=range(2, 61, 2), weighting='cva'):
    """
    Return the poles of a record at every model order, eq. (42) to (51).

    Parameters
    ----------
    values : ndarray, shape (n, l)
        The record, one column a channel; NaN where a sample is missing.
    rate_hz : float
        Sampling rate [Hz].
    block_rows : int
        Block rows i; lags up to 2 i - 1 are used.
    orders : sequence of int
        Model orders, rising.
    weighting : str
        'cva' or 'upc'.

    Returns
    -------
    list of Poles
        One an order, in the order given; orders beyond the rank of the record are left out. The
        shapes are those of the channels in their units, largest component 1.

    Raises
    ------
    ValueError
        For a record that cannot serve the block rows or the orders.

    """
    values, orders = checked(values, block_rows, orders)
    with BLAS.limit(limits=1):
        return _ssi_cov(values, rate_hz, block_rows, orders, weighting)


def _ssi_cov(values, rate_hz, block_rows, orders, weighting):
    covariances = output_covariances(values, 2 * block_rows - 1, rate_hz)
    if not (covariances.scale > 0.0).all():
        raise ValueError('channels '
                         f'{np.flatnonzero(~(covariances.scale > 0.0)).tolist()} are constant or '
                         'hold no number; leave them out')
    try:
        factors = factorise(covariances, block_rows, max(orders), weighting, spreads=False)
    except np.linalg.LinAlgError as error:
        raise ValueError(f'the record cannot be factorised: {error}') from error
    rank = len(factors.singular_values)
    return poles_of(factors, [k for k in orders if k <= rank], rate_hz, covariances.scale,
                    vectors=False)


def checked(values, block_rows, orders):
    """Return the record and the orders, or say what is wrong with them."""
    values = np.asarray(values, dtype=float)
    if values.ndim != 2:
        raise ValueError(f'values of shape {values.shape} given; (n, l) is needed, one column a '
                         'channel')
    n, width = values.shape
    if not (block_rows >= 2 and n >= 4 * block_rows):
        raise ValueError(f'{n} samples given; block_rows={block_rows} needs 2 or more block rows '
                         f'and {4 * block_rows} samples or more')
    orders, most = tuple(orders), (block_rows - 1) * width
    if not orders or min(orders) < 1 or max(orders) > most:
        raise ValueError(f'orders {orders[:1]} to {orders[-1:]} given; 1 to {most} = '
                         '(block_rows - 1) * channels are possible: raise block_rows or lower '
                         'the orders')
    return values, orders
