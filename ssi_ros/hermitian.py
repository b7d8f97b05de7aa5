"""
Hermitian matrices of bands.

Products of many small matrices are compiled by numba on first use and cached: a product of two
matrices of four channels costs a library more to call than to compute.
"""
import math

from numba import njit
import numpy as np

ROUNDED = 1e-12         # of the largest power, which the least one may be wrong by
SINGULAR = 1e-13        # of the largest eigenvalue, below which rounding makes any sign
LEAST_NOISE = 1e-6      # of a channel, over the noise of the loudest
SMALL = 8               # channels up to which loops are faster than calls of a library


def white(lower, change):
    """
    Return L^-1 X L^-H of matrices X, shape (..., l, l).

    Parameters
    ----------
    lower : ndarray, shape (..., l, l)
        L^-1, lower triangular.
    change : ndarray, shape (..., l, l)
        X. Leading axes of one that the other has not are repeated.

    """
    if (sides := _same(lower, change)) is None:
        return lower @ change @ lower.conj().swapaxes(-1, -2)
    shape = np.broadcast_shapes(lower.shape, change.shape)
    out = np.empty((max(map(len, sides)), *shape[-3:]), sides[0].dtype)
    _white(*sides, out)
    return out.reshape(shape)


def white_vectors(lower, change):
    """Return `white` of Hermitian matrices as `real_vectors`, shape (a, k l l)."""
    if (sides := _same(lower, change)) is None:
        return real_vectors(white(lower, change))
    shape = np.broadcast_shapes(lower.shape, change.shape)
    out = np.empty((max(map(len, sides)), *shape[-3:]), sides[0].real.dtype)
    _white_vectors(*sides, out)
    return out.reshape(shape[0], -1)


def _same(lower, change):
    """Return both as (n, k, l, l) of one complex kind, or None where a library is faster."""
    kind = np.result_type(lower, change)
    if (change.shape[-1] > SMALL or kind.kind != 'c'
            or not 3 <= max(lower.ndim, change.ndim) <= 4
            or lower.shape[-3:] != change.shape[-3:]):
        return None
    return [np.ascontiguousarray(x, kind).reshape(-1, *x.shape[-3:]) for x in (lower, change)]


@njit(cache=True)
def _white(lower, change, out):
    """Write L^-1 X L^-H, (n, k, l, l), of (n or 1, k, l, l) both."""
    bins, count = lower.shape[1:3]
    half = np.empty((count, count), out.dtype)
    for n in range(len(out)):
        one, two = n % len(lower), n % len(change)
        for k in range(bins):
            for i in range(count):
                for j in range(count):
                    total = lower[one, k, i, 0] * change[two, k, 0, j]
                    for m in range(1, i + 1):
                        total += lower[one, k, i, m] * change[two, k, m, j]
                    half[i, j] = total
            for i in range(count):
                for j in range(count):
                    total = half[i, 0] * lower[one, k, j, 0].conjugate()
                    for m in range(1, j + 1):
                        total += half[i, m] * lower[one, k, j, m].conjugate()
                    out[n, k, i, j] = total


@njit(cache=True)
def _white_vectors(lower, change, out):
    """Write the real vectors of L^-1 X L^-H, (n, k, l, l), of Hermitian X: half is enough."""
    bins, count = lower.shape[1:3]
    half = np.empty(count, lower.dtype)
    for n in range(len(out)):
        one, two = n % len(lower), n % len(change)
        for k in range(bins):
            for i in range(count):
                for j in range(i + 1):
                    total = lower[one, k, i, 0] * change[two, k, 0, j]
                    for m in range(1, i + 1):
                        total += lower[one, k, i, m] * change[two, k, m, j]
                    half[j] = total
                for j in range(i + 1):
                    total = half[0] * lower[one, k, j, 0].conjugate()
                    for m in range(1, j + 1):
                        total += half[m] * lower[one, k, j, m].conjugate()
                    out[n, k, i, j] = total.real + total.imag
                    if j < i:
                        out[n, k, j, i] = total.real - total.imag


def white_excess(lower, vectors):
    """Return L^-1 y y^H L^-H - 1 of spectra y (n, k, l) as `real_vectors`, (n, k l l)."""
    out = np.empty((*vectors.shape, vectors.shape[-1]))
    _white_excess(np.ascontiguousarray(lower), np.ascontiguousarray(vectors), out)
    return out.reshape(len(out), -1)


@njit(cache=True)
def _white_excess(lower, vectors, out):
    """Write it: a spectrum is whitened with a sixteenth of the products of its periodogram."""
    number, bins, count = vectors.shape
    one = np.empty(count, np.complex128)
    for n in range(number):
        for k in range(bins):
            for i in range(count):
                one[i] = 0.0
                for j in range(i + 1):
                    one[i] += lower[k, i, j] * vectors[n, k, j]
            for i in range(count):
                for j in range(count):
                    product = one[i] * one[j].conjugate()
                    out[n, k, i, j] = product.real + product.imag - (i == j)


def white_products(lower, left, right):
    """
    Return L^-1 (x y^H + y x^H) L^-H as `real_vectors`, (n, k l l).

    Parameters
    ----------
    lower : ndarray, shape (k, l, l)
        L^-1, lower triangular.
    left, right : ndarray, shape (n, k, l)
        x and y, axes of length 1 repeated.

    """
    shape = np.broadcast_shapes(left.shape, right.shape)
    sides = [np.ascontiguousarray(np.broadcast_to(x, shape), np.complex128) for x in (left, right)]
    out = np.empty((*shape, shape[-1]), float)
    _white_products(np.ascontiguousarray(lower, np.complex128), *sides, out)
    return out.reshape(len(out), -1)


@njit(cache=True)
def _white_products(lower, left, right, out):
    """Write them: of whitened vectors a product of each two components is left."""
    number, bins, count = left.shape
    one, two = np.empty(count, np.complex128), np.empty(count, np.complex128)
    for n in range(number):
        for k in range(bins):
            for i in range(count):
                one[i], two[i] = 0.0, 0.0
                for j in range(i + 1):
                    one[i] += lower[k, i, j] * left[n, k, j]
                    two[i] += lower[k, i, j] * right[n, k, j]
            for i in range(count):
                for j in range(i + 1):
                    total = one[i] * two[j].conjugate() + two[i] * one[j].conjugate()
                    out[n, k, i, j] = total.real + total.imag
                    if j < i:
                        out[n, k, j, i] = total.real - total.imag


@njit(cache=True)
def applied(matrices, vectors):
    """Return the products of complex matrices (n, l, l) with vectors (n, l), each its own."""
    bins, count = vectors.shape
    out = np.empty((bins, count), np.complex128)
    for k in range(bins):
        for i in range(count):
            total = matrices[k, i, 0] * vectors[k, 0]
            for j in range(1, count):
                total += matrices[k, i, j] * vectors[k, j]
            out[k, i] = total
    return out


def filtered(gain, spectrum):
    """Return G S G^H, averaged over the first axis of G (k, b, l, l), if it has one; None is 1."""
    if gain is None:
        return spectrum
    found = gain @ spectrum @ gain.conj().swapaxes(-1, -2)
    return found.mean(axis=0) if gain.ndim > 3 else found


def is_definite(matrices):
    """Return whether Hermitian matrices, (b, l, l), are all positive definite."""
    try:
        np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return False
    return True


def least_share(matrices, powers):
    """Return how often powers (l,) can be taken off the diagonals of matrices (b, l, l)."""
    return float(np.linalg.eigvalsh(matrices / np.sqrt(np.outer(powers, powers))).min())


def inverse_root(matrices):
    """
    Return the inverses L^-1 of the Cholesky factors L of matrices, shape (..., l, l).

    Raises
    ------
    LinAlgError
        If one is not positive definite.

    """
    count = matrices.shape[-1]
    if count > SMALL or matrices.dtype.kind != 'c':
        return np.linalg.inv(np.linalg.cholesky(matrices))
    given = np.ascontiguousarray(matrices).reshape(-1, count, count)
    out = np.zeros(given.shape, given.dtype)
    if not _inverse_root(given, out):
        raise np.linalg.LinAlgError('a matrix is not positive definite')
    return out.reshape(matrices.shape)


@njit(cache=True)
def _inverse_root(matrices, out):
    """Write the inverses of Cholesky factors, (n, l, l), into zeros; False if there is none."""
    count = matrices.shape[1]
    factor = np.empty((count, count), out.dtype)
    for n in range(len(matrices)):
        for j in range(count):
            for i in range(j, count):
                total = matrices[n, i, j]
                for m in range(j):
                    total -= factor[i, m] * factor[j, m].conjugate()
                if i > j:
                    factor[i, j] = total / factor[j, j].real
                elif total.real > 0.0:
                    factor[j, j] = np.sqrt(total.real)
                else:
                    return False
        for j in range(count):
            out[n, j, j] = 1.0 / factor[j, j].real
            for i in range(j + 1, count):
                total = factor[i, j] * out[n, j, j]
                for m in range(j + 1, i):
                    total += factor[i, m] * out[n, m, j]
                out[n, i, j] = -total / factor[i, i].real
    return True


def real_vectors(matrices):
    """Return Hermitian matrices as real vectors with the same inner product, (a, k l l)."""
    # the sum of real and imaginary part keeps tr A B: the cross terms cancel by symmetry
    return (matrices.real + matrices.imag).reshape(
        len(matrices), math.prod(matrices.shape[1:]))


def hermitian(sums):
    """Return the Hermitian matrices of such sums of real and imaginary part, (..., l, l)."""
    turned = sums.swapaxes(-1, -2)
    return (sums + turned) / 2 + 1j * (sums - turned) / 2


@njit(cache=True)
def traces_of_cubes(sums):
    """Return tr X^3 of Hermitian matrices as real sums, (n, k, l, l), shape (n, k)."""
    number, bins, count = sums.shape[:3]
    out = np.empty((number, bins))
    one = np.empty((count, count), np.complex128)
    for n in range(number):
        for k in range(bins):
            for i in range(count):
                for j in range(count):
                    up, down = sums[n, k, i, j], sums[n, k, j, i]
                    one[i, j] = complex(up + down, up - down) / 2
            total = 0.0
            for i in range(count):
                for j in range(count):
                    square = 0.0 + 0.0j
                    for m in range(count):
                        square += one[i, m] * one[m, j]
                    total += (square * one[j, i]).real
            out[n, k] = total
    return out


def matrix_power(matrices, exponent):
    """Return powers of positive definite matrices, (b, l, l), by one exponent or one each."""
    values, vectors = np.linalg.eigh(matrices)
    values = np.maximum(values, 1e-300) ** np.reshape(exponent, (-1, 1))
    return (vectors * values[:, None, :]) @ vectors.conj().swapaxes(-1, -2)


def whitened_alike(model, spectra):
    """Return S^-1/2 M S^-1/2 of models S and spectra M, (b, l, l)."""
    # the symmetric root treats all channels alike; a Cholesky factor moves what is wrong with one
    # into those after it
    root = matrix_power(model, -0.5)
    return root @ spectra @ root


def positive(difference):
    """Return what of a difference, smooth over three bands, is a spectrum, (b, l, l)."""
    around = np.concatenate([difference[:1], difference, difference[-1:]])
    smooth = (around[:-2] + around[1:-1] + around[2:]) / 3
    values, vectors = np.linalg.eigh(smooth)
    return (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.conj().swapaxes(-1, -2)


def definite(spectrum, noise):
    """
    Return expected periodograms, (k, l, l), that hold a noise, (k or 1, l, l), whatever rounds.

    The Fourier transform of lags is rounded by some 1e-15 of its largest power, which may be more
    than the noise of a good sensor.
    """
    least = np.einsum('kii->ki', noise).real
    return spectrum if ROUNDED < (least / _rms(spectrum) ** 2).min() else raised(spectrum, noise)


def raised(spectrum, noise):
    """Return Hermitian matrices, (k, l, l), with no eigenvalue below those of (k or 1, l, l)."""
    # every channel has a unit of its own
    rms = _rms(spectrum)
    units = rms[:, None] * rms
    values, vectors = np.linalg.eigh(spectrum / units)
    own = np.linalg.eigvalsh(noise / units)
    # all noise of one channel may be taken away; and what is left has a Cholesky factor
    least = np.maximum(np.maximum(own[:, :1], LEAST_NOISE * own[:, -1:]),
                       SINGULAR * values[:, -1:])
    return (vectors * np.maximum(values, least)[:, None, :]) @ vectors.conj().swapaxes(
        -1, -2) * units


def _rms(spectrum):
    """Return the root of the largest power of every channel, (l,)."""
    return np.sqrt(np.maximum(np.einsum('kii->ki', spectrum).real.max(axis=0), 1e-300))
