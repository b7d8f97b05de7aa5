"""
Excitation at set times and frequencies: sine, chirp, pulses, thermal snaps, M-sequence.

Parts as in `excitation.py`; eq. (28) of docs/theory.md. Every one acts on one input, and its
value is held over a sample like all inputs, except where the torque of a machine says
`held=False`.
"""
from dataclasses import dataclass
import math

import numpy as np

from ssi_ros.model.excitation import columns


class _OneInput:
    """A part that is a function of time on one input, with nothing random in it."""

    def begin(self, rate_hz, inputs, generator):
        """Return the forces as a function of first sample and count."""
        (where,) = columns((self.input,), inputs)

        def forces(first, count):
            values = np.zeros((count, len(inputs)))
            values[:, where] = self.at(first + np.arange(count), rate_hz)
            return values
        return forces

    def covariance(self, rate_hz, inputs):
        """Return zeros (m, m): nothing here is random and stationary."""
        return np.zeros((len(inputs), len(inputs)))


@dataclass(frozen=True)
class Sine(_OneInput):
    """amplitude sin(2 pi frequency_hz t + phase_rad), for ever: a record begins in its midst."""

    input: str                  # noqa: A003
    amplitude: float
    frequency_hz: float
    phase_rad: float = 0.0
    name: str = 'sine'
    held: bool = True

    @property
    def band_hz(self):
        """Lowest and highest frequency."""
        return self.frequency_hz, self.frequency_hz

    def wave(self, steps, rate_hz):
        """Return a exp(j phase) and d phase / dt [rad/s] at sample numbers, (n,) each."""
        omega = 2 * math.pi * self.frequency_hz
        phase = omega * steps / rate_hz + self.phase_rad
        return self.amplitude * np.exp(1j * phase), np.full(len(steps), omega)

    def at(self, steps, rate_hz):
        """Return the values at sample numbers."""
        return self.amplitude * np.sin(
            2 * math.pi * self.frequency_hz * steps / rate_hz + self.phase_rad)

    def phasor(self, inputs):
        """Return complex amplitudes (m,) and angular frequency: u = Im(a exp(j omega t))."""
        amplitudes = np.zeros(len(inputs), complex)
        amplitudes[columns((self.input,), inputs)] = self.amplitude * np.exp(1j * self.phase_rad)
        return amplitudes, 2 * math.pi * self.frequency_hz


@dataclass(frozen=True)
class Chirp(_OneInput):
    """A sine of linearly changing frequency, from start_hz to end_hz over duration_s."""

    input: str                  # noqa: A003
    amplitude: float
    start_hz: float
    end_hz: float
    duration_s: float
    name: str = 'chirp'
    held: bool = True

    @property
    def band_hz(self):
        """Lowest and highest frequency."""
        return tuple(sorted((self.start_hz, self.end_hz)))

    def wave(self, steps, rate_hz):
        """Return a exp(j phase) and d phase / dt [rad/s] at sample numbers, (n,) each."""
        t = steps / rate_hz
        slope = (self.end_hz - self.start_hz) / self.duration_s
        phase = 2 * math.pi * (self.start_hz * t + slope * t ** 2 / 2)
        # over the sample that begins at t, at its middle
        omega = 2 * math.pi * (self.start_hz + slope * (t + 0.5 / rate_hz))
        return self.amplitude * np.exp(1j * phase) * (t < self.duration_s), omega

    def at(self, steps, rate_hz):
        """Return the values at sample numbers."""
        return self.wave(steps, rate_hz)[0].imag


@dataclass(frozen=True)
class Firings(_OneInput):
    """A thruster that fires at set times: `amplitude` for width_s, in whole samples."""

    input: str                  # noqa: A003
    amplitude: float
    times_s: tuple
    width_s: float
    name: str = 'firings'

    def at(self, steps, rate_hz):
        """Return the values at sample numbers."""
        values = np.zeros(len(steps))
        width = max(1, round(self.width_s * rate_hz))
        for time_s in self.times_s:
            begin = round(time_s * rate_hz)
            values[(steps >= begin) & (steps < begin + width)] += self.amplitude
        return values


@dataclass(frozen=True)
class ThermalSnap(_OneInput):
    """
    The jolt of an array that crosses the terminator, amplitude exp(-t / decay_s) from time_s.

    The form is ours; Thornton and Kim, J. Spacecraft and Rockets 30(4), 1993, derive such a
    quasi-static moment with the thermal time constant of the boom.
    """

    input: str                  # noqa: A003
    amplitude: float
    time_s: float
    decay_s: float
    name: str = 'thermal_snap'

    def at(self, steps, rate_hz):
        """Return the values at sample numbers."""
        since = steps / rate_hz - self.time_s
        return np.where(since >= 0, self.amplitude * np.exp(-np.maximum(since, 0) / self.decay_s),
                        0.0)


@dataclass(frozen=True)
class MSequence(_OneInput):
    """
    Maximum-length binary sequence of +-amplitude, each value held chip_s, repeated for ever.

    Its period is 2^order - 1 chips; source of the sequence: `scipy.signal.max_len_seq`.
    """

    input: str                  # noqa: A003
    amplitude: float
    order: int = 10
    chip_s: float = 0.01
    name: str = 'm_sequence'

    def at(self, steps, rate_hz):
        """Return the values at sample numbers."""
        from scipy.signal import max_len_seq
        sequence = 2.0 * max_len_seq(self.order)[0] - 1.0
        chips = steps // max(1, round(self.chip_s * rate_hz))
        return self.amplitude * sequence[chips % len(sequence)]


@dataclass(frozen=True)
class Nutation(_OneInput):
    """What an impulse on an input has left of a motion that turns and hardly decays, (23c)."""

    input: str                  # noqa: A003
    impulse: float
    name: str = 'nutation'

    def at(self, steps, rate_hz):
        """Return zeros: nothing acts any more."""
        return np.zeros(len(steps))

    def state(self, sampled, inputs):
        """Return the modal state at t = 0 of a Sampled, (p,): zero but for what does not decay."""
        (where,) = columns((self.input,), inputs)
        kick = sampled.b[:, where] * self.impulse * sampled.rate_hz
        return np.where(sampled.nutates, kick, 0.0)


@dataclass(frozen=True)
class Pulses:
    """Torque pulses at random, Poisson times: `impulse` spread over the one sample it falls in."""

    input: str                  # noqa: A003
    impulse: float
    rate_per_min: float
    name: str = 'pulses'

    def begin(self, rate_hz, inputs, generator):
        """Return the forces as a function of first sample and count."""
        (where,) = columns((self.input,), inputs)

        def forces(first, count):
            values = np.zeros((count, len(inputs)))
            events = generator.poisson(self.rate_per_min / 60 / rate_hz, count)
            values[:, where] = events * self.impulse * rate_hz
            return values
        return forces

    def covariance(self, rate_hz, inputs):
        """Return the covariance of one sample of the inputs, (m, m): that of a Poisson count."""
        values = np.zeros((len(inputs), len(inputs)))
        (where,) = columns((self.input,), inputs)
        values[where, where] = self.rate_per_min / 60 / rate_hz * (self.impulse * rate_hz) ** 2
        return values
