"""One mode loses more or less energy a cycle than the model has it."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.points import with_mode
from ssi_ros.quantity import quantity


@effect
class ModeDamping(Effect):
    """The damping ratio of one mode times `scale`; frequency, shape and the rest stay."""

    name = 'mode_damping'
    site = Site.STRUCTURE
    size = 'scale'
    reference = 'Friswell and Mottershead, Finite Element Model Updating, 1995 (modal residuals)'
    starts = {'scale': (0.9, 1.1)}
    needs = ('modes',)
    patterns = (ModalPattern.MODE_DAMPINGS,)

    mode: str = quantity('1', doc='number of the mode, by rising frequency')
    scale: float = quantity(1.0, low=0.05, high=20.0, doc='damping ratio over nominal')

    def apply(self, setup):
        """Return the setup with the mode damped."""
        return replace(setup, system=with_mode(setup.system, self.mode, damping=self.scale))
