"""The root hinge of an array has play."""
from dataclasses import replace

from scipy.special import ndtr

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import change_array
from ssi_ros.model.nonlinear import HingeLaw
from ssi_ros.quantity import quantity


@effect
class HingeFreeplay(Effect):
    """No moment within +-gap_rad, k (|alpha| - gap) beyond, eq. (87)."""

    name = 'hinge_freeplay'
    site = Site.STRUCTURE
    size = 'gap_rad'
    reference = 'docs/theory.md, eq. (38)'
    starts = {'gap_rad': (3e-7,), 'stiffness_n_m_rad': (1e6, 1e5)}
    follows = {'gap_rad': 'angle', 'stiffness_n_m_rad': 'hinge'}
    nonlinear = True
    hinge = True
    patterns = (ModalPattern.MODE_FREQUENCIES, ModalPattern.HARDENING, ModalPattern.SOFTENING,
                ModalPattern.IMPULSES)
    gaussian = False

    array: str = quantity('E1', doc='array')
    gap_rad: float = quantity(0.0, unit='rad', low=0.0, high=0.1, doc='half of the play')
    stiffness_n_m_rad: float = quantity(1e5, unit='N m/rad', low=10.0, high=1e9,
                                        doc='hinge stiffness k')

    @classmethod
    def like(cls, stiffness, angle_rms):
        """Return values whose equivalent hinge has a stiffness, the angle Gaussian, eq. (96)."""
        # gain of a dead zone: 2 Phi(-gap / rms)
        return [{'gap_rad': share * angle_rms,
                 'stiffness_n_m_rad': float(stiffness / (2 * ndtr(-share)))}
                for share in (0.3, 0.8, 1.5)]

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the linear part of the hinge."""
        return change_array(spacecraft, self.array, hinge_n_m_rad=self.stiffness_n_m_rad)

    def apply(self, setup):
        """Return the setup with the nonlinear part of the hinge."""
        law = HingeLaw(f'{self.array}_hinge', 'freeplay', self.gap_rad,
                       self.stiffness_n_m_rad)
        return replace(setup, laws=setup.laws + (law,))
