"""The sampling instants have random errors that the stamps do not show."""
from dataclasses import replace
import math

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.quantity import quantity


@effect
class TimestampJitter(Effect):
    """All channels are sampled at instants with independent Gaussian errors, eq. (89)."""

    name = 'timestamp_jitter'
    site = Site.TIMING
    size = 'rms_s'
    reference = 'Balakrishnan, IRE Trans. Inf. Theory 8(3), 1962'
    starts = {'rms_s': (2e-4,)}
    follows = {'rms_s': 'sample'}
    power = 2.0
    like_noise = True
    patterns = (ModalPattern.SAMPLING,)

    rms_s: float = quantity(0.0, unit='s', low=0.0, high=1.0, doc='rms of the error')

    def apply(self, setup):
        """Return the setup with the jitter."""
        return replace(setup, jitter_rms_s=math.hypot(setup.jitter_rms_s, self.rms_s))
