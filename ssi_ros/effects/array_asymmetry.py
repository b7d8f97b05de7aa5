"""One array is softer or stiffer than the model."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, in_deviations, ModalPattern, Site
from ssi_ros.effects.edits import scale_stiffness
from ssi_ros.quantity import quantity


@effect
class ArrayAsymmetry(Effect):
    """The bending stiffness D of one array times `scale`, eq. (81)."""

    name = 'array_asymmetry'
    site = Site.STRUCTURE
    size = 'scale'
    reference = 'Leissa, J. Sound Vib. 31(3) 1973: Omega^2 is proportional to D'
    starts = {'scale': (0.998, 1.002)}
    patterns = ModalPattern.MODE_FREQUENCIES, ModalPattern.CHANNEL_SHAPE
    needs = 'geometry', 'arrays'

    array: str = quantity('E1', doc='array')
    scale: float = quantity(1.0, low=0.3, high=3.0, doc='D of this array over its nominal value')

    def apply(self, setup):
        """Return the setup with one array scaled."""
        setup.spacecraft.array(self.array)
        return replace(setup, system=scale_stiffness(setup.system, [self.array], self.scale))

    def deviations(self, spacecraft):
        """Return the size in declared deviations of the model's own error."""
        return in_deviations((self.scale - 1) / 2, spacecraft.uncertainty.frequency,
                             spacecraft.array(self.array).modes)
