"""Linear prediction of a recording: its errors, and the filter from them to the channels."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.scipy_later import nnls
from ssi_ros.windows import slow

PREDICTED = 60          # past samples of which one is predicted
COMES_BACK = 12        # samples of the past whose errors are followed
LOUD = 9.0              # times the usual power of a prediction error
LEAST_SHARE, MOST_SHARE = 0.01, 0.99    # of the errors, that grows with the slew rate


@dataclass(frozen=True, eq=False)
class Predictor:
    """The linear prediction of one sample of a recording from those before it."""

    scale: np.ndarray       # (l,), rms of each channel
    weights: np.ndarray     # (k, l, l), latest first: x(t) = sum x(t - i) W_i + e(t), rows
    lower: np.ndarray       # (l, l): e L^T has the covariance I

    def residual(self, values):
        """Return the prediction errors, white and of unit variance, (n - k, l)."""
        return _errors(values / self.scale, self.weights) @ self.lower.T

    def adjoint(self, residual):
        """
        Return the series v (n, l) whose product with what the channels hold is its score.

        Half the sum of squares of the prediction errors, (n - k, l), grows by sum v(t) d(t) where
        d is added to the channels, each over its rms.
        """
        order, turned = len(self.weights), residual @ self.lower
        found = np.pad(turned, ((order, 0), (0, 0)))
        for k, weight in enumerate(self.weights, 1):
            found[order - k:len(found) - k] -= turned @ weight.T
        return found

    def gain_scores(self, values, residual):
        """
        Return the score of the gain of every channel at every time, (n - k, l), by the past alone.

        What is new at a time is left out of what a gain makes of it: whatever the level of the
        inputs is then, the rest has the mean 0 and no correlation with any other time.
        """
        order, scaled = len(self.weights), values / self.scale
        known = scaled[order:] - np.linalg.solve(self.lower, residual.T).T
        turned = residual @ self.lower
        scores = known * turned
        for k, weight in enumerate(self.weights, 1):
            scores -= scaled[order - k:len(scaled) - k] * (turned @ weight.T)
        return scores

    def slew_normalised(self, values, residual):
        """Return the errors (n - k, l), whitened again by how fast the motion is, eq. (161c)."""
        # A wrong instant errs by the slew rate of the motion, now and through the prediction of
        # what follows: what is large for a moment because the motion is fast is no pulse. The slew
        # rate is predicted from the past, which is independent of what is new.
        new = np.linalg.solve(self.lower, residual.T).T
        known = (values / self.scale)[-len(residual):] - new
        # the step to the next sample, from the same past: the samples themselves are wrong
        steps = np.zeros_like(known)
        steps[:-1] = np.diff(known, axis=0) - new[:-1] @ self.weights[0]
        errors = np.einsum('ni,nj->nij', *[steps @ self.lower.T] * 2)
        for k, weight in enumerate(self.weights[:COMES_BACK], 1):
            late = steps[:-k] @ weight @ self.lower.T
            errors[k:] += late[:, :, None] * late[:, None, :]
        slew = np.einsum('nii->n', errors)
        power = (residual ** 2).sum(axis=1)
        # a level that varies is in both; jitter follows the slew rate from moment to moment. Few
        # loud events, which ring, shall not make a level either
        steady, beats = (v / slow(v) for v in (power, slew))
        usual, jitter = nnls(np.column_stack([np.ones(len(residual)), beats]),
                             np.minimum(steady, LOUD))[0]
        share = min(jitter / (usual + jitter), MOST_SHARE)
        if share < LEAST_SHARE:
            return residual
        width = residual.shape[1]
        covariance = (1 - share) * np.eye(width) + share * width * errors / slew.mean()
        return np.linalg.solve(np.linalg.cholesky(covariance), residual[:, :, None])[:, :, 0]

    def shaping(self, cycles):
        """Return the filter from that to the channels, (f, l, l), at cycles a sample (f,)."""
        turns = np.exp(-2j * np.pi * np.outer(cycles, np.arange(1, len(self.weights) + 1)))
        past = np.tensordot(turns, self.weights.swapaxes(1, 2), 1)
        return self.scale[:, None] * np.linalg.inv(self.lower @ (np.eye(len(self.lower)) - past))


def predictor(values):
    """Fit the prediction of a recording, shape (n, l), by its covariances."""
    # The past is long enough for slow modes: their errors would hide what is new.
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
    residual = _errors(values, weights)
    covariance = residual.T @ residual / len(residual)
    return Predictor(scale, weights, np.linalg.inv(np.linalg.cholesky(covariance)))


def _errors(values, weights):
    order = len(weights)
    residual = values[order:].copy()
    for k in range(1, order + 1):
        residual -= values[order - k:-k] @ weights[k - 1]
    return residual
