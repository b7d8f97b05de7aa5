"""A channel picks up a share of another."""
import numpy as np

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import channel_index, mix
from ssi_ros.quantity import quantity


@effect
class SensorCrosstalk(Effect):
    """`gain` times the acceleration of the channel `source` is added to `channel`."""

    name = 'sensor_crosstalk'
    site = Site.SENSOR
    size = 'gain'
    reference = 'cross-channel sensitivity, IEEE Std 1293'
    starts = {'gain': (-3e-3, 3e-3, -9e-3, 9e-3)}
    second_degree = True
    patterns = (ModalPattern.CHANNEL_FILTER,)

    source: str = quantity('e1_b', doc='channel that is picked up')
    channel: str = quantity('e1_a', doc='channel that picks up')
    gain: float = quantity(0.0, low=-5.0, high=5.0, doc='share that is picked up')

    def apply(self, setup):
        """Return the setup with the two channels mixed at the front of the chain."""
        matrix = np.eye(len(setup.system.channels))
        into = channel_index(setup.system, self.channel)
        matrix[into, channel_index(setup.system, self.source)] += self.gain
        return mix(setup, matrix)
