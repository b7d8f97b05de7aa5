"""The debiased Whittle likelihood, its gradient and its Fisher information, eq. (97) to (99)."""
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ssi_ros.gap.spectra import Frame, periodograms


@dataclass(frozen=True, eq=False)
class Evidence:
    """Spectra of a record, shape (pieces, k, l), and the pieces that count."""

    frame: Frame
    spectrum: np.ndarray
    pieces: tuple

    def only(self, pieces):
        """Return the evidence of some pieces."""
        return Evidence(self.frame, self.spectrum, tuple(pieces))

    @cached_property
    def each(self):
        """Periodograms of the pieces that count, shape (n, k, l, l)."""
        return periodograms(self.spectrum[list(self.pieces)])

    @cached_property
    def mean(self):
        """Their mean, shape (1, k, l, l)."""
        return self.each.mean(axis=0, keepdims=True)

    def against(self, model):
        """
        Return the periodograms that match a model's shape, and how many pieces each stands for.

        A model that is the same for all pieces needs only their mean.
        """
        if len(model) == 1:
            return self.mean, len(self.pieces), model
        return self.each, 1, model[list(self.pieces)]


def log_likelihood(model, evidence):
    """
    Return the log likelihood of expected periodograms, over the crowding of bins, eq. (97).

    Parameters
    ----------
    model : ndarray, shape (a, k, l, l)
        S, with a = 1 or the number of all pieces.
    evidence : Evidence
        What was recorded.

    Returns
    -------
    float
        -inf where S is not positive definite.

    """
    seen, times, model = evidence.against(model)
    sign, logdet = np.linalg.slogdet(model)
    if not np.all(sign.real > 0):
        return -np.inf
    quadratic = np.einsum('akij,akji->', np.linalg.inv(model), seen).real
    value = -times * (np.sum(logdet) + quadratic) / evidence.frame.crowding
    return float(value) if np.isfinite(value) else -np.inf


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
    seen, times, model = evidence.against(model)
    inverse = np.linalg.inv(model)
    excess = (inverse @ (seen - model) @ inverse).swapaxes(-1, -2)
    rows, score = [], []
    for slope in slopes:
        if len(slope) > 1:
            slope = slope[list(evidence.pieces)]
        score.append(np.sum(excess * slope).real)
        rows.append(np.broadcast_to(inverse @ slope, model.shape))
    flat = [r.reshape(-1) for r in rows]
    turned = [r.swapaxes(-1, -2).reshape(-1) for r in rows]
    information = np.array([[np.dot(a, b).real for b in turned] for a in flat])
    weight = times / evidence.frame.crowding
    return weight * np.array(score), weight * information
