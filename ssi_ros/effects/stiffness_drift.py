"""The arrays change while they are watched, as with temperature."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.quantity import quantity


@effect
class StiffnessDrift(Effect):
    """D of every array goes linearly from D to (1 + change) D over the record, eq. (86)."""

    name = 'stiffness_drift'
    site = Site.STRUCTURE
    size = 'change'
    reference = 'Leissa, J. Sound Vib. 31(3) 1973, with D a function of time'
    starts = {'change': (-0.005, 0.005)}
    patterns = (ModalPattern.FREQUENCY_DRIFT,)

    change: float = quantity(0.0, low=-0.7, high=2.0, doc='relative change of D by the end')

    def apply(self, setup):
        """Return the setup with the drift."""
        return replace(setup, drift=(1.0 + setup.drift) * (1.0 + self.change) - 1.0)
