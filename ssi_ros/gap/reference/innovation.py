"""What the past does not predict of a recording, and the way back from it to the channels."""
from dataclasses import dataclass

import numpy as np

PREDICTED = 60          # past samples of which one is predicted


@dataclass(frozen=True, eq=False)
class Predictor:
    """
    The linear prediction of one sample of a recording from those before it.

    Attributes
    ----------
    scale : ndarray, shape (l,)
        Rms of each channel.
    weights : ndarray, shape (k, l, l)
        Of the samples of the past, latest first, a row each: x(t) = sum x(t - i) W_i + e(t).
    lower : ndarray, shape (l, l)
        Makes what is left white among the channels: e L^T has the covariance I.

    """

    scale: np.ndarray
    weights: np.ndarray
    lower: np.ndarray

    def residual(self, values):
        """Return what is left of a recording, white and of unit variance, (n - k, l)."""
        return _left(values / self.scale, self.weights) @ self.lower.T

    def shaping(self, cycles):
        """Return the filter from that to the channels, (f, l, l), at cycles a sample (f,)."""
        turns = np.exp(-2j * np.pi * np.outer(cycles, np.arange(1, len(self.weights) + 1)))
        past = np.tensordot(turns, self.weights.swapaxes(1, 2), 1)
        return self.scale[:, None] * np.linalg.inv(
            self.lower @ (np.eye(len(self.lower)) - past))


def predictor(values):
    """
    Fit the prediction of a recording, shape (n, l), by its covariances.

    The past is long enough for slow modes: what is left of them would hide what is new.
    """
    scale = values.std(axis=0)
    values = values / scale
    rows, width = values.shape
    order = int(min(PREDICTED, rows // (8 * width)))
    lags = np.array([values[k:].T @ values[:rows - k] for k in range(order + 1)]) / rows
    past = np.block([[lags[j - i] if j >= i else lags[i - j].T for j in range(order)]
                     for i in range(order)])
    weights = np.linalg.solve(past + 1e-9 * np.eye(len(past)),
                              lags[1:].swapaxes(1, 2).reshape(-1, width))
    weights = weights.reshape(order, width, width)
    left = _left(values, weights)
    return Predictor(scale, weights, np.linalg.inv(np.linalg.cholesky(left.T @ left / len(left))))


def _left(values, weights):
    order = len(weights)
    left = values[order:].copy()
    for k in range(1, order + 1):
        left -= values[order - k:-k] @ weights[k - 1]
    return left
