"""The heights of slow modes in one record: unknown numbers that are fitted beside all else."""
from dataclasses import dataclass, replace
import math

import numpy as np

from ssi_ros.hermitian import hermitian, real_vectors

STEPS, ENOUGH = 30, 1e-6        # of their fit at most, and the change at which it ends


@dataclass(frozen=True, eq=False)
class Heights:
    """
    Logarithms of the heights of modes over the expected ones, Gaussian beforehand.

    They are logarithms because the record may be far from the model that it is compared with:
    there a change of the spectrum in proportion to an unknown number promises a likelihood that
    no height can give, and wrong effects would win by it.
    """

    bins: np.ndarray    # (m,), of those of the frame
    scale: np.ndarray   # (m, s), change of the logarithm in each by one deviation
    along: np.ndarray   # (m, l l), direction of it in whitened periodograms, of unit norm

    def __len__(self):
        """Return how many there are."""
        return self.scale.shape[1]

    def vectors(self, count):
        """Return them as directions of a whitened spectrum of so many bins, (s, k l l)."""
        vectors = np.zeros((len(self), count, self.along.shape[1]))
        vectors[:, self.bins] = self.scale.T[:, :, None] * self.along
        return vectors.reshape(len(self), math.prod(vectors.shape[1:]))

    def taken_out(self, white):
        """Return a Whitened around the most probable heights, its likelihood with their prior."""
        count = math.isqrt(self.along.shape[1])
        excess = white.excess.reshape(len(white.excess), -1, count * count).copy()
        there, power, values = self._of(white)
        logs = self.scale @ values
        gain = white.weight * np.sum(-logs - power * np.expm1(-logs)) - values @ values / 2
        scaled = np.eye(count) + np.expm1(-logs / 2)[:, None, None] * hermitian(
            self.along.reshape(-1, count, count))
        there = scaled @ (np.eye(count) + hermitian(there.reshape(
            *there.shape[:2], count, count))) @ scaled - np.eye(count)
        excess[:, self.bins] = real_vectors(there).reshape(*there.shape[:2], -1)
        return replace(white, excess=excess.reshape(white.excess.shape),
                       likelihood=white.likelihood + float(gain), heights=values)

    def raised(self, model, white):
        """Return a model (a, k, l, l) with the most probable heights of the record it whitens."""
        count = math.isqrt(self.along.shape[1])
        logs = self.scale @ self.most_probable(white)
        there = model[:, self.bins]
        factor, raised = np.linalg.cholesky(there), model.copy()
        change = np.expm1(logs)[:, None, None] * hermitian(self.along.reshape(-1, count, count))
        raised[:, self.bins] = there + factor @ change @ factor.conj().swapaxes(-1, -2)
        return raised

    def most_probable(self, white):
        """Return the most probable values in deviations, (s,)."""
        return self._of(white)[2]

    def _of(self, white):
        """Return excess (a, m, l l), powers along the modes (a, m), and most probable values."""
        every = white.excess.reshape(len(white.excess), -1, self.along.shape[1])
        there = every[:, self.bins]
        power = 1 + np.maximum(np.einsum('aki,ki->ak', there, self.along), ENOUGH - 1)
        return there, power, self._most(power.mean(axis=0), white.weight * len(there))

    def _most(self, power, weight):
        """Return the most probable values, (s,); powers of bins are over expected ones, (m,)."""
        values = np.zeros(len(self))
        for _ in range(STEPS):
            rest = power * np.exp(-self.scale @ values)
            # no smaller curvature than the expected one: steps to small heights would be too long
            curved = (self.scale * (weight * np.maximum(rest, 1.0))[:, None]).T @ self.scale
            step = np.linalg.solve(curved + np.eye(len(values)),
                                   weight * self.scale.T @ (rest - 1) - values)
            values += step
            if np.abs(step).max(initial=0.0) < ENOUGH:
                break
        return values
