# Licensed under the Apache License, Version 2.0.
"""
What a spacecraft is: hub, arrays, sensors, excitation; the published one is the default.

Two of these make a case: the nominal, which the diagnosis is given, and the truth, which differs
from it in the frequency, damping, participation and shape of every mode, and in its mesh.
"""
from dataclasses import dataclass
from functools import lru_cache
from math import inf

from blindgen.physics.plate import clamped_modes, gauss_points, Plate
import numpy as np


@dataclass(frozen=True)
class Array:
    """One array, clamped to the hub; the tuples have one number a mode."""

    name: str
    side: float                    # +1 along +y_b, -1 along -y_b
    plate: Plate
    damping: tuple
    root_m: float = 1.0
    frequency: tuple = ()          # factor on each clamped frequency; () is one
    participation: tuple = ()      # factor on what the hub feels of each mode
    tested_hz: tuple = ()          # clamped frequencies of a ground test, to last_digit_hz
    last_digit_hz: float = 0.0005

    @property
    def modes(self):
        """Return how many modes are kept."""
        return len(self.damping)


@dataclass(frozen=True)
class Sensor:
    """One accelerometer along z_b; shape has a factor on each mode's deflection there."""

    name: str
    array: int
    along_m: float
    lateral_m: float
    shape: tuple = ()
    offset: float = 0.0            # instant of its sample after the scan's, in sample periods


@dataclass(frozen=True)
class Spacecraft:
    """A hub with arrays and sensors, what excites it and how it is sampled; SI units."""

    arrays: tuple
    sensors: tuple
    hub_inertia: tuple = (600.0, 400.0, 600.0)
    torque_rms: tuple = (0.1, 0.0, 0.0)     # white, held over a sample [N m]
    process_rms: float = 0.005              # on each nominal modal coordinate, white, held
    noise_rms: float = 3e-4                 # [m/s^2] of each channel
    rate_hz: float = 100.0
    torque_corner_hz: float = inf           # first-order low-pass of the torques
    process_corner_hz: float = inf          # of the modal forces

    @property
    def channels(self):
        """Return the sensors' names."""
        return tuple(s.name for s in self.sensors)

    @property
    def names(self):
        """Return the arrays' names."""
        return tuple(a.name for a in self.arrays)

    @property
    def modes(self):
        """Return how many modal coordinates there are."""
        return sum(a.modes for a in self.arrays)

    @property
    def inputs(self):
        """Return how many inputs there are: three torques and one force a mode."""
        return 3 + self.modes

    def block(self, array):
        """Return the slice of the modal coordinates of an array, the first of all being 3."""
        begin = 3 + sum(a.modes for a in self.arrays[:array])
        return slice(begin, begin + self.arrays[array].modes)


@lru_cache(maxsize=64)
def shapes_of(plate, count):
    """Return the clamped modes of a plate, and its quadrature with the shapes there."""
    shapes = clamped_modes(plate, count=count)
    s, x, area = gauss_points(plate, 20, 12)
    return shapes, (s, x, area, shapes.at(s, x))


@lru_cache(maxsize=4096)
def _shape_at(plate, count, along_m, lateral_m):
    return shapes_of(plate, count)[0].at(along_m, lateral_m)[0]


def deflections(array, along_m, lateral_m, factors=()):
    """Return the deflection (modes,) of an array's modes at a point [1/sqrt(kg)]."""
    row = _shape_at(array.plate, array.modes, float(along_m), float(lateral_m))
    return row * factors if len(factors) else row


def clamped_omega(array):
    """Return the clamped frequencies (modes,) [rad/s] of an array."""
    omega = shapes_of(array.plate, array.modes)[0].omega
    if array.tested_hz:
        tested = np.array(array.tested_hz)
        omega = 2 * np.pi * np.clip(omega / (2 * np.pi), tested - array.last_digit_hz,
                                    tested + array.last_digit_hz)
    return omega * array.frequency if array.frequency else omega


# Clamped frequencies of the published table, Hz: what a ground test of the arrays gave. Our own
# mesh differs from the table's by up to 0.1 %, many times the spread of an identified frequency.
GROUND_TEST_HZ = (0.361, 2.260, 2.918, 6.345, 9.009, 12.484, 15.828, 20.707, 23.768, 30.978)
PUBLISHED = Spacecraft(
    tuple(Array(name, side, Plate(), 10 * (0.005,), tested_hz=GROUND_TEST_HZ)
          for name, side in (('E1', 1.0), ('E2', -1.0))),
    tuple(Sensor(f'e{1 + i}_{end}', i, 7.9, lateral) for i in range(2)
          for end, lateral in (('a', 0.9), ('b', -0.9))))
