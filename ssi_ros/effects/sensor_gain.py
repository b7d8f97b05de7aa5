"""An accelerometer reads too much or too little."""
import numpy as np

from ssi_ros.effects.base import Effect, effect, in_deviations, ModalPattern, Site
from ssi_ros.effects.edits import channel_index, mix
from ssi_ros.quantity import quantity


@effect
class SensorGain(Effect):
    """The acceleration of one channel times `scale`; its noise stays."""

    name = 'sensor_gain'
    site = Site.SENSOR
    size = 'scale'
    reference = 'scale-factor error, IEEE Std 1293'
    starts = {'scale': (0.998, 1.002, 0.994, 1.006)}
    second_degree = True
    patterns = (ModalPattern.CHANNEL_FILTER,)
    may_vary = 'the gain'

    channel: str = quantity('e1_a', doc='channel')
    scale: float = quantity(1.0, low=0.0, high=20.0, doc='gain over its nominal value')

    def apply(self, setup):
        """Return the setup with the gain at the front of the sensor chain."""
        gains = np.eye(len(setup.system.channels))
        i = channel_index(setup.system, self.channel)
        gains[i, i] = self.scale
        return mix(setup, gains)

    def deviations(self, spacecraft):
        """Return the size in declared deviations of the model's own error."""
        return in_deviations(self.scale - 1, spacecraft.uncertainty.gain)
