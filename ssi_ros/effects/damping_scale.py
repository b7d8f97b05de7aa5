"""The structure loses more or less energy a cycle than the model."""
from dataclasses import replace
import math

from ssi_ros.effects.base import Effect, effect, in_deviations, ModalPattern, Site
from ssi_ros.quantity import quantity


@effect
class DampingScale(Effect):
    """Every damping ratio xi times `scale`."""

    name = 'damping_scale'
    site = Site.STRUCTURE
    size = 'scale'
    reference = 'paper, eq. (3b)'
    starts = {'scale': (0.9, 1.1)}
    needs = ()
    patterns = (ModalPattern.COMMON_DAMPING_RATIO, ModalPattern.MODE_DAMPINGS)

    scale: float = quantity(1.0, low=0.05, high=20.0, doc='damping ratios over their nominal')

    def spacecraft(self, spacecraft):
        """Return the spacecraft with all damping ratios scaled."""
        if not spacecraft.arrays:
            return spacecraft
        return replace(spacecraft, arrays=tuple(
            replace(a, damping_ratio=a.damping_ratio * self.scale) for a in spacecraft.arrays))

    def apply(self, setup):
        """Return the setup with the damping matrix scaled, of a model that has no arrays."""
        if setup.spacecraft.arrays:
            return setup
        return replace(setup, system=replace(
            setup.system, damping=self.scale * setup.system.damping))

    def deviations(self, spacecraft):
        """Return the size in declared deviations of the model's own error."""
        return in_deviations(math.log(self.scale), spacecraft.uncertainty.damping,
                             sum(a.modes for a in spacecraft.arrays))
