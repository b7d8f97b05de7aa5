"""Two points rub on each other."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.places import GROUND
from ssi_ros.effects.points import amplitude_between, row_between, stiffness_between, with_law
from ssi_ros.quantity import quantity


@effect
class ConnectionFriction(Effect):
    """
    A slider that holds up to a force, in series with a spring, between two points, eq. (87).

    Before it slides it is a spring of `stiffness_percent` of k = 1 / r K^-1 r^T (presliding).
    """

    name = 'connection_friction'
    site = Site.STRUCTURE
    size = 'force'
    reference = 'Jenkins, Inst. Mech. Eng. 1962; Iwan, J. Appl. Mech. 33, 1966'
    starts = {'force': (1.0,), 'stiffness_percent': (3.0, 30.0)}
    needs = ('points',)
    nonlinear = True
    patterns = (ModalPattern.SOFTENING, ModalPattern.MODE_FREQUENCIES)
    gaussian = False

    freedom: str = quantity('', doc='point, see `ssi_ros model FILE`')
    to: str = quantity(GROUND, doc='the other point, or ground')
    force: float = quantity(0.0, low=0.0, high=1e15,
                            doc='Coulomb force, or torque, in the unit of the model')
    stiffness_percent: float = quantity(10.0, unit='%', low=0.01, high=1e4,
                                        doc='presliding stiffness over k')

    @classmethod
    def starts_on(cls, spacecraft, place):
        """Return the starts, with half of the force that would hold the motion as it is."""
        amplitude, stiffness = amplitude_between(spacecraft, **place)
        percents = cls.starts['stiffness_percent']
        middle = percents[0] / 100
        return {'force': (middle * stiffness * amplitude / 2,), 'stiffness_percent': percents}

    def apply(self, setup):
        """Return the setup with the slider."""
        row = row_between(setup, self.freedom, self.to)
        stiffness = self.stiffness_percent / 100 * stiffness_between(setup.system, row)
        return with_law(setup, row, f'{self.freedom} and {self.to}', 'friction', self.force,
                        stiffness)
