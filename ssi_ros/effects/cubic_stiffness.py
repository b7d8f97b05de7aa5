"""The root hinge of an array hardens."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import change_array
from ssi_ros.model.nonlinear import HingeLaw
from ssi_ros.quantity import quantity


@effect
class CubicStiffness(Effect):
    """Moment k alpha + k3 alpha^3 in the root hinge, eq. (87)."""

    name = 'cubic_stiffness'
    site = Site.STRUCTURE
    size = 'k3_n_m_rad3'
    reference = 'docs/theory.md, eq. (38)'
    starts = {'k3_n_m_rad3': (1e14,), 'stiffness_n_m_rad': (1e5, 1e4)}
    follows = {'k3_n_m_rad3': 'cubic', 'stiffness_n_m_rad': 'hinge'}
    nonlinear = True
    hinge = True
    patterns = (ModalPattern.HARDENING, ModalPattern.MODE_FREQUENCIES)
    gaussian = False

    array: str = quantity('E1', doc='array')
    k3_n_m_rad3: float = quantity(0.0, unit='N m/rad^3', low=0.0, high=1e30,
                                  doc='cubic stiffness k3')
    stiffness_n_m_rad: float = quantity(1e5, unit='N m/rad', low=10.0, high=1e9,
                                        doc='hinge stiffness k')

    @classmethod
    def like(cls, stiffness, angle_rms):
        """Return values whose equivalent hinge has a stiffness, the angle Gaussian, eq. (96)."""
        # k + 3 k3 rms^2
        return [{'k3_n_m_rad3': share * stiffness / (3 * angle_rms ** 2),
                 'stiffness_n_m_rad': (1 - share) * stiffness} for share in (0.2, 0.6, 0.95)]

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the linear part of the hinge."""
        return change_array(spacecraft, self.array, hinge_n_m_rad=self.stiffness_n_m_rad)

    def apply(self, setup):
        """Return the setup with the nonlinear part of the hinge."""
        law = HingeLaw(f'{self.array}_hinge', 'cubic', self.k3_n_m_rad3,
                       self.stiffness_n_m_rad)
        return replace(setup, laws=setup.laws + (law,))
