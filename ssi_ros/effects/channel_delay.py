"""One channel arrives later than the others."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import channel_index
from ssi_ros.quantity import quantity


@effect
class ChannelDelay(Effect):
    """One channel shows what it measured `delay_s` before its stamp, eq. (89)."""

    name = 'channel_delay'
    site = Site.SENSOR
    size = 'delay_s'
    reference = 'shift theorem, on the band below half of the rate'
    starts = {'delay_s': (2e-4,)}
    follows = {'delay_s': 'sample'}
    patterns = (ModalPattern.CHANNEL_FILTER,)

    channel: str = quantity('e1_a', doc='channel')
    delay_s: float = quantity(0.0, unit='s', low=0.0, high=1.0, doc='delay')

    def apply(self, setup):
        """Return the setup with the delay."""
        delays = list(setup.delays_s or (0.0,) * len(setup.system.channels))
        delays[channel_index(setup.system, self.channel)] += self.delay_s
        return replace(setup, delays_s=tuple(delays))
