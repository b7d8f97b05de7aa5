"""
Spreads of frequency, damping and shape, to first order, in the space of the lags.

A pole is a smooth function of the lag covariances. Its first-order change is one linear
functional of them, of rank one in the Toeplitz matrix, eq. (53), so that it folds into one weight
per lag, eq. (54). The data blocks then give the variance of a scalar, eq. (55) and (56). No
Kronecker product and no covariance of covariances is formed. After Doehler and Mevel,
Mechanical Systems and Signal Processing 38 (2013) 346-366; the folding is ours.

The blocks count as independent although the energy of a lightly damped mode remembers longer than
a block: a change of energy alone moves no pole, so the functional does not see that memory.
"""
import numpy as np

BLOCKS_MIN = 4          # fewer data blocks say nothing about the scatter


def functionals(factors, poles, which, rows):
    """
    Return the left and right vectors of the functional of every pole, eq. (53).

    Parameters
    ----------
    factors : Factors
        Of the window.
    poles : Poles
        Of one order.
    which : ndarray of int, shape (p,)
        Poles wanted.
    rows : int
        Block rows i.

    Returns
    -------
    a, b : ndarray, shape (p, i, l), complex
        d mu = sum over block rows r, s of a_r^T dLambda_(i + r - s) b_s.

    """
    n, width = poles.order, factors.channels
    mu = poles.mu[which][:, None]
    pick = np.linalg.solve(factors.upper[:n, :n].T, poles.left()[which].T).T
    project = pick @ factors.q[:, :n].T
    a = np.zeros((len(which), rows * width), dtype=complex)
    a[:, width:] = project
    a[:, :-width] -= mu * project
    b = (factors.inputs[:, :n] @ poles.vectors[:, poles.columns[which]]).T
    return a.reshape(-1, rows, width), b.reshape(-1, rows, width)


def lag_weights(a, b):
    """
    Fold rank-one functionals of the Toeplitz matrix into weights of the lags, eq. (54).

    Parameters
    ----------
    a, b : ndarray, shape (p, i, l), complex
        From `functionals`.

    Returns
    -------
    ndarray, shape (p, 2 i - 1, l, l), complex
        g_k for k = 1 ... 2 i - 1: d mu = sum_k sum_cd g_k[c, d] dLambda_k[c, d].

    """
    rows = a.shape[1]
    size = 2 * rows
    ahead = np.fft.fft(a, size, axis=1)
    back = np.fft.fft(b[:, ::-1], size, axis=1)      # reversed: the sum over r - s is a product
    return np.fft.ifft(ahead[:, :, :, None] * back[:, :, None, :], axis=1)[:, :2 * rows - 1]


def pole_spreads(covariances, weights, mu, rate_hz):
    """
    Return the spreads of frequency and damping of poles.

    Parameters
    ----------
    covariances : Covariances
        With its data blocks.
    weights : ndarray, shape (p, 2 i - 1, l, l)
        From `lag_weights`.
    mu : ndarray, shape (p,)
        Discrete eigenvalues.
    rate_hz : float
        Rate of the band [Hz].

    Returns
    -------
    frequency_std_hz, damping_ratio_std : ndarray, shape (p,)
        Standard deviations, eq. (57); NaN with fewer than 4 blocks.

    """
    lam = np.log(mu) * rate_hz
    p = len(mu)
    if len(covariances.blocks) < BLOCKS_MIN:
        return np.full(p, np.nan), np.full(p, np.nan)
    lags = weights.shape[1]
    size = weights.shape[2] ** 2
    blocks = covariances.blocks[:, size:size * (lags + 1)]
    changes = weights.reshape(p, -1) @ blocks.T
    changes *= (rate_hz / mu)[:, None]                # d lambda = d mu / (mu dt)
    radius = np.abs(lam)
    df = (changes * lam.conj()[:, None]).real / radius[:, None] / (2.0 * np.pi)
    damping = -lam.real / radius
    dx = (-changes.real - damping[:, None] * 2.0 * np.pi * df) / radius[:, None]
    number = len(blocks)
    return (np.sqrt(number * df.var(axis=1, ddof=1)), np.sqrt(number * dx.var(axis=1, ddof=1)))
