# Licensed under the Apache License, Version 2.0.
"""
The sensor chain: from true acceleration to what the recorder writes.

Order: analogue low-pass, the ADC's own instants and delays, gain and cross-talk, noise, drift and
spikes, rails, rounding. The acceleration at 100 Hz is taken as a band-limited signal: analogue
filters act by their own frequency response, and other instants are read from the signal at eight
times the rate by a windowed sinc, so that a small filter, delay or clock error is a small change.
Reading at 100 Hz itself would lose what lies near 50 Hz wherever an instant falls between samples:
a clock off by 20 ppm lost 44 % of the power above 49.5 Hz.
"""
from blindgen.scenario import NOISE_RMS, RATE_HZ
import numba
import numpy as np
from scipy.signal import buttap, lfilter

FINER = 8
FADE_S = 1.5               # at both ends, so that the periodic transform has no edge there
HALF_TAPS = 16
KAISER_BETA = 12.0


def instants(scenario, samples, rng):
    """
    Return when each channel's ADC samples, (samples, 4), in nominal samples from the first one.

    A clock that is off by ppm stretches the period; jitter moves whole scans; a delay reads the
    past of one channel.
    """
    k = np.arange(samples) * (1 + scenario.ppm * 1e-6)
    k = k + scenario.jitter_s * RATE_HZ * rng.standard_normal(samples)
    when = np.repeat(k[:, None], 4, axis=1)
    for channel, delay in scenario.delays:
        when[:, channel] -= delay * RATE_HZ
    return when


def low_passed(scenario, y):
    """Return y (samples, 4) through the second-order Butterworth prototypes of the scenario."""
    for channel, corner in scenario.low_pass:
        poles = buttap(2)[1]
        s = 1j * np.fft.rfftfreq(len(y), 1 / RATE_HZ) / corner
        response = 1 / ((s - poles[0]) * (s - poles[1]))
        columns = slice(None) if channel == 'all' else [channel]
        y = y.copy()
        y[:, columns] = np.fft.irfft(np.fft.rfft(y[:, columns], axis=0) * response[:, None],
                                     len(y), axis=0)
    return y


def _finer(y):
    """Return the band-limited signal y (n, 4) at FINER times the rate, faded at both ends."""
    n, fade = len(y), int(FADE_S * RATE_HZ)
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
    """Return y (samples, 4) at fractional samples by a Kaiser-windowed sinc."""
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
    y : (more, 4) array
        True acceleration at 100 Hz [m/s^2], with `lead` samples before the record and enough
        after it for the interpolation.
    lead : int
        Samples before the record.
    samples : int
        Length of the record.
    rng : numpy.random.Generator
        Of the sensors.

    Returns
    -------
    values : (kept, 4) array
        [m/s^2]
    index : (kept,) int array
        Number of each scan kept; the stamps are index / 100 Hz.

    """
    y = low_passed(scenario, y)
    when = instants(scenario, samples, rng)
    y = _interpolate(_finer(y), (when + lead) * FINER, HALF_TAPS, KAISER_BETA)
    mixing = np.diag(scenario.gains)
    for source, channel, gain in scenario.crosstalk:
        mixing[channel, source] += gain
    for channel, rms, constant in scenario.gain_wander:
        y[:, channel] *= 1 + _first_order(rms, constant, samples, rng)
    y = y @ mixing.T
    rms = NOISE_RMS * scenario.noise_level * np.array(scenario.noise_scales)
    y = y + rms * rng.standard_normal((samples, 4))
    for channel, size, constant in scenario.drifts:
        y[:, channel] += _first_order(size, constant, samples, rng)
    for rate, size in scenario.spikes:
        # an electromagnetic spike reaches all cables at once with its own sign and share
        hit = np.flatnonzero(rng.random(samples) < rate / 60 / RATE_HZ)
        y[hit] += size * rng.standard_normal((len(hit), 4))
    y = np.clip(y, -scenario.limit, scenario.limit)
    if scenario.step:
        y = np.round(y / scenario.step) * scenario.step
    index = np.flatnonzero(rng.random(samples) >= scenario.dropped)
    return y[index], index


def _first_order(rms, constant, samples, rng):
    """Return first-order low-frequency noise (samples,) that is stationary from its start."""
    a = np.exp(-1 / (RATE_HZ * constant))
    white = rng.standard_normal(samples) * rms * np.sqrt(1 - a * a)
    white[0] = rms * rng.standard_normal()
    return lfilter([1.0], [1.0, -a], white)
