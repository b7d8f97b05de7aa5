"""
The sensor chain: stages that the sampled channels pass in order.

A stage is a frozen record; `begin(rate_hz, generator)` returns `values -> values`, called with
consecutive blocks. `response(frequencies_hz, rate_hz)` is the matrix that multiplies the spectrum
and `noise_covariance(l)` what is added to one sample; the expected spectrum is made of these two.
"""
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Stage:
    """A stage that changes nothing; the others say what they change."""

    name = 'stage'

    def begin(self, rate_hz, generator):
        """Return the function that the values of consecutive blocks pass."""
        return lambda values: values

    def response(self, frequencies_hz, channels):
        """Return the transfer matrix at every frequency, shape (f, l, l) or (1, l, l)."""
        return np.eye(channels)[None]

    def noise_covariance(self, channels):
        """Return the covariance that is added to one sample, shape (l, l), [(m/s^2)^2]."""
        return np.zeros((channels, channels))


@dataclass(frozen=True)
class Noise(Stage):
    """White Gaussian noise of its own on every channel, rms in [m/s^2]."""

    rms: tuple

    name = 'sensor_noise'

    def begin(self, rate_hz, generator):
        """Return the function that adds the noise."""
        rms = np.array(self.rms)
        return lambda values: values + generator.standard_normal(values.shape) * rms

    def noise_covariance(self, channels):
        """Return the covariance that is added to one sample, shape (l, l), [(m/s^2)^2]."""
        return np.diag(np.square(np.broadcast_to(self.rms, channels)))


@dataclass(frozen=True)
class Mix(Stage):
    """Gains and cross-talk: every row of channels times `matrix`, given row by row."""

    matrix: tuple

    name = 'mix'

    def begin(self, rate_hz, generator):
        """Return the function that mixes the channels."""
        transposed = np.array(self.matrix).T
        return lambda values: values @ transposed

    def response(self, frequencies_hz, channels):
        """Return the transfer matrix, shape (1, l, l)."""
        return np.array(self.matrix)[None]


@dataclass(frozen=True)
class Quantise(Stage):
    """Rounding to a step [m/s^2]; it has no linear response, so it counts as none."""

    step: float

    name = 'quantise'

    def begin(self, rate_hz, generator):
        """Return the function that rounds."""
        return lambda values: np.round(values / self.step) * self.step


@dataclass(frozen=True)
class Clip(Stage):
    """Saturation at +-limit [m/s^2]; it has no linear response, so it counts as none."""

    limit: float

    name = 'clip'

    def begin(self, rate_hz, generator):
        """Return the function that clips."""
        return lambda values: np.clip(values, -self.limit, self.limit)
