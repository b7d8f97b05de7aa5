"""The numbers of a spacecraft: what stands in `config/spacecraft.yaml`, as frozen records."""
from dataclasses import dataclass, field, replace
import math
import os
from pathlib import Path
import sys

import numpy as np

from ssi_ros.model.errors import Calibration
from ssi_ros.model.uncertainty import Uncertainty
from ssi_ros.quantity import check, from_mapping, quantity, to_mapping
from ssi_ros.whole_file import write_whole

INFINITE = float('inf')


@dataclass(frozen=True)
class Plate:
    """A thin, even, rectangular plate and the mesh that it is computed on."""

    length_m: float = quantity(8.0, unit='m', low=1e-3, high=1e3, doc='from root to tip')
    width_m: float = quantity(2.0, unit='m', low=1e-3, high=1e3, doc='across, along x_b')
    thickness_m: float = quantity(0.025, unit='m', low=1e-6, high=10.0,
                                  doc='equivalent thickness')
    density_kg_m3: float = quantity(88.0, unit='kg/m^3', low=1e-6, high=1e5,
                                    doc='equivalent density')
    stiffness_n_m: float = quantity(4000.0, unit='N m', low=1e-9, high=1e12,
                                    doc='bending stiffness D')
    poisson_ratio: float = quantity(0.3, low=0.0, high=0.499, doc='Poisson ratio nu')
    elements_along: int = quantity(16, low=1, high=64, doc='finite elements along the length')
    elements_across: int = quantity(4, low=1, high=64, doc='finite elements across the width')

    def __post_init__(self):
        check(self)

    @property
    def area_density_kg_m2(self):
        """Mass of a unit of area, rho h [kg/m^2]."""
        return self.density_kg_m3 * self.thickness_m


@dataclass(frozen=True)
class Hub:
    """The rigid body, by its matrix of inertia about its mass centre."""

    inertia_kg_m2: tuple = ((600.0, 0.0, 0.0), (0.0, 400.0, 0.0), (0.0, 0.0, 600.0))

    def __post_init__(self):
        try:
            inertia = np.array(self.inertia_kg_m2, dtype=float)
        except (TypeError, ValueError):
            inertia = np.empty(0)
        if inertia.shape != (3, 3) or not np.all(np.isfinite(inertia)):
            raise ValueError(f'inertia_kg_m2={self.inertia_kg_m2} must be three rows of three '
                             'numbers [kg m^2]')
        if not np.array_equal(inertia, inertia.T):
            raise ValueError(f'inertia_kg_m2={self.inertia_kg_m2} is not symmetric; give the same '
                             'product of inertia on both sides of the diagonal')
        least = np.linalg.eigvalsh(inertia)[0]
        if least <= 0.0:
            raise ValueError(f'inertia_kg_m2={self.inertia_kg_m2} has the principal moment '
                             f'{least:g} kg m^2; all three must be positive')
        object.__setattr__(self, 'inertia_kg_m2', tuple(map(tuple, inertia.tolist())))


@dataclass(frozen=True)
class SolarArray:
    """One flexible array, fixed to the hub along its root edge."""

    name: str = quantity('E1', doc='name that the sensors refer to')
    side: int = quantity(1, low=-1, high=1, doc='+1 along +y_b, -1 along -y_b')
    root_m: float = quantity(1.0, unit='m', low=0.0, high=1e3, doc='hub centre to root edge')
    plate: Plate = field(default_factory=Plate, metadata={'record': Plate})
    modes: int = quantity(10, low=1, high=200, doc='modes kept, from the lowest')
    damping_ratio: float = quantity(0.005, low=0.0, high=0.9, doc='damping ratio of every mode')
    hinge_n_m_rad: float = quantity(INFINITE, unit='N m/rad', low=1e-6,
                                    doc='stiffness of a bending hinge at the root, inf = clamp')

    def __post_init__(self):
        check(self)
        if self.side == 0:
            raise ValueError('side=0 must be +1 (along +y_b) or -1 (along -y_b)')


@dataclass(frozen=True)
class Sensor:
    """An accelerometer on an array that senses along z_b."""

    name: str = quantity('e1_a', doc='name of the channel and of its topic')
    array: str = quantity('E1', doc='name of the array it sits on')
    along_m: float = quantity(7.9, unit='m', low=0.0, high=1e3, doc='distance from the root')
    lateral_m: float = quantity(0.9, unit='m', low=-1e3, high=1e3, doc='position along x_b')

    def __post_init__(self):
        check(self)


@dataclass(frozen=True)
class ExcitationLevels:
    """Levels of the ambient excitation at 100 Hz; the spectral density holds at any rate."""

    torque_rms_n_m: tuple = quantity((0.1, 0.0, 0.0), unit='N m', low=0.0, high=1e6,
                                     doc='white torque about x_b, y_b, z_b')
    process_noise_rms: float = quantity(0.005, unit='N/kg^0.5', low=0.0, high=1e6,
                                        doc='white generalised force on every mode')
    torque_corner_hz: float = quantity(
        math.inf, unit='Hz', low=1e-6, doc='corner of a first-order low-pass of the torques')
    process_corner_hz: float = quantity(
        math.inf, unit='Hz', low=1e-6, doc='corner of one of the forces on the modes')
    torque_corner_std: float = quantity(
        0.0, unit='1', low=0.0, high=10.0, doc='how surely it is known, of its logarithm')
    process_corner_std: float = quantity(
        0.0, unit='1', low=0.0, high=10.0, doc='the same of the forces')

    def __post_init__(self):
        check(self)
        three(self, 'torque_rms_n_m')

    @property
    def corners(self):
        """Return corner [Hz] and its deviation by what is coloured: 'torque', 'process'."""
        return {'torque': (self.torque_corner_hz, self.torque_corner_std),
                'process': (self.process_corner_hz, self.process_corner_std)}


@dataclass(frozen=True)
class Spacecraft:
    """Everything that the simulator needs to know about a spacecraft."""

    hub: Hub = field(default_factory=Hub, metadata={'record': Hub})
    arrays: tuple = field(
        default=(SolarArray(), SolarArray(name='E2', side=-1)), metadata={'record': SolarArray})
    sensors: tuple = field(
        default=(Sensor(), Sensor('e1_b', 'E1', 7.9, -0.9),
                 Sensor('e2_a', 'E2', 7.9, 0.9), Sensor('e2_b', 'E2', 7.9, -0.9)),
        metadata={'record': Sensor})
    excitation: ExcitationLevels = field(default_factory=ExcitationLevels,
                                         metadata={'record': ExcitationLevels})
    noise_rms_m_s2: float = quantity(3e-4, unit='m/s^2', low=0.0, high=1e3,
                                     doc='white noise of every accelerometer')
    rate_hz: float = quantity(100.0, unit='Hz', low=1e-3, high=1e5, doc='sampling rate')
    momentum_n_m_s: tuple = quantity((0.0, 0.0, 0.0), unit='N m s', low=-1e6, high=1e6,
                                     doc='momentum stored in wheels along x_b, y_b, z_b')
    uncertainty: Uncertainty = field(default_factory=Uncertainty,
                                     metadata={'record': Uncertainty})
    calibration: Calibration = field(default_factory=Calibration,
                                     metadata={'record': Calibration})

    def __post_init__(self):
        check(self)
        three(self, 'momentum_n_m_s')
        for kind in ('arrays', 'sensors'):
            records = getattr(self, kind)
            names = [r.name for r in records] if isinstance(records, tuple) else []
            if not names or len(set(names)) < len(names):
                raise ValueError(f'{kind} have the names {names}; a list is needed, with at '
                                 'least one, each with its own name')
        for sensor in self.sensors:
            on_array(self.array(sensor.array), sensor.along_m, sensor.lateral_m, sensor.name)

    def at_errors(self, values):
        """Return the spacecraft with the errors of its numbers at values, (m,)."""
        return replace(self, calibration=replace(self.calibration, values=values))

    def array(self, name):
        """Return the array of that name, ValueError if there is none."""
        for array in self.arrays:
            if array.name == name:
                return array
        raise ValueError(f'array={name!r} is not on this spacecraft; it has '
                         + ', '.join(a.name for a in self.arrays))


def three(record, name):
    """Check that a quantity of a record is a vector of three numbers."""
    value = getattr(record, name)
    if not isinstance(value, tuple) or len(value) != 3:
        raise ValueError(f'{name}={value!r} must be three numbers, about x_b, y_b, z_b')


def on_array(array, along_m, lateral_m, what='the point'):
    """Check that a point lies on an array, ValueError if it is off."""
    length, half = array.plate.length_m, array.plate.width_m / 2
    if not (0.0 <= along_m <= length and -half <= lateral_m <= half):
        raise ValueError(f'{what} at along_m={along_m:g}, lateral_m={lateral_m:g} is off array '
                         f'{array.name}, which spans along_m 0 to {length:g} and lateral_m '
                         f'{-half:g} to {half:g}; move it onto the array')


def load_spacecraft(path=None):
    """
    Read a spacecraft from YAML.

    Parameters
    ----------
    path : str or Path, optional
        File; None reads the default that is packaged as `config/spacecraft.yaml`.

    Returns
    -------
    Spacecraft

    Raises
    ------
    ValueError
        If the file is not YAML, or a number in it is missing, unknown or out of range.
    OSError
        If the file cannot be read.

    """
    from ssi_ros.plain_yaml import read_plain
    path = packaged('spacecraft.yaml') if path is None else Path(path)
    plain = read_plain(path)
    try:
        return from_mapping(Spacecraft, plain)
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from None


def save_spacecraft(spacecraft, path):
    """Write a spacecraft to a YAML file that `load_spacecraft` reads back unchanged."""
    import yaml
    write_whole(path, yaml.safe_dump(to_mapping(spacecraft), sort_keys=False))


def packaged(name):
    """
    Return the path of a packaged configuration file.

    It is looked for in the ament prefixes, under `sys.prefix`, and beside the source tree.
    """
    shares = [Path(p) / 'share' / 'ssi_ros' / 'config'
              for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    shares.append(Path(sys.prefix) / 'share' / 'ssi_ros' / 'config')
    shares.append(Path(__file__).resolve().parents[2] / 'config')
    for share in shares:
        if (share / name).is_file():
            return share / name
    raise FileNotFoundError(f'{name} is in none of ' + ', '.join(map(str, shares)))
