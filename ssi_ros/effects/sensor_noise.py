"""An accelerometer is noisier than its data sheet."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import channel_index
from ssi_ros.model.sensors import Noise
from ssi_ros.quantity import quantity


@effect
class SensorNoise(Effect):
    """The rms of the white noise of one channel times `scale`."""

    name = 'sensor_noise'
    site = Site.SENSOR
    size = 'scale'
    reference = 'paper, section 3 (measurement noise v)'
    starts = {'scale': (0.85, 1.15)}
    patterns = (ModalPattern.CHANNEL_NOISE,)
    may_vary = 'the noise'

    channel: str = quantity('e1_a', doc='channel')
    scale: float = quantity(1.0, low=0.0, high=1e3, doc='noise rms over its nominal value')

    def apply(self, setup):
        """Return the setup with the noise of the channel scaled."""
        i = channel_index(setup.system, self.channel)

        def scaled(stage):
            if not isinstance(stage, Noise):
                return stage
            return Noise(tuple(r * (self.scale if k == i else 1.0)
                               for k, r in enumerate(stage.rms)))
        chain = tuple(scaled(s) for s in setup.system.chain)
        return replace(setup, system=replace(setup.system, chain=chain))
