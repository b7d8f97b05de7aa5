"""The excitation is not white: less at high frequency."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.model.excitation import Coloured, Filtered, Varying, White
from ssi_ros.quantity import quantity


@effect
class ExcitationColour(Effect):
    """Torque and process noise pass a first-order low-pass before they act, eq. (82)."""

    name = 'excitation_colour'
    site = Site.EXCITATION
    size = 'corner_hz'
    reference = 'paper, section 4.2 (shaping filter)'
    starts = {'corner_hz': (300.0, 60.0, 12.0)}
    follows = {'corner_hz': 'rate'}
    power = -2.0
    patterns = (ModalPattern.COMMON_FILTER,)

    corner_hz: float = quantity(float('inf'), unit='Hz', low=0.01, doc='corner of the low-pass')

    def apply(self, setup):
        """Return the setup with the low-pass on all that is random in the excitation."""
        random = White, Varying, Filtered
        parts = tuple(Coloured(p, self.corner_hz) if isinstance(p, random) else p
                      for p in setup.system.excitation)
        return replace(setup, system=replace(setup.system, excitation=parts))
