"""The root hinge of an array has Coulomb friction."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import change_array
from ssi_ros.model.nonlinear import HingeLaw
from ssi_ros.quantity import quantity


@effect
class HingeFriction(Effect):
    """Coulomb friction of torque_n_m beside the moment k alpha, eq. (87)."""

    name = 'hinge_friction'
    site = Site.STRUCTURE
    size = 'torque_n_m'
    reference = 'docs/theory.md, eq. (38)'
    starts = {'torque_n_m': (0.01,), 'stiffness_n_m_rad': (1e6, 1e5)}
    follows = {'torque_n_m': 'moment', 'stiffness_n_m_rad': 'hinge'}
    nonlinear = True
    hinge = True
    patterns = (ModalPattern.SOFTENING, ModalPattern.MODE_FREQUENCIES)
    gaussian = False

    array: str = quantity('E1', doc='array')
    torque_n_m: float = quantity(0.0, unit='N m', low=0.0, high=1e4, doc='Coulomb torque')
    stiffness_n_m_rad: float = quantity(1e5, unit='N m/rad', low=10.0, high=1e9,
                                        doc='hinge stiffness k')

    @classmethod
    def like(cls, stiffness, angle_rms):
        """Return values whose equivalent hinge has about a stiffness, eq. (96)."""
        # while it sticks a slider is stiff: what slides about the rms carries about half
        return [{'torque_n_m': share * stiffness * angle_rms, 'stiffness_n_m_rad': stiffness / 2}
                for share in (0.3, 1.0, 3.0)]

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the linear part of the hinge."""
        return change_array(spacecraft, self.array, hinge_n_m_rad=self.stiffness_n_m_rad)

    def apply(self, setup):
        """Return the setup with the nonlinear part of the hinge."""
        law = HingeLaw(f'{self.array}_hinge', 'friction', self.torque_n_m,
                       self.stiffness_n_m_rad)
        return replace(setup, laws=setup.laws + (law,))
