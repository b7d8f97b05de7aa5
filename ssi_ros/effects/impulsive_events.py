"""Small jolts at random: stick-slip, micrometeoroids, thermal creaks."""
from ssi_ros.effects.base import Effect, effect, Site
from ssi_ros.effects.edits import add_part
from ssi_ros.model.disturbances import Pulses
from ssi_ros.quantity import quantity


@effect
class ImpulsiveEvents(Effect):
    """Poisson torque pulses about x_b, each one sample long, eq. (84)."""

    name = 'impulsive_events'
    site = Site.EXCITATION
    size = 'impulse_n_m_s'
    reference = 'Poisson shot noise; its spectrum is white (Campbell)'
    starts = {'rate_per_min': (6.0,), 'impulse_n_m_s': (0.01,)}
    spectral = False

    rate_per_min: float = quantity(6.0, unit='1/min', low=0.01, high=6e4, doc='mean rate')
    impulse_n_m_s: float = quantity(0.0, unit='N m s', low=-1e3, high=1e3, doc='of each pulse')

    def apply(self, setup):
        """Return the setup with the pulses among its excitation."""
        return add_part(setup, Pulses('torque_x', self.impulse_n_m_s, self.rate_per_min,
                                      name='impulsive_events'))
