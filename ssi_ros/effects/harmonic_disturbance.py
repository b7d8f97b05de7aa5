"""A machine on the hub turns at a steady speed."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import add_part, input_name
from ssi_ros.model.disturbances import Sine
from ssi_ros.quantity import quantity


@effect
class HarmonicDisturbance(Effect):
    """A sine torque, about x_b unless an input is given, on for ever, eq. (83) and (83a)."""

    name = 'harmonic_disturbance'
    site = Site.EXCITATION
    size = 'torque_n_m'
    reference = 'paper, section 5.1 (white noise + sine)'
    starts = {'frequency_hz': (1.0, 5.0, 12.0, 25.0), 'torque_n_m': (0.01,)}
    spectral = False
    patterns = (ModalPattern.LINE,)

    frequency_hz: float = quantity(10.0, unit='Hz', low=0.05, high=1e4, doc='frequency')
    torque_n_m: float = quantity(0.0, unit='N m', low=0.0, high=1e4, doc='amplitude')
    drives: str = quantity('first', doc='input that it drives, or first')

    def apply(self, setup):
        """Return the setup with the sine among its excitation."""
        drives = input_name(setup.system, self.drives)
        return add_part(setup, Sine(drives, self.torque_n_m, self.frequency_hz, name=self.name,
                                    held=False))

    def driven_hz(self):
        """Return its frequency twice."""
        return self.frequency_hz, self.frequency_hz
