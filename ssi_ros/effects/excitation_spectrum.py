"""The excitation is not white, by any smooth colour: another law of `excitation_colour`."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, Site
from ssi_ros.effects.edits import unknown
from ssi_ros.model.excitation import Filtered, Shaped, Varying, White
from ssi_ros.quantity import quantity

DOC = 'times the Legendre polynomial of order {} in log f, three decades up to half of the rate'


def _decibels(order):
    return quantity(0.0, unit='dB', low=-30.0, high=30.0, doc=DOC.format(order))


@effect
class ExcitationSpectrum(Effect):
    """The power of torque and process noise is a polynomial in log f, in dB, eq. (82a)."""

    name = 'excitation_spectrum'
    law_of = 'excitation_colour'
    site = Site.EXCITATION
    size = 'slope_db'
    together = ('curvature_db', 'third_order_db', 'fourth_order_db')
    reference = 'Bendat and Piersol, Random Data, 2010, section 6 (shaping filter)'
    starts = {'slope_db': (3.0, 0.0), 'curvature_db': (0.0, 3.0), 'third_order_db': (0.0,),
              'fourth_order_db': (0.0,)}

    force: str = quantity('all', doc='torque, process_noise or levels of a model, joined by +')
    slope_db: float = _decibels(1)
    curvature_db: float = _decibels(2)
    third_order_db: float = _decibels(3)
    fourth_order_db: float = _decibels(4)

    def apply(self, setup):
        """Return the setup with this colour of what is random in the excitation."""
        if self.is_null:
            return setup
        orders = self.slope_db, *(getattr(self, name) for name in self.together)
        system = setup.system
        random = [p.name for p in system.excitation if isinstance(p, (White, Varying, Filtered))]
        chosen = random if self.force == 'all' else self.force.split('+')
        for name in chosen:
            if name not in random:
                raise ValueError(unknown(f'force {name!r}', name, ['all', *random]))
        parts = tuple(Shaped(p, orders, system.rate_hz / 2) if p.name in chosen else p
                      for p in system.excitation)
        return replace(setup, system=replace(system, excitation=parts))
