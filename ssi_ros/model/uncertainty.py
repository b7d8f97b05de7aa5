"""How wrong the numbers of a model may be: the block `uncertainty` of a spacecraft's YAML."""
from dataclasses import dataclass, field

from ssi_ros.quantity import check, quantity

# Standard deviations of a finite element model that nobody has tested: its frequencies err by 0.5
# to 5 %, its damping by half, its shapes by a MAC of 0.9.
FREQUENCY, DAMPING, SHAPE = 0.01, 0.3, 0.03
# Random vibration tests hold a spectrum to +-3 dB, MIL-STD-1540; as two deviations, of amplitudes.
FORCE = 0.17


@dataclass(frozen=True)
class ModeUncertainty:
    """What is known better, or worse, of one mode of one clamped array."""

    array: str = quantity('E1', doc='array that the mode is of')
    mode: int = quantity(1, low=1, high=200, doc='number of the mode, from the lowest')
    frequency: float = quantity(FREQUENCY, low=0.0, high=0.5,
                                doc='relative standard deviation of its natural frequency')
    damping: float = quantity(DAMPING, low=0.0, high=3.0,
                              doc='standard deviation of the logarithm of its damping ratio')
    participation: float = quantity(SHAPE, low=0.0, high=1.0,
                                    doc='relative standard deviation of its coupling to the hub')
    shape: float = quantity(SHAPE, low=0.0, high=1.0,
                            doc='relative standard deviation of its shape at each sensor')

    def __post_init__(self):
        check(self)


@dataclass(frozen=True)
class Uncertainty:
    """
    Standard deviations of the numbers of a model, each error independent of all others.

    The defaults suit a finite element model that nobody has tested; 0 says that a number is exact.
    Levels of the inputs are always free and need no declaration; `modal_force` says how much the
    forces on the modes differ in level from each other, in every recording anew.
    """

    frequency: float = quantity(FREQUENCY, low=0.0, high=0.5,
                                doc='relative standard deviation of the natural frequency of '
                                    'every mode of every clamped array')
    damping: float = quantity(DAMPING, low=0.0, high=3.0,
                              doc='standard deviation of the logarithm of every damping ratio')
    participation: float = quantity(SHAPE, low=0.0, high=1.0,
                                    doc='relative standard deviation of the coupling of every '
                                        'mode to the hub')
    shape: float = quantity(SHAPE, low=0.0, high=1.0,
                            doc='relative standard deviation of every mode shape at each sensor')
    hub_inertia: float = quantity(0.02, low=0.0, high=0.5,
                                  doc='relative standard deviation of each moment of inertia of '
                                      'the hub')
    gain: float = quantity(0.001, low=0.0, high=0.5,
                           doc='relative standard deviation of the gain of every channel')
    sensor_place_m: float = quantity(0.01, unit='m', low=0.0, high=10.0,
                                     doc='standard deviation of the place of every sensor, along '
                                         'the array and across')
    modal_force: float = quantity(FORCE, low=0.0, high=3.0,
                                  doc='standard deviation of the logarithm of the force on every '
                                      'mode, over that on all of them')
    modes: tuple = field(default=(), metadata={'record': ModeUncertainty})

    def __post_init__(self):
        check(self)

    @property
    def exact(self):
        """Whether no number of the structure is declared uncertain."""
        return not (self.modes or any((
            self.frequency, self.damping, self.participation, self.shape, self.hub_inertia,
            self.gain, self.sensor_place_m)))

    def of_mode(self, array, mode):
        """Return what is known of one mode, counted from 1: a ModeUncertainty."""
        for given in self.modes:
            if (given.array, given.mode) == (array, mode):
                return given
        return ModeUncertainty(array, mode, self.frequency, self.damping, self.participation,
                               self.shape)


EXACT = Uncertainty(*[0.0] * 8)     # of a model that is what is recorded, as in a simulation
