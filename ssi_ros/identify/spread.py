"""
Spreads of frequency, damping and shape, to first order, in the space of the lags.

A pole is a smooth function of the lag covariances, and so is its shape. Their first-order changes
are linear functionals of rank one in the Toeplitz matrix, eq. (53), that share the right vector.
The data blocks then give the variance of a scalar, eq. (55) and (56). No Kronecker product and no
covariance of covariances is formed. After Doehler and Mevel, Mechanical Systems and Signal
Processing 38 (2013) 346-366; that the functionals meet the blocks frequency by frequency is ours.

The blocks count as independent although the energy of a lightly damped mode remembers longer than
a block: a change of energy alone moves no pole, so the functional does not see that memory.
"""
from dataclasses import dataclass

import numpy as np
from scipy.fft import fft

BLOCKS_MIN = 4          # fewer data blocks say nothing about the scatter


@dataclass(frozen=True)
class Spreads:
    """
    Standard deviations of some poles, one entry each; NaN with fewer than 4 data blocks.

    Attributes
    ----------
    frequency_hz, damping_ratio : ndarray, shape (p,)
        Of frequency [Hz] and damping ratio [1].
    shape : ndarray, shape (p, l)
        Of the components of the shape, largest component 1: root of the mean square modulus of
        their errors.

    """

    frequency_hz: np.ndarray
    damping_ratio: np.ndarray
    shape: np.ndarray


def unknown(number, channels):
    """Return the Spreads of poles of which nothing is known."""
    return Spreads(np.full(number, np.nan), np.full(number, np.nan),
                   np.full((number, channels), np.nan))


def functionals(factors, poles, which, rows):
    """
    Return the vectors of the functionals of every pole and of its shape, eq. (53).

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
    a : ndarray, shape (p, 1 + l, i, l), complex
        Left vectors: first of mu, then of every component of C phi.
    b : ndarray, shape (p, i, l), complex
        Right vectors: d mu = sum over block rows r, s of a_r^T dLambda_(i + r - s) b_s.

    """
    n, width = poles.order, factors.channels
    vectors, values = poles.vectors(), poles.values()
    own = poles.columns[which]
    mu = values[own]
    # Gamma_up^+ dA phi = Gamma_up^+ (J_down - mu J_up) dT b in the coordinates of the poles
    left = np.linalg.inv(vectors)
    # reduced resolvent C (mu - A)^#: how a change of A turns the eigenvector
    gap = mu[:, None] - values
    gap[np.arange(len(own)), own] = np.inf
    turn = (factors.observability[:width, :n] @ vectors)[None] / gap[:, None, :]
    pick = np.concatenate([left[own][:, None, :], turn @ left], axis=1).reshape(-1, n)
    pick = np.linalg.solve(factors.upper[:n, :n].T, pick.T).T
    project = (pick @ factors.q[:, :n].T).reshape(len(own), 1 + width, -1)
    a = np.zeros((len(own), 1 + width, rows * width), dtype=complex)
    a[:, :, width:] = project
    a[:, :, :-width] -= mu[:, None, None] * project
    a[:, 1:, :width] += np.eye(width)            # C itself is the first block row
    b = (factors.inputs[:, :n] @ vectors[:, own]).T
    return a.reshape(len(own), 1 + width, rows, width), b.reshape(-1, rows, width)


def block_spectra(covariances, rows):
    """
    Return the data blocks of lags 1 to 2 i - 1 over frequency, for `changes`.

    Returns
    -------
    ndarray, shape (2 i, l, l, m), complex
        Conjugate transform over the lags, for m data blocks.

    """
    width = covariances.values.shape[1]
    blocks = covariances.blocks.reshape(len(covariances.blocks), -1, width, width)
    spectra = fft(blocks[:, 1:2 * rows], 2 * rows, axis=1)
    return np.ascontiguousarray(spectra.conj().transpose(1, 2, 3, 0))


def changes(a, b, spectra):
    """
    Return what the data blocks do to every functional, eq. (54) and (55).

    Parameters
    ----------
    a, b : ndarray, shape (p, f, i, l) and (p, i, l), complex
        From `functionals`.
    spectra : ndarray, shape (2 i, l, l, m), complex
        From `block_spectra`.

    Returns
    -------
    ndarray, shape (p, f, m), complex

    """
    size, width, _, number = spectra.shape
    # block row p and block column q meet lag i + p - q: a convolution once q counts backwards
    ahead = fft(a, size, axis=2)
    back = fft(b[:, ::-1], size, axis=1).transpose(1, 0, 2)          # (2 i, p, l)
    right = spectra.transpose(0, 2, 1, 3).reshape(size, width, -1)
    met = (back @ right).reshape(size, len(b), width, number).transpose(1, 0, 2, 3)
    return ahead.reshape(*a.shape[:2], -1) @ met.reshape(len(b), -1, number) / size


def spreads_of(factors, poles, which, rows, spectra, rate_hz, scale=1.0):
    """
    Return the spreads of poles of one order, eq. (56) and (57).

    Parameters
    ----------
    factors, poles, which, rows
        See `functionals`.
    spectra : ndarray, shape (2 i, l, l, m)
        From `block_spectra`.
    rate_hz : float
        Rate of the band [Hz].
    scale : ndarray, shape (l,), optional
        What the channels were divided by; the shapes are those of the channels before.

    Returns
    -------
    Spreads

    """
    number, p = spectra.shape[-1], len(which)
    if number < BLOCKS_MIN:
        return unknown(p, factors.channels)
    a, b = functionals(factors, poles, which, rows)
    moved = changes(a, b, spectra)
    mu = poles.mu[which]
    lam = np.log(mu) * rate_hz
    d_lam = moved[:, 0] * (rate_hz / mu)[:, None]              # d lambda = d mu / (mu dt)
    radius = np.abs(lam)
    df = (d_lam * lam.conj()[:, None]).real / radius[:, None] / (2.0 * np.pi)
    damping = -lam.real / radius
    dx = (-d_lam.real - damping[:, None] * 2.0 * np.pi * df) / radius[:, None]
    psi = poles.raw_shapes()[which] * scale
    d_psi = moved[:, 1:] * np.broadcast_to(scale, psi.shape)[:, :, None]
    k, top = np.arange(p), np.abs(psi).argmax(axis=1)
    largest = psi[k, top][:, None]
    ds = d_psi - (psi / largest)[:, :, None] * d_psi[k, top][:, None, :]
    return Spreads(_std(df), _std(dx), _std(ds / largest[:, :, None]))


def _std(changes_of_blocks):
    """Return the standard deviation of the sum over the blocks, the last axis."""
    number = changes_of_blocks.shape[-1]
    off = changes_of_blocks - changes_of_blocks.mean(axis=-1, keepdims=True)
    return np.sqrt(number / (number - 1.0) * (off.real ** 2 + off.imag ** 2).sum(axis=-1))
