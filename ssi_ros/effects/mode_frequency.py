"""One mode is slower or faster than the model has it."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.points import with_mode
from ssi_ros.quantity import quantity


@effect
class ModeFrequency(Effect):
    """The natural frequency of one mode times `scale`; damping ratio, shape and the rest stay."""

    name = 'mode_frequency'
    site = Site.STRUCTURE
    size = 'scale'
    reference = 'Friswell and Mottershead, Finite Element Model Updating, 1995 (modal residuals)'
    starts = {'scale': (0.999, 1.001)}
    needs = ('modes',)
    patterns = (ModalPattern.MODE_FREQUENCIES,)

    mode: str = quantity('1', doc='number of the mode, by rising frequency')
    scale: float = quantity(1.0, low=0.5, high=2.0, doc='natural frequency over nominal')

    def apply(self, setup):
        """Return the setup with the mode moved."""
        return replace(setup, system=with_mode(setup.system, self.mode, frequency=self.scale))
