"""An accelerometer cannot follow fast motion."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import channel_index
from ssi_ros.quantity import quantity


@effect
class SensorBandwidth(Effect):
    """
    One channel, or all, pass a second-order Butterworth low-pass, eq. (92).

    It acts on the band below half of the rate, like a delay, so that a high corner fades away.
    """

    name = 'sensor_bandwidth'
    site = Site.SENSOR
    size = 'corner_hz'
    reference = 'Butterworth, Wireless Engineer 7, 1930'
    starts = {'corner_hz': (1000.0, 250.0, 60.0)}
    follows = {'corner_hz': 'rate'}
    patterns = (ModalPattern.CHANNEL_FILTER, ModalPattern.COMMON_FILTER)

    channel: str = quantity('all', doc='channel, or all')
    corner_hz: float = quantity(float('inf'), unit='Hz', low=0.1, doc='corner, -3 dB')

    @property
    def power(self):
        """Of one channel its lag shows, as f / corner; of all together the loss, as its 4th."""
        return -4.0 if self.channel == 'all' else -1.0

    def apply(self, setup):
        """Return the setup with the filter between structure and converter."""
        channels = setup.system.channels
        one = (range(len(channels)) if self.channel == 'all'
               else [channel_index(setup.system, self.channel)])
        return replace(setup, corners_hz=setup.corners_hz + tuple(
            (i, self.corner_hz) for i in one))
