"""
From covariances to the poles of every model order: SSI-COV with CVA or UPC weights.

Eq. (45) to (52) of docs/theory-identification.md. One factorisation serves all orders.
"""
from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dgeev, dtrtrs

RIDGE = 1e-9        # of the mean variance: keeps the Cholesky factor of noise-free data alive
RIDGES = (1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
RANK = 1e-7         # singular values below this share of the largest are rounding


@dataclass(frozen=True)
class Factors:
    """
    The factorisation of one window's covariances.

    Attributes
    ----------
    observability : ndarray, shape (l i, r)
        Gamma, eq. (47), columns by falling singular value.
    inputs : ndarray, shape (l i, r)
        W^-T V S^-1/2: what a change of the covariances meets on its right, eq. (53).
    last_input : ndarray, shape (r, l)
        G, the last block column of Delta.
    singular_values : ndarray, shape (r,)
        Canonical correlations (CVA) or singular values (UPC).
    upper, lower : ndarray, shape (r, r)
        R and Q^T Gamma_down of the shift equation, eq. (49).
    q : ndarray, shape (l (i - 1), r)
        Q of Gamma_up = Q R.
    channels : int
        Number of channels l.

    """

    observability: np.ndarray
    inputs: np.ndarray
    last_input: np.ndarray
    singular_values: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    q: np.ndarray
    channels: int


@dataclass(frozen=True)
class Poles:
    """
    Poles of one order with positive imaginary part, one a row.

    Attributes
    ----------
    order : int
        Model order n.
    mu : ndarray, shape (p,)
        Discrete eigenvalues.
    frequency_hz, damping_ratio : ndarray, shape (p,)
        |lambda| / 2 pi and -Re(lambda) / |lambda|, eq. (51).
    shapes : ndarray, shape (p, l)
        C phi of the scaled channels, largest component 1.
    real, imag : ndarray, shape (n,)
        All eigenvalues, also real ones.
    packed : ndarray, shape (n, n)
        All eigenvectors as LAPACK stores them: of a pair first the real parts, then the imaginary.
    output : ndarray, shape (l, n)
        C of this order.
    columns : ndarray of int, shape (p,)
        Which of the eigenvectors belong to these poles.

    """

    order: int
    mu: np.ndarray
    frequency_hz: np.ndarray
    damping_ratio: np.ndarray
    shapes: np.ndarray
    real: np.ndarray
    imag: np.ndarray
    packed: np.ndarray
    output: np.ndarray
    columns: np.ndarray

    def values(self):
        """Return all eigenvalues, shape (n,), in the order of the eigenvectors."""
        return self.real + 1j * self.imag

    def vectors(self):
        """Return all eigenvectors phi, shape (n, n), one a column."""
        return _unpack(self.packed, self.columns)

    def raw_shapes(self):
        """Return C phi as it comes from the eigenvectors, shape (p, l)."""
        pair = self.output @ self.packed
        return (pair[:, self.columns] + 1j * pair[:, self.columns + 1]).T


def _unpack(packed, columns):
    vectors = packed.astype(complex)
    vectors[:, columns] += 1j * packed[:, columns + 1]
    vectors[:, columns + 1] = vectors[:, columns].conj()
    return vectors


def toeplitz(values, rows, first):
    """Return the block Toeplitz matrix with block (p, q) = Lambda_(first + p - q), eq. (45)."""
    width = values.shape[1]
    every = np.concatenate([values[:0:-1].transpose(0, 2, 1), values])   # -K ... K
    zero = len(values) - 1
    index = zero + first + np.subtract.outer(np.arange(rows), np.arange(rows))
    return every[index].transpose(0, 2, 1, 3).reshape(rows * width, rows * width)


def _square_root(values, rows):
    """Return W with W W^T = covariance of i successive samples, eq. (46)."""
    weight = toeplitz(values, rows, 0)
    unit = np.eye(len(weight)) * np.trace(weight) / len(weight)
    try:
        return np.linalg.cholesky(weight + RIDGE * unit)
    except np.linalg.LinAlgError:
        pass
    # short records of slow modes: the estimate is not positive definite, so it is smoothed by a
    # triangular lag window, and lifted as little as it takes; any weight leaves the poles right
    fade = 1.0 - np.arange(len(values)) / len(values)
    weight = toeplitz(values * fade[:, None, None], rows, 0)
    for ridge in RIDGES:
        try:
            return np.linalg.cholesky(weight + ridge * unit)
        except np.linalg.LinAlgError:
            pass
    raise np.linalg.LinAlgError('the covariances of the window are not positive definite')


def factorise(covariances, rows, rank, weighting='cva'):
    """
    Factorise the covariances into observability and controllability, eq. (46) and (47).

    Parameters
    ----------
    covariances : Covariances
        Lags 0 to 2 i - 1 at least; lag 0 only enters the weight.
    rows : int
        Block rows i.
    rank : int
        How many columns to keep.
    weighting : str
        'cva' or 'upc'.

    Returns
    -------
    Factors

    Raises
    ------
    numpy.linalg.LinAlgError
        If the covariances of the window are not positive definite.

    """
    values = covariances.values
    width = values.shape[1]
    t = toeplitz(values, rows, rows)
    if weighting == 'cva':
        w = _square_root(values, rows)
        t = dtrsm(1.0, w, dtrsm(1.0, w, t, lower=1), side=1, lower=1, trans_a=1)
    # the left subspace from t t^T costs half of an SVD; it is exact down to RANK
    squares, u = np.linalg.eigh(t @ t.T)
    squares, u = squares[::-1], u[:, ::-1]
    rank = min(rank, int(np.count_nonzero(squares > RANK ** 2 * max(squares[0], 1e-300))))
    s = np.sqrt(squares[:rank])
    u = u[:, :rank]
    v = (t.T @ u) / s
    gamma, delta = u * np.sqrt(s), v * np.sqrt(s)
    inputs = v / np.sqrt(s)
    if weighting == 'cva':
        gamma, delta = w @ gamma, w @ delta
        inputs = dtrsm(1.0, w, inputs, lower=1, trans_a=1)
    q, upper = np.linalg.qr(gamma[:-width])
    return Factors(gamma, inputs, delta[-width:].T, s, upper, q.T @ gamma[width:], q, width)


def noise_floor(rows, channels, pairs):
    """
    Return the largest canonical correlation that pure noise gives, eq. (48).

    Wachter's edge for two sets of l i variates and N samples, 2 sqrt(c (1 - c)), c = l i / N
    (Annals of Statistics 8, 1980).
    """
    c = min(0.5, rows * channels / max(pairs, 1.0))
    return 2.0 * np.sqrt(c * (1.0 - c))


def poles_of(factors, orders, rate_hz):
    """
    Return the poles of some model orders, eq. (49) to (51).

    Parameters
    ----------
    factors : Factors
        Of the window.
    orders : sequence of int
        Model orders n, at most the columns of the factors.
    rate_hz : float
        Sampling rate of the band [Hz].

    Returns
    -------
    list of Poles
        One an order.

    """
    solved, outputs = [], []
    for n in orders:
        a, _ = dtrtrs(factors.upper[:n, :n], factors.lower[:n, :n])
        real, imag, _, packed, _ = dgeev(a, compute_vl=0, overwrite_a=1)
        outputs.append(factors.observability[:factors.channels, :n] @ packed)
        solved.append((real, imag, packed))
    # the rest at once for all orders: these arrays are so short that calls are what they cost
    real, imag = (np.concatenate([s[k] for s in solved]) for k in (0, 1))
    pairs = np.flatnonzero(imag > 0.0)        # LAPACK stores (re, im) of a pair side by side
    output = np.concatenate(outputs, axis=1)
    shapes = (output[:, pairs] + 1j * output[:, pairs + 1]).T
    top = np.abs(shapes).argmax(axis=1)
    shapes /= shapes[np.arange(len(pairs)), top][:, None]
    mu = real[pairs] + 1j * imag[pairs]
    lam = np.log(mu) * rate_hz
    radius = np.abs(lam)
    frequency, damping = radius / (2.0 * np.pi), -lam.real / radius
    starts = np.cumsum([0, *orders])
    ends = np.searchsorted(pairs, starts)
    every = []
    for k, (n, (re, im, packed)) in enumerate(zip(orders, solved)):
        own = slice(ends[k], ends[k + 1])
        every.append(Poles(n, mu[own], frequency[own], damping[own], shapes[own], re, im, packed,
                           factors.observability[:factors.channels, :n],
                           pairs[own] - starts[k]))
    return every
