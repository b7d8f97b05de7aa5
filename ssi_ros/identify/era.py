"""
ERA: the eigensystem realisation algorithm for pulse responses and free decays.

Juang and Pappa, Journal of Guidance, Control, and Dynamics 8 (1985) 620-627.
"""
import numpy as np

from ssi_ros.identify.realise import Factors, poles_of

RANK = 1e-12            # singular values below this share of the largest are rounding
TINY = 1e-15            # one may realise them all the same, as long as they are not zero


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
    factors, _ = pulse_factors(responses, block_rows, max(orders, default=0))
    s = factors.singular_values
    rank = int(np.count_nonzero(s > RANK * s[0]))
    return poles_of(factors, [n for n in orders if 1 <= n <= rank], rate_hz)


def pulse_factors(responses, rows, rank):
    """
    Return the factorisation of the Hankel matrix of pulse responses, and the level of its noise.

    Parameters
    ----------
    responses : ndarray, shape (K, l, r)
        As `era` takes them.
    rows : int
        Block rows i.
    rank : int
        How many columns to keep.

    Returns
    -------
    factors : Factors
        Without `inputs`, which only spreads need; `last_input` is the first block column of Delta.
    middle : float
        The median of all singular values: that of the noise where modes are fewer than half.

    Raises
    ------
    ValueError
        Where the responses are too short or zero.

    """
    number, width, inputs = responses.shape
    columns = number - rows
    if rows < 2 or columns < 2:
        raise ValueError(f'{number} samples given; block_rows={rows} needs 2 or more block rows '
                         f'and {rows + 2} samples or more')
    index = np.add.outer(np.arange(rows), np.arange(columns))
    first, second = (responses[index + k].transpose(0, 2, 1, 3).reshape(
        rows * width, columns * inputs) for k in (0, 1))
    if not first.any():
        raise ValueError('the responses are zero: nothing can be realised')
    u, s, vt = np.linalg.svd(first, full_matrices=False)
    middle = float(np.median(s))
    rank = min(rank, int(np.count_nonzero(s > TINY * s[0])))
    u, s, vt = u[:, :rank], s[:rank], vt[:rank]
    root = np.sqrt(s)
    a = (u.T @ second @ vt.T) / np.outer(root, root)
    start = root[:, None] * vt[:, :inputs]
    return Factors(u * root, None, start, s, np.eye(rank), a, None, width), middle


def pulse_shares(responses, factors, poles, which):
    """
    Return the share of each channel's power in the responses that poles carry.

    Parameters
    ----------
    responses : ndarray, shape (K, l, r)
        What was realised.
    factors, poles : Factors, Poles
        The realisation.
    which : ndarray of int, shape (p,)
        Poles wanted.

    Returns
    -------
    ndarray, shape (p, l)
        Sum over time and pulses of |psi mu^k g|^2, twice for the pair, over that of the
        responses.

    """
    g = np.linalg.inv(poles.vectors())[poles.columns[which]] @ factors.last_input[:poles.order]
    squared = np.abs(poles.mu[which]) ** 2
    lasting = np.where(np.abs(squared - 1.0) < 1e-12, len(responses),
                       (1.0 - squared ** len(responses)) / (1.0 - squared + 1e-300))
    own = 2.0 * np.abs(poles.raw_shapes()[which]) ** 2 * (
        lasting * (np.abs(g) ** 2).sum(axis=1))[:, None]
    return own / (responses ** 2).sum(axis=(0, 2))
