"""
A structure that somebody else has modelled: matrices, modes or a state space, and names.

It stands where a `Spacecraft` stands: effects are injected into it, records simulated and
diagnosed. It has no geometry, so what needs arrays, places on them or a hub is not offered on it.
"""
from dataclasses import dataclass, field, replace
from functools import cached_property
import hashlib
import math

import numpy as np
from scipy.fft import next_fast_len
from scipy.linalg import eigh

from ssi_ros.model.errors import Calibration
from ssi_ros.model.excitation import Coloured, LEVEL_RATE_HZ, White
from ssi_ros.model.modal_errors import declared_of_modes, with_modal_errors
from ssi_ros.model.model_checks import check_names, check_sizes, check_stationary
from ssi_ros.model.quadrature import modes_of, Quadrature
from ssi_ros.model.sensors import Noise
from ssi_ros.model.system import RIGID, System
from ssi_ros.model.uncertainty import EXACT
from ssi_ros.quantity import check, quantity
from ssi_ros.records import read_only

KINDS = {       # of channels: what a freedom is measured by, and the unit
    'acceleration': ('acceleration', 'm/s^2'), 'velocity': ('velocity', 'm/s'),
    'displacement': ('displacement', 'm'), 'angular_acceleration': ('acceleration', 'rad/s^2'),
    'angular_rate': ('velocity', 'rad/s'), 'angle': ('displacement', 'rad'),
    'strain': ('displacement', '1')}
USUAL_HZ, USUAL_NOISE = 100.0, 3e-4      # at which effects have the starts that they declare
DECAYS, FEWEST = 12.0, 4        # time constants in a segment; fewest segments of a slow model
TRANSLATIONS = ('acceleration', 'velocity', 'displacement')


@dataclass(frozen=True)
class Channel:
    """A sensor of a model: what its row of the output matrix means."""

    name: str = quantity('y', doc='name of the channel and of its topic')
    kind: str = quantity('acceleration', doc='what it measures: ' + ', '.join(KINDS))
    noise_rms: float = quantity(1e-3, unit='of the channel', low=1e-300, high=1e300,
                                doc='rms of its white noise')

    def __post_init__(self):
        check(self)
        if self.kind not in KINDS:
            raise ValueError(f'channel {self.name} has the kind {self.kind!r}; known: '
                             + ', '.join(KINDS))

    @property
    def unit(self):
        """Return the unit of its samples."""
        return KINDS[self.kind][1]


@dataclass(frozen=True)
class Input:
    """A random input of a model; inputs of one group have one level, which a diagnosis frees."""

    name: str = quantity('u', doc='name of the input')
    level: float = quantity(0.0, unit='of the input', low=0.0, high=1e300,
                            doc='rms, held over a sample of the model')
    corner_hz: float = quantity(float('inf'), unit='Hz', low=1e-6,
                                doc='corner of its first-order low-pass, inf for white')
    group: str = quantity('', doc='name of its level, its own name if empty')

    def __post_init__(self):
        check(self)

    @property
    def level_name(self):
        """Return the name of the level that it follows."""
        return self.group or self.name


@dataclass(frozen=True, eq=False)
class LinearModel:
    """
    A linear model with named freedoms, inputs and channels.

    Attributes
    ----------
    mass, damping, stiffness : ndarray, shape (n, n)
        M, D, K, in one consistent set of units.
    input : ndarray, shape (n, m)
        From inputs to forces on the freedoms.
    output : ndarray, shape (l, n)
        From freedoms to what the channels measure: of displacements for a displacement or strain,
        of velocities for a velocity or an angular rate, of accelerations for an acceleration.
    freedoms : tuple of str
        Names of the freedoms.
    drives : tuple of Input
        The inputs.
    sensors : tuple of Channel
        The channels.
    rate_hz : float
        Sampling rate [Hz].
    physical : bool
        Whether the freedoms are points, not coordinates of modes.
    quadrature : Quadrature or None
        Of a state space: see there.
    uncertainty : ModalUncertainty
        How wrong its numbers may be; EXACT takes them as they are.
    calibration : Calibration
        Errors of its modes, found from recordings; the matrices are without them.

    Raises
    ------
    ValueError
        For sizes that do not fit, names that repeat, matrices that are not symmetric or definite,
        and a system without a stationary state; the message says what to do.

    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    input: np.ndarray       # noqa: A003
    output: np.ndarray
    freedoms: tuple
    drives: tuple
    sensors: tuple
    rate_hz: float
    physical: bool = True
    quadrature: Quadrature = field(default=None, repr=False)

    uncertainty: object = EXACT     # or a ModalUncertainty
    calibration: Calibration = Calibration()

    arrays = ()             # a spacecraft has some

    def __post_init__(self):
        for name in ('mass', 'damping', 'stiffness', 'input', 'output'):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        if not (np.isfinite(self.rate_hz) and self.rate_hz > 0.0):
            raise ValueError(f'rate_hz={self.rate_hz:g} must be a positive number [Hz]')
        check_names(self)
        check_sizes(self)
        check_stationary(assemble_model(self))

    @property
    def offers(self):
        """Return what effects may need and find: 'modes', and 'points' that springs can join."""
        return ('modes', 'points') if self.points else ('modes',)

    @property
    def points(self):
        """Return the names of freedoms, and of channels between them, that springs can join."""
        if self.quadrature:
            return ()
        freedoms = self.freedoms if self.physical else ()
        return freedoms + tuple(
            s.name for s, row in zip(self.sensors, self.output)
            if s.kind in TRANSLATIONS and s.name not in freedoms
            and not (self.physical and np.count_nonzero(row) == 1))

    def usual(self, unit, place):
        """Return how large a unit is on it, over a spacecraft of 100 Hz and 3e-4 m/s^2 noise."""
        noise = {s.name: s.noise_rms for s in self.sensors}
        return {'Hz': self.rate_hz / USUAL_HZ, 's': USUAL_HZ / self.rate_hz,
                'm/s^2': noise.get(place.get('channel'), min(noise.values())) / USUAL_NOISE
                }.get(unit, 1.0)

    def cut(self, settings):
        """
        Return settings with segments in which the slowest mode dies out, if they were shorter.

        Else neighbouring bins and segments share its energy. With segments of 3.8 time constants
        the score of its damping deviates by 2.2 in place of 1, of 8 by 1.2, of 14 by 1.1 (thirty
        records of the shear building of examples/).
        """
        values = assemble_model(self).plant.diagonal[0]
        slowest = np.min(-values.real[values.imag > 0.0], initial=np.inf)
        needed_s = DECAYS / slowest
        if needed_s <= settings.segment_s:
            return settings
        # a length with a large prime factor is transformed in many times the time
        rows = next_fast_len(math.ceil(needed_s * self.rate_hz), real=True)
        return replace(settings, segment_s=rows / self.rate_hz, least_segments=FEWEST)

    @cached_property
    def vibrating(self):
        """Return the number of modes that are no motion of a rigid body."""
        squares = eigh(self.stiffness, self.mass, eigvals_only=True)
        return int(np.sum(squares > RIGID * squares[-1]))

    @cached_property
    def digest(self):
        """Return what two models that are the same have in common."""
        parts = [(self.freedoms, self.drives, self.sensors, self.rate_hz, self.physical)]
        parts += [m.tobytes() for m in (self.mass, self.damping, self.stiffness, self.input,
                                        self.output)]
        if self.quadrature is not None:
            q = self.quadrature
            parts += [m.tobytes() for m in (q.input, q.shapes, q.rest.a, q.rest.b, q.rest.c,
                                            q.rest.d)]
        parts.append((self.uncertainty, self.calibration))
        return hashlib.sha256(repr(parts).encode()).hexdigest()

    def __repr__(self):
        return f'LinearModel({self.digest})'

    def __eq__(self, other):
        return isinstance(other, LinearModel) and self.digest == other.digest

    def __hash__(self):
        return hash(self.digest)

    @property
    def declared(self):
        """Return names and deviations of the errors that it declares; see `errors.declared`."""
        return declared_of_modes(self)

    def at_errors(self, values):
        """Return the model with the errors of its modes at values, (m,)."""
        return replace(self, calibration=replace(self.calibration, values=values))

    @property
    def level_names(self):
        """Return the names of the groups of inputs that have a level of their own."""
        return list(dict.fromkeys(d.level_name for d in self.drives if d.level > 0.0))

    def at_levels(self, levels):
        """Return the model at powers of its random inputs, group by group, and of its noise."""
        *driven, noise = np.sqrt(levels)
        factor = dict(zip(self.level_names, driven))
        return replace(
            self, drives=tuple(replace(d, level=d.level * float(factor.get(d.level_name, 1.0)))
                               for d in self.drives),
            sensors=tuple(replace(s, noise_rms=s.noise_rms * float(noise)) for s in self.sensors))


def assemble_model(model):
    """
    Build the system of a LinearModel, with its excitation and its sensor chain.

    Parameters
    ----------
    model : LinearModel
        The numbers.

    Returns
    -------
    System

    """
    groups = {}
    for d in model.drives:
        if d.level > 0.0:
            groups.setdefault(d.level_name, []).append(d)
    # a level is an rms at the rate of the model, a White's at LEVEL_RATE_HZ
    scale = float(np.sqrt(LEVEL_RATE_HZ / model.rate_hz))
    parts = []
    for name, drives in groups.items():
        white = White(name, tuple(d.name for d in drives), tuple(d.level * scale for d in drives))
        corner = drives[0].corner_hz
        parts.append(Coloured(white, corner) if np.isfinite(corner) else white)
    return with_modal_errors(System(
        mass=model.mass, damping=model.damping, stiffness=model.stiffness, input=model.input,
        sensor=model.output, dofs=model.freedoms, inputs=tuple(d.name for d in model.drives),
        channels=tuple(s.name for s in model.sensors), excitation=tuple(parts),
        chain=(Noise(tuple(s.noise_rms for s in model.sensors)),), rate_hz=model.rate_hz,
        measured=tuple(KINDS[s.kind][0] for s in model.sensors),
        quadrature=model.quadrature, fitted=any(model.calibration.values)), model)


def modal_model(frequencies_hz, damping_ratios, shapes, participation, **names):
    """
    Return the LinearModel of modes of mass 1.

    Parameters
    ----------
    frequencies_hz, damping_ratios : ndarray, shape (n,)
        Of the modes; one damping ratio may serve all.
    shapes : ndarray, shape (l, n)
        What every channel shows of a unit of each mode.
    participation : ndarray, shape (n, m)
        Force of every input on each mode; for a point force that is the shape there.
    names
        `drives`, `sensors` and `rate_hz` of the model.

    """
    frequencies, ratios = (np.atleast_1d(np.squeeze(np.asarray(v, dtype=float)))
                           for v in (frequencies_hz, damping_ratios))
    if ratios.shape not in ((1,), frequencies.shape) or frequencies.ndim != 1:
        raise ValueError(f'there are {frequencies.size} frequencies_hz, but {ratios.size} '
                         'damping_ratios; give one for each, or one for all')
    if not (np.all(np.isfinite(frequencies)) and np.all(frequencies > 0.0)):
        raise ValueError('frequencies_hz must all be positive numbers; leave out rigid modes')
    omega = 2 * np.pi * frequencies
    return LinearModel(
        mass=np.eye(len(omega)), damping=np.diag(2 * ratios * omega),
        stiffness=np.diag(omega ** 2), input=participation, output=shapes, physical=False,
        freedoms=tuple(f'mode_{i + 1}' for i in range(len(omega))), **names)


def state_space_model(a, b, c, d, *, discrete, rate_hz, **names):
    """
    Return the LinearModel of a state space, sampled at `rate_hz` if it is discrete.

    Raises
    ------
    ValueError
        If the matrices do not fit each other, or `modes_of` refuses them.

    """
    a, b, c, d = (np.atleast_2d(np.asarray(m, dtype=float)) for m in (a, b, c, d))
    n, m, outputs = len(a), b.shape[1], len(c)
    wanted = (n, n), (n, m), (outputs, n), (outputs, m)
    if (a.shape, b.shape, c.shape, d.shape) != wanted:
        raise ValueError(f'a, b, c, d have the shapes {a.shape}, {b.shape}, {c.shape}, {d.shape}; '
                         f'with {n} states, {m} inputs and {outputs} channels they must be '
                         + ', '.join(map(str, wanted)))
    values, shapes, into, rest = modes_of(a, b, c, d, rate_hz if discrete else None)
    return LinearModel(
        mass=np.eye(len(values)), damping=np.diag(-2 * values.real),
        stiffness=np.diag(np.abs(values) ** 2), input=into.real, output=shapes.real,
        freedoms=tuple(f'mode_{i + 1}' for i in range(len(values))), rate_hz=rate_hz,
        physical=False, quadrature=Quadrature(read_only(into.imag), read_only(shapes.imag), rest),
        **names)
