"""
What acts on the system: parts that add up, each a frozen record with one verb, `begin`.

`begin(rate_hz, inputs, generator)` returns `forces(first, count)`, the values that the inputs hold
over the samples first, first + 1, ...; it is called with consecutive blocks. The result must not
depend on how time is cut into blocks. `covariance(rate_hz, inputs)` is the covariance of one
sample of the random, stationary share (zero for what is determined), which the stationary start
and the expected spectrum need. Equations (27) to (29) of docs/theory.md.
"""
from dataclasses import dataclass, replace
import zlib

import numpy as np

LEVEL_RATE_HZ = 100.0       # the rate at which the rms of white excitation is declared
DECADES = 3.0               # below half of the rate, over which a force may have any smooth colour


def generator(seed, name):
    """
    Return the random generator of one named source for one seed.

    Each source has its own, found by its name: adding a source, or taking one away, does not
    change what the others draw.
    """
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise ValueError(f'seed={seed!r} must be a whole number, zero or more')
    key = zlib.crc32(name.encode())
    return np.random.default_rng(np.random.SeedSequence(int(seed), spawn_key=(key,)))


def columns(names, inputs):
    """Return the index of every named input, ValueError if one is not there."""
    for name in names:
        if name not in inputs:
            raise ValueError(f'input {name!r} is not on this system; it has ' + ', '.join(inputs))
    return [inputs.index(name) for name in names]


@dataclass(frozen=True)
class White:
    """
    Independent white Gaussian inputs, held over a sample, eq. (27).

    `rms` is declared at 100 Hz; at another rate it follows the square root of the rate, so that
    the spectral density stays.
    """

    name: str
    inputs: tuple
    rms: tuple
    free = True     # whether a level of its own scales it, of which a model knows the usual one

    def __post_init__(self):
        if len(self.rms) != len(self.inputs) or not all(r >= 0 for r in self.rms):
            raise ValueError(f'{self.name}: rms={self.rms} must be one number an input, zero or '
                             f'more, for {len(self.inputs)} inputs')

    def held_rms(self, rate_hz):
        """Return the rms of the held values at a rate, shape (inputs,)."""
        return np.array(self.rms) * np.sqrt(rate_hz / LEVEL_RATE_HZ)

    def begin(self, rate_hz, inputs, generator):
        """Return the forces as a function of first sample and count."""
        where, rms = columns(self.inputs, inputs), self.held_rms(rate_hz)

        def forces(first, count):
            values = np.zeros((count, len(inputs)))
            values[:, where] = generator.standard_normal((count, len(rms))) * rms
            return values
        return forces

    def covariance(self, rate_hz, inputs):
        """Return the covariance of one sample of the inputs, shape (m, m)."""
        variances = np.zeros(len(inputs))
        variances[columns(self.inputs, inputs)] = self.held_rms(rate_hz) ** 2
        return np.diag(variances)


class FixedWhite(White):
    """White inputs of a known rms, which no free level scales."""

    free = False


def layers(part):
    """Yield what a part goes through, each Varying or Filtered, the outermost first."""
    while isinstance(part, (Varying, Filtered)):
        yield part
        part = part.part


def source(part):
    """Return what a part is before its level varies or its colour is taken."""
    for layer in layers(part):
        part = layer.part
    return part


def steadied(part):
    """Return a part whose level does not vary, its colours kept."""
    if isinstance(part, Varying):
        return steadied(part.part)
    return replace(part, part=steadied(part.part)) if isinstance(part, Filtered) else part


def colour_of(part, frequencies_hz):
    """Return the power gain at frequencies of all the colours that a part has."""
    return np.prod([layer.power(frequencies_hz) for layer in layers(part)
                    if isinstance(layer, Filtered)], axis=0)


def has_colour(part):
    """Return whether a part has a colour."""
    return any(isinstance(layer, Filtered) for layer in layers(part))


@dataclass(frozen=True)
class Varying:
    """A part times the level 1 + depth sin(2 pi t / period_s + phase_rad), eq. (29)."""

    part: object
    depth: float
    period_s: float
    phase_rad: float = 0.0

    def __post_init__(self):
        if not (0.0 <= self.depth <= 1.0 and self.period_s > 0.0):
            raise ValueError(f'depth={self.depth:g} must be 0 to 1 and period_s='
                             f'{self.period_s:g} positive')

    @property
    def name(self):
        """Name of the part: its random numbers stay the same."""
        return self.part.name

    def begin(self, rate_hz, inputs, generator):
        """Return the forces as a function of first sample and count."""
        steady = self.part.begin(rate_hz, inputs, generator)

        def forces(first, count):
            t = (first + np.arange(count)) / rate_hz
            return steady(first, count) * self.level(t)[:, None]
        return forces

    def level(self, t):
        """Return the level at times [s]."""
        return 1.0 + self.depth * np.sin(2 * np.pi * t / self.period_s + self.phase_rad)

    def covariance(self, rate_hz, inputs):
        """Return the mean over time of the covariance of one sample, shape (m, m)."""
        return self.part.covariance(rate_hz, inputs) * (1.0 + self.depth ** 2 / 2)


class Filtered:
    """
    A part of the excitation through a filter of least phase: its samples are filtered, then held.

    A continuous filter would delay what acts at once by a whole sample. A subclass is a frozen
    record with `part`, what is filtered.
    """

    @property
    def name(self):
        """Name of the part: its random numbers stay the same."""
        return self.part.name

    def power(self, frequencies_hz):
        """Return the power gain at frequencies."""
        raise NotImplementedError

    def scaled(self, factor):
        """Return the same with another corner, that of the innermost low-pass."""
        return replace(self, part=self.part.scaled(factor)) if isinstance(
            self.part, Filtered) else self

    def taps(self, rate_hz):
        """Return the causal filter of least phase that has this power, shape (n,)."""
        count = 1 << int(np.ceil(np.log2(self.settles(rate_hz))))
        cepstrum = np.fft.irfft(np.log(self.power(np.fft.rfftfreq(count, 1 / rate_hz))) / 2)
        cepstrum[1:count // 2] *= 2
        cepstrum[count // 2 + 1:] = 0.0
        taps = np.fft.irfft(np.exp(np.fft.rfft(cepstrum)), count)[:count // 2]
        # what follows has less than 1e-10 of the power
        rest = np.cumsum(taps[::-1] ** 2)[::-1]
        return taps[:max(1, int(np.argmax(rest < 1e-10 * rest[0])))]

    def settles(self, rate_hz):
        """Return the rows in which the response to a sample ends, or more."""
        return 4096.0

    def begin(self, rate_hz, inputs, generator):
        """Return the forces as a function of first sample and count."""
        from scipy.signal import oaconvolve
        white, taps = self.part.begin(rate_hz, inputs, generator), self.taps(rate_hz)
        history = [white(0, len(taps) - 1)]

        def forces(first, count):
            values = np.concatenate([history[0], white(first, count)])
            history[0] = values[count:]
            return oaconvolve(values, taps[:, None], mode='valid', axes=0)
        return forces

    def covariance(self, rate_hz, inputs):
        """Return the covariance of the white part, shape (m, m)."""
        return self.part.covariance(rate_hz, inputs)


@dataclass(frozen=True)
class Coloured(Filtered):
    """
    A white part through a first-order low-pass, eq. (29a).

    The sampled sequence has the power |1 / (1 + j f / corner_hz)|^2 up to half of the rate, so a
    corner far above it changes nothing.
    """

    part: object
    corner_hz: float

    def __post_init__(self):
        if not (np.isfinite(self.corner_hz) and self.corner_hz > 0.0):
            raise ValueError(f'corner_hz={self.corner_hz:g} must be a positive number [Hz]')

    def power(self, frequencies_hz):
        """Return the power gain at frequencies."""
        return 1.0 / (1.0 + (np.asarray(frequencies_hz) / self.corner_hz) ** 2)

    def scaled(self, factor):
        """Return the same with another corner, that of the innermost low-pass."""
        return (super().scaled(factor) if isinstance(self.part, Coloured)
                else replace(self, corner_hz=self.corner_hz * factor))

    def settles(self, rate_hz):
        """Return the rows in which the response to a sample ends, or more."""
        return max(super().settles(rate_hz), 40 * rate_hz / self.corner_hz)


@dataclass(frozen=True)
class Shaped(Filtered):
    """
    A white part whose power is a polynomial in the logarithm of frequency, in dB, eq. (82a).

    `orders` (n,) are what the Legendre polynomials of order 1 to n are multiplied by [dB], over
    the three decades up to `top_hz`; below, the power is what it is at their end.
    """

    part: object
    orders: tuple
    top_hz: float

    def settles(self, rate_hz):
        """Return the rows in which the response to a sample ends, or more."""
        return float(1 << 15)

    def power(self, frequencies_hz):
        """Return the power gain at frequencies."""
        decades = np.log10(np.maximum(np.asarray(frequencies_hz) / self.top_hz, 10.0 ** -DECADES))
        at = np.clip(2 * decades / DECADES + 1, -1.0, 1.0)
        return 10 ** (np.polynomial.legendre.legval(at, (0.0, *self.orders)) / 10)


def begin_all(parts, rate_hz, inputs, seed):
    """Return the sum of all parts as one function of first sample and count."""
    begun = [p.begin(rate_hz, inputs, generator(seed, p.name)) for p in parts]

    def forces(first, count):
        total = np.zeros((count, len(inputs)))
        for part in begun:
            total += part(first, count)
        return total
    return forces


def total_covariance(parts, rate_hz, inputs):
    """Return the covariance of one sample of all parts together, shape (m, m)."""
    return sum((p.covariance(rate_hz, inputs) for p in parts),
               np.zeros((len(inputs), len(inputs))))


def coloured(part, corner_hz):
    """Return a part through a first-order low-pass; as it is where the corner is infinite."""
    return part if np.isinf(corner_hz) else Coloured(part, corner_hz)
