"""An accelerometer is not where the drawing has it."""
from dataclasses import replace
import math

from ssi_ros.effects.base import Effect, effect, in_deviations, ModalPattern, Site
from ssi_ros.quantity import quantity, unknown


@effect
class SensorMisplacement(Effect):
    """One accelerometer is shifted on its array by (along_m, lateral_m)."""

    name = 'sensor_misplacement'
    site = Site.SENSOR
    size = 'along_m'
    together = ('lateral_m',)
    reference = 'docs/theory.md, eq. (14) (displacement row of a point)'
    starts = {'along_m': (-0.02, 0.0, 0.02), 'lateral_m': (-0.02, 0.0, 0.02)}
    follows = {'along_m': 'length', 'lateral_m': 'width'}
    patterns = (ModalPattern.CHANNEL_SHAPE,)

    channel: str = quantity('e1_a', doc='channel')
    along_m: float = quantity(0.0, unit='m', low=-100.0, high=100.0, doc='shift to the tip')
    lateral_m: float = quantity(0.0, unit='m', low=-100.0, high=100.0, doc='shift along x_b')

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the sensor moved; it must stay on its array."""
        names = [s.name for s in spacecraft.sensors]
        if self.channel not in names:
            raise ValueError(unknown(f'channel {self.channel!r}', self.channel, names))
        return replace(spacecraft, sensors=tuple(
            replace(s, along_m=s.along_m + self.along_m, lateral_m=s.lateral_m + self.lateral_m)
            if s.name == self.channel else s for s in spacecraft.sensors))

    def deviations(self, spacecraft):
        """Return the size in declared deviations of the model's own error."""
        return in_deviations(math.hypot(self.along_m, self.lateral_m),
                             spacecraft.uncertainty.sensor_place_m)
