"""Hermitian matrices of bands."""
import numpy as np
from scipy.ndimage import uniform_filter1d


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
    smooth = uniform_filter1d(difference.real, 3, 0) + 1j * uniform_filter1d(difference.imag, 3, 0)
    values, vectors = np.linalg.eigh(smooth)
    return (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.conj().swapaxes(-1, -2)
