"""The debiased Whittle likelihood, its score and its Fisher information, eq. (97) to (99)."""
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ssi_ros.gap.spectra import Frame, periodograms


@dataclass(frozen=True, eq=False)
class Evidence:
    """
    Spectra of a record, shape (pieces, k, l), and the pieces that count.

    `others` is the evidence of more records of the same model, cut alike.
    """

    frame: Frame
    spectrum: np.ndarray
    pieces: tuple
    others: tuple = ()

    def only(self, pieces):
        """Return the evidence of some pieces."""
        return Evidence(self.frame, self.spectrum, tuple(pieces))

    @cached_property
    def each(self):
        """Periodograms of the pieces that count, the mean over the records, (n, k, l, l)."""
        own = periodograms(self.spectrum[list(self.pieces)])
        return (own + sum(o.each for o in self.others)) / (1 + len(self.others))

    @cached_property
    def mean(self):
        """Their mean, shape (1, k, l, l)."""
        return self.each.mean(axis=0, keepdims=True)

    def against(self, model):
        """
        Return the periodograms that match a model's shape, and how many pieces each stands for.

        A model that is the same for all pieces needs only their mean.
        """
        records = 1 + len(self.others)
        if len(model) == 1:
            return self.mean, records * len(self.pieces), model
        return self.each, records, model[list(self.pieces)]


@dataclass(frozen=True, eq=False)
class Whitened:
    """
    A record as a model sees it: white where the model is right.

    Attributes
    ----------
    lower : ndarray, shape (a, k, l, l)
        Inverse of the Cholesky factor of S.
    excess : ndarray, shape (a, k l l)
        Whitened periodograms less the identity, as real vectors.
    likelihood : float
        Log likelihood, eq. (97); -inf where S is not positive definite.
    weight : float
        Periodograms that an entry of `excess` stands for, over the crowding of bins.
    pieces : tuple of int
        Of the evidence.

    """

    lower: np.ndarray
    excess: np.ndarray
    likelihood: float
    weight: float
    pieces: tuple

    def directions(self, changes):
        """
        Return changes of S as whitened real vectors, shape (p, a, k l l).

        Parameters
        ----------
        changes : sequence of ndarray, shape (a', k, l, l)
            With a' = 1 or the number of all pieces.

        """
        many = len(self.lower)
        out = np.empty((len(changes), *self.excess.shape))
        for row, change in zip(out, changes):
            if len(change) > 1:
                # a model that is the same for all pieces sees the mean of the change
                change = change[list(self.pieces)]
                change = change if many > 1 else change.mean(axis=0, keepdims=True)
            row[:] = real_vectors(white(self.lower, change))
        return out


def whiten(model, evidence):
    """
    Whiten a record by expected periodograms.

    Parameters
    ----------
    model : ndarray, shape (a, k, l, l)
        S, with a = 1 or the number of all pieces.
    evidence : Evidence
        What was recorded.

    Returns
    -------
    Whitened

    """
    seen, times, model = evidence.against(model)
    weight = times / evidence.frame.crowding
    try:
        factor = np.linalg.cholesky(model)
    except np.linalg.LinAlgError:
        return Whitened(model, np.zeros((len(model), 0)), -np.inf, weight, evidence.pieces)
    lower = np.linalg.inv(factor)
    flat = white(lower, seen)
    diagonal = np.einsum('akii->aki', factor).real
    value = -weight * (2 * np.log(diagonal).sum() + np.einsum('akii->', flat).real)
    flat = flat - np.eye(model.shape[-1])
    return Whitened(lower, real_vectors(flat), float(value) if np.isfinite(value) else -np.inf,
                    weight, evidence.pieces)


def whiten_each(model, evidence):
    """Whiten each piece, also by a model that is the same for all; arguments as of `whiten`."""
    if len(model) == 1:
        model = np.repeat(model, evidence.frame.pieces, axis=0)
    return whiten(model, evidence)


def log_likelihood(model, evidence):
    """
    Return the log likelihood of expected periodograms, over the crowding of bins, eq. (97).

    -inf where S is not positive definite.
    """
    return whiten(model, evidence).likelihood


def gradient(model, slopes, evidence):
    """
    Return the score and the Fisher information of parameters, eq. (98) and (99).

    Parameters
    ----------
    model : ndarray, shape (a, k, l, l)
        S.
    slopes : sequence of ndarray
        Derivative of S by each parameter; each with a = 1 or all pieces.
    evidence : Evidence
        What was recorded.

    Returns
    -------
    score : ndarray, shape (p,)
        Derivative of the log likelihood.
    information : ndarray, shape (p, p)
        Its expected curvature.

    """
    many = max([len(model)] + [len(s) for s in slopes])
    if many > len(model):
        model = np.broadcast_to(model, (many, *model.shape[1:]))
    seen = whiten(model, evidence)
    flat = seen.directions(slopes).reshape(len(slopes), -1)
    return seen.weight * (flat @ seen.excess.ravel()), seen.weight * (flat @ flat.T)


def white(lower, change):
    """Return L^-1 X L^-H of matrices X, with `lower` the inverse of L."""
    return lower @ change @ lower.conj().swapaxes(-1, -2)


def real_vectors(matrices):
    """Return Hermitian matrices as real vectors with the same inner product, (a, k l l)."""
    # the sum of real and imaginary part keeps tr A B: the cross terms cancel by symmetry
    return (matrices.real + matrices.imag).reshape(len(matrices), -1)


def hermitian(sums):
    """Return the Hermitian matrices of such sums of real and imaginary part, (..., l, l)."""
    turned = sums.swapaxes(-1, -2)
    return (sums + turned) / 2 + 1j * (sums - turned) / 2
