"""The structure loses more or less energy a cycle than the model."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, Site
from ssi_ros.quantity import quantity


@effect
class DampingScale(Effect):
    """Every damping ratio xi times `scale`."""

    name = 'damping_scale'
    site = Site.STRUCTURE
    size = 'scale'
    reference = 'paper, eq. (3b)'
    starts = {'scale': (0.9, 1.1)}

    scale: float = quantity(1.0, low=0.05, high=20.0, doc='damping ratios over their nominal')

    def spacecraft(self, spacecraft):
        """Return the spacecraft with all damping ratios scaled."""
        return replace(spacecraft, arrays=tuple(
            replace(a, damping_ratio=a.damping_ratio * self.scale) for a in spacecraft.arrays))
