"""The root of an array is compliant: a hinge in place of the clamp."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import change_array
from ssi_ros.quantity import quantity


@effect
class HingeCompliance(Effect):
    """A linear bending hinge at the root of an array, moment k alpha."""

    name = 'hinge_compliance'
    site = Site.STRUCTURE
    size = 'stiffness_n_m_rad'
    reference = 'docs/theory.md, section 2 (plate with a hinged root)'
    starts = {'stiffness_n_m_rad': (3e6, 3e5, 3e4)}
    follows = {'stiffness_n_m_rad': 'hinge'}
    power = -1.0
    hinge = True
    patterns = ModalPattern.MODE_FREQUENCIES, ModalPattern.CHANNEL_SHAPE

    array: str = quantity('E1', doc='array')
    stiffness_n_m_rad: float = quantity(float('inf'), unit='N m/rad', low=10.0,
                                        doc='hinge stiffness k')

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the hinge."""
        return change_array(spacecraft, self.array, hinge_n_m_rad=self.stiffness_n_m_rad)
