"""An accelerometer reaches its clipping limit."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import add_stage
from ssi_ros.model.sensors import Clip
from ssi_ros.quantity import quantity


@effect
class Saturation(Effect):
    """All channels are clipped to +-limit."""

    name = 'saturation'
    site = Site.SENSOR
    size = 'limit_m_s2'
    reference = 'full-scale range, IEEE Std 1293'
    starts = {'limit_m_s2': (0.05,)}
    spectral = False
    patterns = (ModalPattern.SAMPLE_VALUES,)

    limit_m_s2: float = quantity(float('inf'), unit='m/s^2', low=1e-9, doc='largest value')

    @property
    def limit(self):
        """Largest value that a channel can have [m/s^2]."""
        return self.limit_m_s2

    def in_samples(self, values):
        """Return the values, clipped."""
        return Clip(self.limit_m_s2).begin(None, None)(values)

    def apply(self, setup):
        """Return the setup with the clipping at the end of the chain."""
        return add_stage(setup, Clip(self.limit_m_s2))
