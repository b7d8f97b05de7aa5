"""
What an effect is: a frozen record that changes a `Setup`, declared in a file of its own.

Every quantity's default is its null value, so an effect at its defaults changes nothing and every
model with an effect contains the nominal one. `site` is the word that localisation answers with.
"""
from dataclasses import dataclass, field, fields
from enum import Enum
import math

import numpy as np

from ssi_ros.model.spacecraft import Spacecraft
from ssi_ros.model.system import System
from ssi_ros.quantity import check, quantities


class Site(str, Enum):
    """Where an effect acts."""

    EXCITATION = 'excitation'
    STRUCTURE = 'structure'
    SENSOR = 'sensor'
    TIMING = 'timing'


@dataclass(frozen=True, eq=False)
class Setup:
    """
    A simulator made ready: the linear system, and what matrices cannot say.

    Attributes
    ----------
    spacecraft : Spacecraft
        The numbers that the system was assembled from.
    system : System
        Structure, excitation and sensor chain; its rate is that of the true sampling clock.
    stamp_rate_hz : float
        Rate that the stamps claim [Hz].
    duration_s : float
        Length of the record, which some effects stretch over [s].
    laws : tuple of HingeLaw
        Nonlinear hinges; the system then has explicit hinges.
    drift : float
        Relative change of every array's D from the first to the last sample [1].
    delays_s : tuple of float
        Delay of every channel [s]; empty for none.
    jitter_rms_s : float
        Wander of the sampling instants [s].
    corners_hz : tuple of (int, float)
        Butterworth low-passes: channel and corner [Hz].
    powers : dict of str to float
        Power of a part of the excitation over nominal, at which nonlinear hinges are linearised.
    lags : tuple of (ndarray, ndarray)
        Rows (m,) of inputs that reach the channels by columns (l,) a sample late, not at once.
    near : tuple of ndarray, optional
        Where the linear equivalents of the laws of a setup near by stand, for a search to begin.

    """

    spacecraft: Spacecraft
    system: System
    stamp_rate_hz: float
    duration_s: float
    laws: tuple = ()
    drift: float = 0.0
    delays_s: tuple = ()
    jitter_rms_s: float = 0.0
    corners_hz: tuple = ()
    powers: dict = field(default_factory=dict)
    lags: tuple = ()
    near: tuple = None

    def reading(self, frequencies_hz):
        """Return what delays and low-passes make of every channel, (k, l) complex, eq. (89)."""
        s = 2j * math.pi * np.asarray(frequencies_hz)
        delays = np.array(self.delays_s or (0.0,) * len(self.system.channels))
        response = np.exp(-s[:, None] * delays)
        for channel, corner_hz in self.corners_hz:
            w = 2 * math.pi * corner_hz
            response[:, channel] /= 1 + math.sqrt(2) * s / w + (s / w) ** 2
        return response


class Effect:
    """
    One unmodelled effect; a subclass is a frozen record made by `@effect`.

    Class attributes: `name`, `site`, `size` (the quantity that is null when there is no effect),
    `reference` (where the physics is written), `starts` (values from which a fit begins, and which
    score the effect), `together` (other quantities that are null and grow with the size, as the
    second coordinate of a shift does), `spectral` (whether the expected spectrum tells its
    numbers; if not, a sign of the samples or of the torque does), `nonlinear` (then its expected
    spectrum is not exact), `hinge` (whether it sets the root hinge of its array, which only one
    effect can), `power` (of its size, that the change of a spectrum follows where it is small: 2
    for an rms, -2 for a corner).
    """

    name = ''
    site = None
    size = ''
    reference = ''
    starts = {}
    together = ()
    spectral = True
    nonlinear = False
    hinge = False
    power = 1.0

    def __post_init__(self):
        check(self)

    @property
    def is_null(self):
        """Whether the effect is at the value that changes nothing."""
        return all(getattr(self, f.name) == f.default for f in fields(self)
                   if f.name in (self.size, *self.together))

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the effect in its numbers."""
        return spacecraft

    def apply(self, setup):
        """Return the setup with the effect in it, after all spacecraft hooks have run."""
        return setup

    @classmethod
    def starts_on(cls, spacecraft, place):
        """Return `starts` for a spacecraft and the words of a place; positions follow its size."""
        return cls.starts

    @classmethod
    def one_sided(cls):
        """Return whether the size cannot have the other sign, as a mass cannot."""
        size = next(f for f in cls.numbers() if f.name == cls.size)
        return size.default in (size.metadata['low'], size.metadata['high'])

    @classmethod
    def numbers(cls):
        """Return the fields of the quantities that are numbers, which a fit can move."""
        return tuple(f for f in quantities(cls) if not isinstance(f.default, str))

    @classmethod
    def words(cls):
        """Return the fields of the quantities that name a channel or an array."""
        return tuple(f for f in quantities(cls) if isinstance(f.default, str))

    def text(self):
        """Return the effect as the command line writes it, `name:param=value,...`."""
        pairs = ','.join(f'{f.name}={_plain(getattr(self, f.name))}' for f in quantities(self))
        return f'{self.name}:{pairs}'


def _plain(value):
    return value if isinstance(value, str) else f'{value:.9g}'


def is_log(f):
    """Return whether a quantity is fitted by its logarithm: positive, and null at 0 or inf."""
    null = f.default
    return f.metadata['low'] >= 0.0 and (null == 0.0 or math.isinf(null) or null > 1.5)


_KNOWN = {}


def effect(cls):
    """Make a subclass of Effect a frozen record and enter it in the library."""
    cls = dataclass(frozen=True)(cls)
    names = [f.name for f in quantities(cls)]
    if not (cls.name and isinstance(cls.site, Site) and cls.size in names):
        raise TypeError(f'{cls.__name__} needs a name, a site, and as size one of {names}')
    if cls.name in _KNOWN and _KNOWN[cls.name].__module__ != cls.__module__:
        raise TypeError(f'the effect {cls.name} is declared twice: in '
                        f'{_KNOWN[cls.name].__module__} and {cls.__module__}')
    _KNOWN[cls.name] = cls
    return cls


def known():
    """Return the effects declared so far, by name; `library` loads them all first."""
    return _KNOWN
