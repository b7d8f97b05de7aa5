"""
What an effect is: a frozen record that changes a `Setup`, declared in a file of its own.

Every quantity's default is its null value, so an effect at its defaults changes nothing and every
model with an effect contains the nominal one. `site` is where localisation places it.
"""
from dataclasses import dataclass, field, fields, replace
from enum import Enum
import math

import numpy as np

from ssi_ros.effects.scales import scales_of
from ssi_ros.model.spacecraft import Spacecraft
from ssi_ros.model.system import System
from ssi_ros.quantity import check, in_range, quantities


INPUT = 'drives'        # quantity that names an input: which one is given, not sought
SMALL = 2e-4            # of a starting value: what goes by its square is as small a share of it


class Site(str, Enum):
    """Where an effect acts."""

    EXCITATION = 'excitation'
    STRUCTURE = 'structure'
    SENSOR = 'sensor'
    TIMING = 'timing'


class ModalPattern(str, Enum):
    """
    What an effect shows of itself where there are modes, but no geometry: in a recording.

    Effects that declare one pattern cannot be distinguished by it.
    """

    COMMON_FREQUENCY_RATIO = 'all natural frequencies times one factor'
    MODE_FREQUENCIES = 'natural frequencies changed, each by its own factor'
    FREQUENCY_DRIFT = 'natural frequencies that change through the record'
    COMMON_DAMPING_RATIO = 'all damping ratios times one factor'
    MODE_DAMPINGS = 'damping ratios changed, each by its own factor'
    HARDENING = 'natural frequencies that rise with the amplitude'
    SOFTENING = 'natural frequencies that fall with the amplitude'
    NEW_MODE = 'a mode that the recording before did not have'
    CHANNEL_SHAPE = 'components of the mode shapes changed at one channel, or near it'
    COMMON_FILTER = 'one filter on all channels'
    CHANNEL_FILTER = 'a filter or a gain on one channel'
    CHANNEL_NOISE = 'noise added to one channel'
    SAMPLING = 'instants at which the channels are sampled'
    SAMPLE_VALUES = 'values of the samples, each by itself'
    LINE = 'a line at one frequency'
    CHIRP = 'a line whose frequency changes through the record'
    IMPULSES = 'single events'
    AMPLITUDE_MODULATION = 'a level of all channels that changes through the record'


@dataclass(frozen=True, eq=False)
class Setup:
    """
    A simulator made ready: the linear system, and what matrices cannot say.

    Attributes
    ----------
    spacecraft : Spacecraft or LinearModel
        The numbers that the system was assembled from.
    system : System
        Structure, excitation and sensor chain; its rate is that of the true sampling clock.
    stamp_rate_hz : float
        Rate that the stamps claim [Hz].
    duration_s : float
        Length of the record, which some effects stretch over [s].
    laws : tuple of HingeLaw or JointLaw
        Nonlinear hinges, or joints of a LinearModel; the system then has inputs of their names.
    drift : float
        Relative change of every array's D from the first to the last sample [1].
    delays_s : tuple of float
        Delay of every channel [s]; empty for none.
    jitter_rms_s : float
        Error of the sampling instants, rms [s].
    corners_hz : tuple of (int, float)
        Butterworth low-passes: channel and corner [Hz].
    powers : dict of str to float
        Power of each excitation over nominal, at which nonlinear hinges are linearised.
    lags : tuple of (ndarray, ndarray)
        Rows (m,) of inputs that reach the channels by columns (l,) a sample late, not at once.
    late : tuple of float
        By how many samples later than its row each channel is read; empty for none.
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
    late: tuple = ()
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


def lateness(late, cycles):
    """Return the phases (k, l) of channels that are read late [samples], at cycles a sample."""
    return np.exp(2j * np.pi * np.asarray(cycles)[:, None] * np.array(late))


class Effect:
    """
    One unmodelled effect; a subclass is a frozen record made by `@effect`.

    Attributes
    ----------
    name : str
        By which it is given on the command line.
    law_of : str
        Name of the effect that it is another law of, and that an answer names; empty for none.
    site : Site
        Where it acts.
    size : str
        The quantity that is null when there is no effect.
    reference : str
        Where the physics is written.
    starts : dict of str to tuple of float
        Values from which a fit begins, and which score the effect.
    follows : dict of str to str
        By which of `ssi_ros.effects.scales` the starts of a quantity go with a spacecraft.
    together : tuple of str
        Other quantities that are null and grow with the size, as the second coordinate of a shift.
    spectral : bool
        Whether the expected spectrum shows its quantities; if not, a detector does.
    nonlinear : bool
        Whether its expected spectrum is not exact.
    hinge : bool
        Whether it sets the root hinge of its array, which only one effect can.
    power : float
        Of its size, that the change of a spectrum follows where it is small: 2 for an rms, -2 for
        a corner.
    second_degree : bool
        Whether the expected spectrum is a polynomial of second degree in the size.
    patterns : tuple of ModalPattern
        What it shows where there is no geometry. Of all effects with a pattern, those that declare
        it first are named before the others.
    gaussian : bool
        Whether a record with it is Gaussian, as the likelihood of spectra assumes.
    whole_record : bool
        Whether it acts over the whole record, and cannot be detected in a window of it.
    in_mean_spectrum : bool
        Whether the mean spectrum of a record shows it at all, whatever it shows of its quantities.
    like_noise : bool
        Whether it is noise of all channels, most of which a level of the sensors' noise takes up.
    below_band : bool
        Whether its detector works below the band that a fit uses, so that no fit accounts for it.
    may_vary : str
        What it scales that may vary with time, for messages; empty for nothing.
    needs : tuple of str, optional
        What a model must offer: 'geometry' (arrays, places on them, a hub), 'arrays' (two of
        them), 'modes', 'points' that springs can join. None: geometry, if it names an array or
        changes a spacecraft.
    nodes : bool
        Whether it acts in all directions of a node alike.

    """

    name = ''
    law_of = ''
    site = None
    size = ''
    reference = ''
    starts = {}
    follows = {}
    together = ()
    spectral = True
    nonlinear = False
    hinge = False
    power = 1.0
    second_degree = False
    patterns = ()
    gaussian = True
    whole_record = False
    in_mean_spectrum = True
    like_noise = False
    below_band = False
    may_vary = ''
    needs = None
    nodes = False

    def __post_init__(self):
        check(self)

    @property
    def is_null(self):
        """Whether the effect is at the value that changes nothing."""
        return all(getattr(self, f.name) == f.default for f in fields(self)
                   if f.name in (self.size, *self.together))

    @property
    def answer(self):
        """Return the name that an answer has for it."""
        return self.law_of or self.name

    @property
    def limit(self):
        """Largest value that a channel can have [m/s^2]."""
        return math.inf

    @property
    def first_order(self):
        """Share of its size at which it changes a spectrum in proportion; 1 if none is small."""
        null = self.size_quantity().default
        starts = {round(abs(v - null), 12) for v in self.starts.get(self.size, ())} - {0.0}
        linear = self.power == 1.0 and not self.nonlinear
        alike = self.second_degree or len(starts) == 1
        return SMALL if linear and alike and math.isfinite(null) else 1.0

    def kind(self):
        """Return its name and the channels and arrays it is at, whatever its numbers."""
        return self.name, *(getattr(self, f.name) for f in self.words())

    def opposite(self):
        """Return it with the other sign in a tuple, if that may be as likely; else nothing."""
        # of channels that show nearly the same, what differs goes by the square of such a size
        mixes = {ModalPattern.CHANNEL_FILTER, ModalPattern.CHANNEL_SHAPE} & set(self.patterns[:1])
        sizes = [f for f in self.numbers() if f.name in (self.size, *self.together)]
        if not mixes or self.one_sided() or not all(math.isfinite(f.default) for f in sizes):
            return ()
        values = {f.name: 2 * f.default - getattr(self, f.name) for f in sizes}
        return (replace(self, **values),) if in_range(self, values) else ()

    def in_samples(self, values):
        """Return values (n, l) with the effect in them, None unless it acts on samples alone."""
        return None

    def in_record(self, begin_s, span_s, duration_s):
        """Return the effect of a part of a record, begun at an instant, as that of the whole."""
        return self

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the effect in its numbers."""
        return spacecraft

    def apply(self, setup):
        """Return the setup with the effect in it, after all spacecraft hooks have run."""
        return setup

    def deviations(self, spacecraft):
        """Return its size in declared deviations of the error of the model that is the same."""
        return math.inf

    def scale_of(self, f):
        """Return how large a number begins, less that of none; 0 where nothing says so."""
        # what grows with the size and begins at none has its scale
        begins = any(v != f.default for v in self.starts[f.name])
        name = self.size if f.name in self.together and not begins else f.name
        null = next(q.default for q in self.numbers() if q.name == name)
        return max(abs(v - null) for v in self.starts[name])

    @classmethod
    def starts_on(cls, spacecraft, place):
        """Return `starts` for a model at a place, as large as quantities are on it."""
        if not hasattr(spacecraft, 'usual'):
            scales = scales_of(spacecraft, place)
            return {k: tuple(scales[cls.follows[k]] * v for v in values) if k in cls.follows
                    else values for k, values in cls.starts.items()}
        units = {f.name: f.metadata['unit'] for f in cls.numbers()}
        return {k: tuple(spacecraft.usual(units[k], place) * v for v in values)
                for k, values in cls.starts.items()}

    @classmethod
    def of_line(cls, spacecraft, frequency_hz):
        """Return the effects of this kind that make a line at a frequency by what they are."""
        return ()

    def driven_hz(self):
        """Return first and last frequency of what it adds to an input; None of others."""
        return None

    @classmethod
    def one_sided(cls):
        """Return whether the size has one sign only, as a mass has."""
        size = cls.size_quantity()
        return size.default in (size.metadata['low'], size.metadata['high'])

    @classmethod
    def size_quantity(cls):
        """Return the field of the size."""
        return next(f for f in cls.numbers() if f.name == cls.size)

    @classmethod
    def numbers(cls):
        """Return the fields of the quantities that are numbers, which a fit can move."""
        return tuple(f for f in quantities(cls) if not isinstance(f.default, str))

    @classmethod
    def needed(cls):
        """Return what a model must offer, see `needs`."""
        if cls.needs is not None:
            return cls.needs
        placed = {f.name for f in quantities(cls)} & {'array', 'along_m'}
        return ('geometry',) if placed or cls.spacecraft is not Effect.spacecraft else ()

    @classmethod
    def words(cls):
        """Return the fields of the quantities that name a channel or an array."""
        return tuple(f for f in quantities(cls) if isinstance(f.default, str) and f.name != INPUT)

    @classmethod
    def within(cls, **values):
        """Return an effect with its quantities kept inside their declared ranges."""
        ranges = {f.name: f.metadata for f in cls.numbers()}
        return cls(**{k: float(min(max(v, ranges[k]['low']), ranges[k]['high'])) if k in ranges
                      else v for k, v in values.items()})

    def values(self):
        """Return the quantities by name, numbers and words; an input at its default is none."""
        return {f.name: getattr(self, f.name) for f in quantities(self)
                if f.name != INPUT or getattr(self, f.name) != f.default}

    def text(self):
        """Return the effect as the command line writes it, `name:param=value,...`."""
        pairs = ','.join(f'{name}={_plain(value)}' for name, value in self.values().items())
        return f'{self.name}:{pairs}'


def in_deviations(size, std, count=1):
    """Return a size common to `count` errors of a declared deviation each, in deviations."""
    return abs(size) * math.sqrt(count) / std if std else math.inf


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
