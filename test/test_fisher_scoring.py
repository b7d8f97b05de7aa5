"""Damped Fisher scoring with capped steps: how far it comes, and that it stays careful."""
from dataclasses import dataclass

import numpy as np
from ssi_ros.fisher_scoring import maximise


@dataclass(frozen=True)
class Hill:
    """A log likelihood with its maximum at `top`; `beyond` it cannot be computed."""

    x: np.ndarray
    top: float
    beyond: float = np.inf

    @property
    def value(self):
        """Return the log likelihood."""
        return -float((self.x[0] - self.top) ** 2)

    def gradient(self):
        """Return score and information."""
        return -2 * (self.x - self.top), np.array([[2.0]])

    def at(self, x):
        """Return the hill at another place."""
        return Hill(x, self.top, self.beyond) if x[0] < self.beyond else None


def test_a_maximum_at_many_caps_is_reached():
    """Steps of one cap would end at 12 of 60; they double while they gain what they promise."""
    found, _ = maximise(Hill(np.zeros(1), 60.0), np.ones(1), 12)
    assert abs(found.x[0] - 60.0) < 0.2


def test_a_longer_step_that_cannot_be_is_shortened():
    """Where the model ends at 5, a step beyond is taken shorter, and the climb ends before it."""
    found, _ = maximise(Hill(np.zeros(1), 60.0, 5.0), np.ones(1), 12)
    assert 3.0 < found.x[0] < 5.0
