"""The zero of an accelerometer drifts slowly."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import add_stage, channel_index
from ssi_ros.effects.stages import LowFrequencyNoise
from ssi_ros.quantity import quantity


@effect
class SensorDrift(Effect):
    """First-order Gauss-Markov noise on one channel, eq. (88)."""

    name = 'sensor_drift'
    site = Site.SENSOR
    size = 'rms_m_s2'
    reference = 'IEEE Std 952, annex C (exponentially correlated noise)'
    starts = {'rms_m_s2': (1e-3,), 'time_constant_s': (1.0, 10.0)}
    power = 2.0
    patterns = (ModalPattern.CHANNEL_NOISE,)
    below_band = True

    channel: str = quantity('e1_a', doc='channel')
    rms_m_s2: float = quantity(0.0, unit='m/s^2', low=0.0, high=1e3, doc='rms')
    time_constant_s: float = quantity(10.0, unit='s', low=0.1, high=1e5, doc='time constant')

    def apply(self, setup):
        """Return the setup with the noise at the end of the chain."""
        i = channel_index(setup.system, self.channel)
        return add_stage(setup, LowFrequencyNoise(i, self.rms_m_s2, self.time_constant_s))
