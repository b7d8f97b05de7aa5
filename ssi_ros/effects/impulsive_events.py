"""Small impulses at random: stick-slip, micrometeoroids, thermal creaks."""
import math

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import add_part, input_name
from ssi_ros.model.disturbances import Pulses
from ssi_ros.quantity import quantity


@effect
class ImpulsiveEvents(Effect):
    """Poisson torque pulses, each a sample long, about x_b unless an input is given, eq. (84)."""

    name = 'impulsive_events'
    site = Site.EXCITATION
    size = 'impulse_n_m_s'
    reference = 'Poisson shot noise; its spectrum is white (Campbell)'
    starts = {'rate_per_min': (6.0,), 'impulse_n_m_s': (0.01,)}
    spectral = False
    patterns = (ModalPattern.IMPULSES,)
    gaussian = False

    rate_per_min: float = quantity(6.0, unit='1/min', low=0.01, high=6e4, doc='mean rate')
    impulse_n_m_s: float = quantity(0.0, unit='N m s', low=-1e3, high=1e3, doc='of each pulse')
    drives: str = quantity('first', doc='input that it drives, or first')

    def apply(self, setup):
        """Return the setup with the pulses among its excitation."""
        return add_part(setup, Pulses(input_name(setup.system, self.drives), self.impulse_n_m_s,
                                      self.rate_per_min, name=self.name))

    def driven_hz(self):
        """Return all frequencies."""
        return 0.0, math.inf
