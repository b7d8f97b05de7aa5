"""A spring between two points has play."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.places import GROUND
from ssi_ros.effects.points import amplitude_between, row_between, stiffness_between, with_law
from ssi_ros.quantity import quantity


@effect
class ConnectionPlay(Effect):
    """
    The spring k = 1 / r K^-1 r^T between two points does not act within +-gap, eq. (87).

    In a chain that is the spring that the model has between them.
    """

    name = 'connection_play'
    site = Site.STRUCTURE
    size = 'gap'
    reference = 'docs/theory.md, eq. (38)'
    starts = {'gap': (1e-6,)}
    needs = ('points',)
    nonlinear = True
    patterns = (ModalPattern.HARDENING, ModalPattern.MODE_FREQUENCIES)
    gaussian = False

    freedom: str = quantity('', doc='point, see `ssi_ros model FILE`')
    to: str = quantity(GROUND, doc='the other point, or ground')
    gap: float = quantity(0.0, low=0.0, high=1e6, doc='half of the play, in the unit of the model')

    @classmethod
    def starts_on(cls, spacecraft, place):
        """Return a gap that is a small share of the motion."""
        return {'gap': (0.05 * amplitude_between(spacecraft, **place)[0],)}

    def apply(self, setup):
        """Return the setup with the play."""
        row = row_between(setup, self.freedom, self.to)
        return with_law(setup, row, f'{self.freedom} and {self.to}', 'freeplay', self.gap,
                        stiffness_between(setup.system, row))
