"""Both arrays are softer or stiffer than the model."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, in_deviations, ModalPattern, Site
from ssi_ros.effects.edits import scale_stiffness
from ssi_ros.quantity import quantity


@effect
class StiffnessScale(Effect):
    """The bending stiffness D of every array times `scale`, eq. (81)."""

    name = 'stiffness_scale'
    site = Site.STRUCTURE
    size = 'scale'
    reference = 'Leissa, J. Sound Vib. 31(3) 1973: Omega^2 is proportional to D'
    starts = {'scale': (0.998, 1.002)}
    patterns = (ModalPattern.COMMON_FREQUENCY_RATIO, ModalPattern.MODE_FREQUENCIES)

    scale: float = quantity(1.0, low=0.3, high=3.0,
                            doc='D over its nominal value, of a model without arrays K')

    def apply(self, setup):
        """Return the setup with all arrays scaled."""
        arrays = [a.name for a in setup.spacecraft.arrays]
        return replace(setup, system=scale_stiffness(setup.system, arrays, self.scale))

    def deviations(self, spacecraft):
        """Return the size in declared deviations of the model's own error."""
        # a frequency goes with the root of a stiffness
        return in_deviations((self.scale - 1) / 2, spacecraft.uncertainty.frequency,
                             sum(a.modes for a in spacecraft.arrays))
