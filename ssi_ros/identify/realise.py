"""
From covariances to the poles of every model order: SSI-COV with CVA or UPC weights.

Eq. (45) to (52) of docs/theory-identification.md. One factorisation serves all orders.
"""
from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dgeev, dormqr, dpotrf, dsytrd, dtrtrs
from ssi_ros.identify.eigen import output_eigen, tridiagonal_eigen

RIDGE = 1e-9        # of the mean variance: keeps the Cholesky factor of noise-free data alive
RIDGES = (1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
TOGETHER = 0.1      # of the most pairs of samples that every lag of two channels must have
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
    packed : ndarray, shape (n, n), or None
        All eigenvectors as LAPACK stores them: of a pair first the real parts, then the imaginary;
        None where they were not asked for.
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
    lags = np.arange(first + rows - 1, first - rows, -1)
    blocks = values[np.abs(lags)]
    blocks[lags < 0] = blocks[lags < 0].transpose(0, 2, 1)               # Lambda_-k
    strip = np.ascontiguousarray(blocks.transpose(1, 0, 2)).reshape(width, -1)
    # block row p is a window of this strip, one block further left than the row above
    step = strip.itemsize
    start = strip[:, (rows - 1) * width:]
    view = np.lib.stride_tricks.as_strided(
        start, (rows, width, rows * width), (-width * step, strip.strides[0], step))
    return view.reshape(rows * width, rows * width)


def missing_noise(covariances, rows):
    """
    Return what scattered missing samples add to the covariances, over the variance [1].

    Where a share 1 - q of the pairs is lost at random, a lag of n pairs errs by
    sqrt((1 / q - 1) / n), and the block Toeplitz matrix of such errors by sqrt(2 l i) times that.
    Directions weaker than this hold errors, not motion; a run of missing samples loses no more
    neighbours than one sample does. The estimate is ours.
    """
    own = np.diagonal(covariances.pairs[:2], axis1=1, axis2=2)
    present = np.minimum(1.0, (own[1] + 1.0) / own[0]).min()
    size = rows * own.shape[1]
    return float(np.sqrt(2.0 * size * (1.0 / present ** 2 - 1.0) / own[0].min()))


def _square_root(values, rows, lift, pairs=None):
    """Return W with W W^T = covariance of i successive samples, eq. (46)."""
    weight = toeplitz(values, rows, 0)
    unit = np.trace(weight) / len(weight)
    w = _cholesky(weight, (RIDGE + lift) * unit)
    if w is not None:
        return w
    # short records of slow modes: the estimate is not positive definite, so it is smoothed by a
    # triangular lag window, and lifted as little as it takes; any weight leaves the poles right
    fade = (1.0 - np.arange(len(values)) / len(values))[:, None, None]
    if pairs is not None:
        if pairs.min() < TOGETHER * pairs.max():
            raise np.linalg.LinAlgError('too few samples of the channels are there at the same '
                                        'times: the covariances of the window are not positive '
                                        'definite')
        # sums over the pairs that are there, over one number: the covariances of the record with
        # zeros where a sample is missing, which are positive but for the ends
        fade = fade * pairs / pairs.max()
    weight = toeplitz(values * fade, rows, 0)
    for ridge in RIDGES:
        w = _cholesky(weight, (ridge + lift) * unit)
        if w is not None:
            return w
    raise np.linalg.LinAlgError('the covariances of the window are not positive definite')


def _cholesky(weight, lift):
    """Return the lower factor of weight + lift I in Fortran order, or None."""
    weight = weight.T.copy(order='F')            # symmetric, and in the order that LAPACK wants
    weight[np.diag_indices(len(weight))] += lift
    w, fault = dpotrf(weight, lower=1, clean=1, overwrite_a=1)
    return w if fault == 0 else None


def factorise(covariances, rows, rank, weighting='cva', spreads=True):
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
    spreads : bool
        Whether they are to serve for spreads and shares too, see `factors_of`.

    Returns
    -------
    Factors

    Raises
    ------
    numpy.linalg.LinAlgError
        If the covariances of the window are not positive definite.

    """
    t, w = weighted(covariances.values, rows, weighting, missing_noise(covariances, rows),
                    covariances.pairs)
    u, s, v = decompose(whiten(t, w), rank)
    return factors_of(u, s, v if spreads else None, w, covariances.values.shape[1])


def weighted(values, rows, weighting, lift=0.0, pairs=None):
    """Return T, eq. (45), and the lower triangular W of its weight, eq. (46); None is W = I."""
    t = toeplitz(values, rows, rows)
    if weighting == 'cva':
        return t, _square_root(values, rows, lift, pairs)
    if weighting == 'upc':
        return t, None
    raise ValueError(f'weighting={weighting!r} is not known; known: cva, upc')


def whiten(t, w):
    """Return W^-1 T W^-T; T itself where W is None."""
    if w is None:
        return t
    # the transpose is in Fortran order, so that nothing is copied
    turned = dtrsm(1.0, w, t.T, lower=1, overwrite_b=1)
    return dtrsm(1.0, w, turned, side=1, lower=1, trans_a=1, overwrite_b=1).T


def decompose(t, rank):
    """
    Return the leading singular triplets (U, s, V), at most `rank`, of a matrix of 2 rows or more.

    The left subspace from t t^T costs half of a singular value decomposition; it is exact down to
    `RANK`.
    """
    # the symmetric eigenproblem by its parts, so that only vectors that are kept are turned back
    turned, diagonal, beside, tau, _ = dsytrd(t @ t.T, lower=1, lwork=64 * len(t))
    squares, vectors = tridiagonal_eigen(diagonal, beside)
    squares = squares[::-1]
    rank = min(rank, int(np.count_nonzero(squares > RANK ** 2 * max(squares[0], 1e-300))))
    u = np.asfortranarray(vectors[:, ::-1][:, :rank])
    if rank:
        u[1:] = dormqr('L', 'N', turned[1:, :-1], tau, u[1:], lwork=64 * rank)[0]
    s = np.sqrt(squares[:rank])
    return u, s, (t.T @ u) / s


def factors_of(u, s, v, w, channels):
    """
    Return the Factors of singular triplets and a weight, eq. (47) and (49).

    Without `v` they serve for poles, not for spreads: `inputs` and `last_input` are None.
    """
    root = np.sqrt(s)
    gamma = u * root if w is None else w @ (u * root)
    inputs = last = None
    if v is not None:
        inputs, last = v / root, (v * root)[-channels:].T
        if w is not None:
            last = ((v * root).T @ w[-channels:].T)
            inputs = dtrsm(1.0, w, inputs, lower=1, trans_a=1)
    q, upper = np.linalg.qr(gamma[:-channels])
    return Factors(gamma, inputs, last, s, upper, q.T @ gamma[channels:], q, channels)


def noise_floor(rows, channels, pairs):
    """
    Return the largest canonical correlation that pure noise gives, eq. (48).

    Wachter's edge for two sets of l i variates and N samples, 2 sqrt(c (1 - c)), c = l i / N
    (Annals of Statistics 8, 1980).
    """
    c = min(0.5, rows * channels / max(pairs, 1.0))
    return 2.0 * np.sqrt(c * (1.0 - c))


def poles_of(factors, orders, rate_hz, scale=1.0, vectors=True):
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
    scale : ndarray, shape (l,), optional
        Units of the channels; without it the shapes are those of the scaled channels.
    vectors : bool
        Whether the eigenvectors are wanted, as shares and spreads do; shapes come without.

    Returns
    -------
    list of Poles
        One an order.

    """
    solved, outputs = [], []
    for n in orders:
        a, _ = dtrtrs(factors.upper[:n, :n], factors.lower[:n, :n])
        c, packed = factors.observability[:factors.channels, :n], None
        if vectors:
            real, imag, _, packed, _ = dgeev(a, compute_vl=0, overwrite_a=1)
            outputs.append(c @ packed)
        else:
            real, imag, output = output_eigen(a, c)
            outputs.append(output)
        solved.append((real, imag, packed))
    # the rest at once for all orders: these arrays are so short that calls are what they cost
    real, imag = (np.concatenate([s[k] for s in solved]) for k in (0, 1))
    pairs = np.flatnonzero(imag > 0.0)        # LAPACK stores (re, im) of a pair side by side
    output = np.concatenate(outputs, axis=1)
    shapes = (output[:, pairs] + 1j * output[:, pairs + 1]).T * scale
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


def shares_of(factors, poles, which):
    """Return the share of each channel's variance that poles carry, (p, l), eq. (52)."""
    own = poles.columns[which]
    vectors = poles.vectors()
    g = np.linalg.inv(vectors)[own] @ factors.last_input[:poles.order]
    return 2.0 * np.abs((poles.raw_shapes()[which] * g / poles.mu[which][:, None]).real)
