"""A wheel changes its speed during the record."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import add_part, input_name
from ssi_ros.model.disturbances import Chirp
from ssi_ros.quantity import quantity


@effect
class WheelSpeedSweep(Effect):
    """A sine torque of a frequency that changes linearly over the record, eq. (83) and (83a)."""

    name = 'wheel_speed_sweep'
    site = Site.EXCITATION
    size = 'torque_n_m'
    reference = 'NASA TP-3556 (Hubble, disturbances); form: linear chirp'
    starts = {'start_hz': (2.0, 10.0), 'end_hz': (10.0, 25.0), 'torque_n_m': (0.05,)}
    spectral = False
    patterns = (ModalPattern.CHIRP, ModalPattern.LINE)
    whole_record = True

    start_hz: float = quantity(5.0, unit='Hz', low=0.05, high=1e4, doc='first frequency')
    end_hz: float = quantity(15.0, unit='Hz', low=0.05, high=1e4, doc='last frequency')
    torque_n_m: float = quantity(0.0, unit='N m', low=0.0, high=1e4, doc='amplitude')
    drives: str = quantity('first', doc='input that it drives, or first')

    def in_record(self, begin_s, span_s, duration_s):
        """Return the sweep that goes on as it does in a part of the record."""
        rate = (self.end_hz - self.start_hz) / span_s
        start_hz = self.start_hz - rate * begin_s
        return self.within(**{**self.values(), 'start_hz': start_hz,
                              'end_hz': start_hz + rate * duration_s})

    def apply(self, setup):
        """Return the setup with the chirp among its excitation."""
        drives = input_name(setup.system, self.drives)
        return add_part(setup, Chirp(drives, self.torque_n_m, self.start_hz, self.end_hz,
                                     setup.duration_s, name=self.name, held=False))

    def driven_hz(self):
        """Return both ends."""
        return self.start_hz, self.end_hz
