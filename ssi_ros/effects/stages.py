"""Stages of the sensor chain that only effects use; see `ssi_ros/model/sensors.py`."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.model.sensors import Stage


@dataclass(frozen=True)
class LowFrequencyNoise(Stage):
    """First-order low-frequency noise on one channel, eq. (88): rms [m/s^2], time constant [s]."""

    channel: int
    rms: float
    time_constant_s: float

    @property
    def name(self):
        """Name of the random numbers, each channel its own; it fixes those of a seed."""
        return f'wander_{self.channel}'

    def begin(self, rate_hz, generator):
        """Return the function that adds the noise, from its stationary state on."""
        from scipy.signal import lfilter
        keep = np.exp(-1 / (rate_hz * self.time_constant_s))
        kick = self.rms * np.sqrt(1 - keep ** 2)
        state = [self.rms * generator.standard_normal()]

        def add(values):
            drive = kick * generator.standard_normal(len(values))
            noise, last = lfilter([1.0], [1.0, -keep], drive, zi=[keep * state[0]])
            state[0] = last[0] / keep
            values = values.copy()
            values[:, self.channel] += noise
            return values
        return add

    def autocovariance(self, channels, lags, rate_hz):
        """Return the autocovariance at lags 0, 1, ..., shape (lags, l, l), [(m/s^2)^2]."""
        out = np.zeros((lags, channels, channels))
        decay = np.exp(-np.arange(lags) / (rate_hz * self.time_constant_s))
        out[:, self.channel, self.channel] = self.rms ** 2 * decay
        return out


@dataclass(frozen=True)
class Drop(Stage):
    """Rows that go missing at random: NaN in all channels."""

    fraction: float

    name = 'drop'

    def begin(self, rate_hz, generator):
        """Return the function that drops rows."""
        def drop(values):
            values = values.copy()
            values[generator.random(len(values)) < self.fraction] = np.nan
            return values
        return drop
