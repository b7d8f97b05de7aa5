# Licensed under the Apache License, Version 2.0.
"""
The sensor chain: from true acceleration to what the recorder writes.

Order: analogue low-pass, the ADC's own instants and delays, gain and cross-talk, noise, drift,
corruption, clipping limits, rounding. The acceleration at the record's rate is taken as a
band-limited signal: analogue filters act by their own frequency response, and other instants are
read from the signal at eight times the rate by a windowed sinc, so that a small filter, delay or
clock error is a small change. Reading at that rate itself would lose what lies near half of it
wherever an instant falls between samples: a clock off by 20 ppm lost 44 % of the power above
49.5 Hz.
"""
from dataclasses import dataclass

from blindgen.physics.functions import static
import numba
import numpy as np
from scipy.signal import buttap, lfilter

FINER = 8
FADE_S = 1.5               # at both ends, so that the periodic transform has no edge there
HALF_TAPS = 16
KAISER_BETA = 12.0


def instants(scenario, samples, rng):
    """
    Return when each channel's ADC samples, (samples, c), in nominal samples from the first one.

    A clock that is off by ppm stretches the period, and with it a channel's own instant in the
    scan, which its stamps say by the same clock; jitter moves whole scans; a delay reads the past
    of one channel.
    """
    craft = scenario.craft
    k = np.arange(samples)[:, None] + np.array([s.offset for s in craft.sensors])
    moved = scenario.jitter_s * craft.rate_hz * rng.standard_normal(samples)
    when = k * (1 + scenario.ppm * 1e-6) + moved[:, None]
    for channel, delay in scenario.delays:
        when[:, channel] -= delay * craft.rate_hz
    return when


def channel_responses(scenario, f):
    """Return the frequency response (len(f), c) of each channel's analogue part."""
    h = np.ones((len(f), len(scenario.craft.sensors)), dtype=complex)
    for channel, corner in scenario.low_pass:
        poles = buttap(2)[1]
        s = 1j * f / corner
        columns = slice(None) if channel == 'all' else channel
        h[:, columns] *= (1 / ((s - poles[0]) * (s - poles[1]))).reshape(
            (-1, 1) if channel == 'all' else -1)
    for channel, response in scenario.filtered:
        h[:, channel] *= response.at(f)
    return h


def _analogue(scenario, y):
    """Return y (samples, c) through the analogue part of each channel."""
    h = channel_responses(scenario, np.fft.rfftfreq(len(y), 1 / scenario.craft.rate_hz))
    columns = np.flatnonzero(np.any(h != 1, axis=0))
    if len(columns):
        y = y.copy()
        y[:, columns] = np.fft.irfft(np.fft.rfft(y[:, columns], axis=0) * h[:, columns], len(y),
                                     axis=0)
    return y


def _finer(y, rate_hz):
    """Return the band-limited signal y (n, c) at FINER times the rate, faded at both ends."""
    n, fade = len(y), min(int(FADE_S * rate_hz) + 2 * HALF_TAPS, len(y) // 2)
    ramp = np.sin(np.pi / 2 * (np.arange(fade) + 0.5) / fade)[:, None]**2
    y = y.copy()
    y[:fade] *= ramp
    y[-fade:] *= ramp[::-1]
    spectrum = np.fft.rfft(y, axis=0)
    if n % 2 == 0:
        spectrum[-1] /= 2                # at 50 Hz half belongs to either sign of the frequency
    return np.fft.irfft(spectrum * FINER, n * FINER, axis=0)


@numba.njit(cache=True)
def _interpolate(y, when, half, beta):
    """Return y (samples, c) at fractional samples by a Kaiser-windowed sinc."""
    out = np.zeros_like(when)
    table = np.zeros(20001)
    for i in range(20001):                        # I0 by its series, once
        x = beta * np.sqrt(max(0.0, 1 - (i / 20000.0)**2)) / 2
        term, total = 1.0, 1.0
        for k in range(1, 40):
            term *= (x / k)**2
            total += term
        table[i] = total
    for c in range(when.shape[1]):
        for k in range(when.shape[0]):
            base = int(np.floor(when[k, c]))
            part = when[k, c] - base
            if part < 1e-12:
                out[k, c] = y[base, c]
                continue
            sine = np.sin(np.pi * part) / np.pi
            value = 0.0
            for j in range(-half + 1, half + 1):
                distance = part - j
                at = abs(distance) / half * 20000.0
                low = int(at)
                if low >= 20000:
                    continue
                window = table[low] + (at - low) * (table[low + 1] - table[low])
                sign = 1.0 if j % 2 == 0 else -1.0
                value += y[base + j, c] * sign * sine / distance * window / table[0]
            out[k, c] = value
    return out


def measured(scenario, y, lead, samples, rng):
    """
    Return the record.

    Parameters
    ----------
    scenario : Scenario
        What the sensors and the clock are.
    y : (more, c) array
        True acceleration at the record's rate [m/s^2], with `lead` samples before the record and
        enough after it for the interpolation.
    lead : int
        Samples before the record.
    samples : int
        Length of the record.
    rng : numpy.random.Generator
        Of the sensors.

    Returns
    -------
    values : (kept, c) array
        [m/s^2]
    index : (kept,) int array
        Number of each scan kept; the stamps are index / rate, and the channel's offset.

    """
    craft = scenario.craft
    when = instants(scenario, samples, rng)
    y = _analogue(scenario, y)
    y = _interpolate(_finer(y, craft.rate_hz), (when + lead) * FINER, HALF_TAPS, KAISER_BETA)
    noise = rng.standard_normal(y.shape)         # before all that only some scenarios draw
    kept = rng.random(samples)
    y = y @ mixing(scenario).T
    for channel, size, coefficients, scale in scenario.curved:
        y[:, channel] += size * static(coefficients, y[:, channel] / scale)
    for channel, depth, curve in scenario.modulated_gains:
        y[:, channel] *= 1 + depth * curve.at(np.arange(samples) / samples)
    y += noise_rms(scenario) * noise
    for channel, size, constant in scenario.drifts:
        y[:, channel] += _first_order(size, constant * craft.rate_hz, samples, rng)
    for spoiling in scenario.spoilt:
        spoiling.act(y, rng)
    y = np.clip(y, -scenario.limit, scenario.limit)
    if scenario.step:
        y = np.round(y / scenario.step) * scenario.step
    index = np.flatnonzero((kept >= scenario.dropped) & ~missing(scenario, samples))
    return y[index], index


def mixing(scenario):
    """Return what the channels make of each other, (c, c)."""
    matrix = np.eye(len(scenario.craft.sensors))
    for channel, factor in scenario.gains:
        matrix[channel, channel] *= factor
    for source, channel, gain in scenario.crosstalk:
        matrix[channel, source] += gain
    return matrix


def noise_rms(scenario):
    """Return the rms of the white noise of each channel (c,) [m/s^2]."""
    rms = np.full(len(scenario.craft.sensors), scenario.craft.noise_rms * scenario.noise_level)
    for channel, factor in scenario.noise_scales:
        rms[channel] *= factor
    return rms


def missing(scenario, samples):
    """Return which scans (samples,) lie in a gap of the record."""
    share, lost = np.arange(samples) / samples, np.zeros(samples, dtype=bool)
    for first, last in scenario.gaps:
        lost |= (share >= first) & (share < last)
    return lost


def _first_order(rms, constant, samples, rng):
    """Return first-order low-frequency noise (samples,), its time constant in samples."""
    a = np.exp(-1 / constant)
    white = rng.standard_normal(samples) * rms * np.sqrt(1 - a * a)
    white[0] = rms * rng.standard_normal()
    return lfilter([1.0], [1.0, -a], white)


@dataclass(frozen=True)
class Spoiling:
    """Samples that something on the way to the recorder corrupts: runs, in some channels."""

    channels: tuple
    runs: float                    # per record, in the mean; there is one at least
    length: float                  # mean samples of a run, geometric
    hold: float                    # share of the last good sample,
    own: float                     # of the sample itself,
    other: float                   # of another channel's
    source: int

    def act(self, y, rng):
        """Corrupt y (samples, c) in place."""
        # a case without one would be labelled by an effect that is not in it
        for _ in range(max(1, rng.poisson(self.runs))):
            begin = int(rng.integers(1, len(y)))
            run = slice(begin, begin + int(rng.geometric(1 / self.length)))
            other = y[run, self.source].copy()
            for c in self.channels:
                y[run, c] = (self.hold * y[begin - 1, c] + self.own * y[run, c]
                             + self.other * other)
