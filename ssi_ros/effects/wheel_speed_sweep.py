"""A wheel changes its speed during the record."""
from ssi_ros.effects.base import Effect, effect, Site
from ssi_ros.effects.edits import add_part
from ssi_ros.model.disturbances import Chirp
from ssi_ros.quantity import quantity


@effect
class WheelSpeedSweep(Effect):
    """A sine torque about x_b whose frequency changes linearly over the record, eq. (83)."""

    name = 'wheel_speed_sweep'
    site = Site.EXCITATION
    size = 'torque_n_m'
    reference = 'NASA TP-3556 (Hubble, disturbances); form: linear chirp'
    starts = {'start_hz': (2.0, 10.0), 'end_hz': (10.0, 25.0), 'torque_n_m': (0.05,)}
    spectral = False

    start_hz: float = quantity(5.0, unit='Hz', low=0.05, high=1e4, doc='first frequency')
    end_hz: float = quantity(15.0, unit='Hz', low=0.05, high=1e4, doc='last frequency')
    torque_n_m: float = quantity(0.0, unit='N m', low=0.0, high=1e4, doc='amplitude')

    def apply(self, setup):
        """Return the setup with the chirp among its excitation."""
        return add_part(setup, Chirp('torque_x', self.torque_n_m, self.start_hz, self.end_hz,
                                     setup.duration_s, name='wheel_speed_sweep'))
