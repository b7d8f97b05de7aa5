"""
ERA: the eigensystem realisation algorithm for pulse responses and free decays.

Juang and Pappa, Journal of Guidance, Control, and Dynamics 8 (1985) 620-627.
"""
import numpy as np

from ssi_ros.identify.realise import Factors, poles_of

RANK = 1e-12            # singular values below this share of the largest are rounding


def era(responses, rate_hz, block_rows=50, orders=range(2, 61, 2)):
    """
    Return the poles of pulse responses at every model order.

    Parameters
    ----------
    responses : ndarray, shape (K, l, r)
        Responses of l channels to r pulses, from one sample after the pulse on; a free decay is a
        response with r = 1.
    rate_hz : float
        Sampling rate [Hz].
    block_rows : int
        Block rows i of the Hankel matrix; it has K - i block columns.
    orders : sequence of int
        Model orders, rising.

    Returns
    -------
    list of Poles
        One an order; orders beyond the rank are left out.

    Raises
    ------
    ValueError
        Where the responses are too short or not finite.

    """
    responses, orders = np.asarray(responses, dtype=float), tuple(orders)
    if responses.ndim != 3 or not np.isfinite(responses).all():
        raise ValueError(f'responses of shape {responses.shape} given; (K, l, r) is needed, all '
                         'numbers finite')
    number, width, inputs = responses.shape
    columns = number - block_rows
    if block_rows < 2 or columns < 2:
        raise ValueError(f'{number} samples given; block_rows={block_rows} needs 2 or more block '
                         f'rows and {block_rows + 2} samples or more')
    index = np.add.outer(np.arange(block_rows), np.arange(columns))
    first, second = (responses[index + k].transpose(0, 2, 1, 3).reshape(
        block_rows * width, columns * inputs) for k in (0, 1))
    if not first.any():
        raise ValueError('the responses are zero: nothing can be realised')
    u, s, vt = np.linalg.svd(first, full_matrices=False)
    rank = min(max(orders, default=0), int(np.count_nonzero(s > RANK * s[0])))
    u, s, vt = u[:, :rank], s[:rank], vt[:rank]
    root = np.sqrt(s)
    a = (u.T @ second @ vt.T) / np.outer(root, root)
    factors = Factors(u * root, None, None, s, np.eye(rank), a, None, width)
    return poles_of(factors, [n for n in orders if 1 <= n <= rank], rate_hz)
