"""The hub is lighter or heavier to turn than the model."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects.base import Effect, effect, in_deviations, ModalPattern, Site
from ssi_ros.quantity import quantity


@effect
class HubInertia(Effect):
    """The hub's own inertia J times `scale`; the arrays stay."""

    name = 'hub_inertia'
    site = Site.STRUCTURE
    size = 'scale'
    reference = 'paper, eq. (3a)'
    starts = {'scale': (0.98, 1.02)}
    patterns = (ModalPattern.MODE_FREQUENCIES,)

    scale: float = quantity(1.0, low=0.1, high=10.0, doc='inertia over its nominal value')

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the inertia scaled."""
        inertia = np.array(spacecraft.hub.inertia_kg_m2) * self.scale
        return replace(spacecraft, hub=replace(spacecraft.hub, inertia_kg_m2=inertia))

    def deviations(self, spacecraft):
        """Return the size in declared deviations of the model's own error."""
        return in_deviations(self.scale - 1, spacecraft.uncertainty.hub_inertia)
