"""What drives a simulation, as messages beside its samples."""
import math

from geometry_msgs.msg import WrenchStamped
from ssi_ros.bag.samples import input_channel
from ssi_ros.effects import inject
from ssi_ros.inputs.beside import driven_inputs
from ssi_ros.inputs.prediction import rows_before
from ssi_ros.model import assemble
from ssi_ros.model.excitation import begin_all
from ssi_ros.ros.messages import time_of


class DrawnInputs:
    """
    Draw again what drives the samples of a simulation, row by row, and publish it.

    Parameters
    ----------
    spacecraft : Spacecraft or LinearModel
        That is simulated.
    effects : sequence of Effect
        Injected into it; a disturbance that one adds is not recorded.
    settings : Simulation
        Seed and length.

    Raises
    ------
    ValueError
        If no input of the model has a level.

    """

    def __init__(self, spacecraft, effects, settings):
        setup = inject(spacecraft, effects, settings.duration_s or math.inf)
        self.names = driven_inputs(spacecraft)
        if not self.names:
            raise ValueError('record_input: no input of the model has a level, so there is '
                             'nothing to publish; give one a level, or set record_input to false')
        self.channels = [input_channel(n) for n in self.names]
        self.publishers, self._at, self._values = [], rows_before(setup), None
        system = setup.system
        self._columns = [system.inputs.index(n) for n in self.names]
        self._forces = begin_all(assemble(spacecraft).excitation, system.rate_hz, system.inputs,
                                 settings.seed)
        if self._at:
            self._forces(0, self._at)       # a filter of an input goes from row to row

    def draw(self, count):
        """Draw the inputs of the next rows."""
        self._values = self._forces(self._at, count)[:, self._columns]
        self._at += count

    def publish(self, k, stamp_ns):
        """Publish the inputs of a row of those that were drawn last."""
        for publisher, (_, field), name, value in zip(
                self.publishers, self.channels, self.names, self._values[k]):
            message = WrenchStamped()
            message.header.stamp, message.header.frame_id = time_of(stamp_ns), name
            _, part, axis = field.split('.')
            setattr(getattr(message.wrench, part), axis, float(value))
            publisher.publish(message)
