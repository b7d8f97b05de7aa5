"""Effects on measured samples, as `docs/effects.md` defines them: no model of the structure."""
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import bilinear, lfilter

FINER = 4               # times the rate, to which samples are brought before they are moved
PULSE_MODES = 3         # damped waves of which the answer to a pulse is made
PULSE_DAMPING = 0.01


@dataclass(frozen=True)
class Record:
    """Samples to change, shape (n, l), their rate [Hz] and the frequencies where they live."""

    values: np.ndarray
    rate_hz: float
    live_hz: tuple

    @property
    def rms(self):
        """Rms of each channel."""
        return self.values.std(axis=0)

    @property
    def times_s(self):
        """Time of each row [s]."""
        return np.arange(len(self.values)) / self.rate_hz


def _with_column(values, channel, column):
    values = values.copy()
    values[:, channel] = column
    return values


def sensor_gain(record, scale, rng):
    """Scale the last channel."""
    return _with_column(record.values, -1, scale * record.values[:, -1]), {'scale': scale}


def sensor_crosstalk(record, gain, rng):
    """Add a share of the first channel to the last."""
    own = record.values[:, -1] + gain * record.values[:, 0]
    return _with_column(record.values, -1, own), {'gain': gain}


def sensor_noise(record, share, rng):
    """Add white noise of a share of its rms to the last channel."""
    noise = share * record.rms[-1] * rng.standard_normal(len(record.values))
    return _with_column(record.values, -1, record.values[:, -1] + noise), {}


def sensor_drift(record, share, rng):
    """Add first-order noise of a share of its rms to the last channel, of two slow periods."""
    tau = 0.3 / record.live_hz[0]
    pole = np.exp(-1 / (tau * record.rate_hz))
    steps = np.sqrt(1 - pole ** 2) * rng.standard_normal(len(record.values))
    drift = share * record.rms[-1] * lfilter([1.0], [1.0, -pole], steps)
    return _with_column(record.values, -1, record.values[:, -1] + drift), {
        'rms_m_s2': share * record.rms[-1]}


def quantisation(record, share, rng):
    """Round to steps of a share of the mean rms."""
    step = share * record.rms.mean()
    return step * np.rint(record.values / step), {'step_m_s2': step}


def saturation(record, share, rng):
    """Clip at so many times the mean rms."""
    limit = share * record.rms.mean()
    return np.clip(record.values, -limit, limit), {'limit_m_s2': limit}


def _low_pass(values, corner_hz, rate_hz):
    w = 2 * np.pi * corner_hz
    warped = 2 * rate_hz * np.tan(w / (2 * rate_hz))
    b, a = bilinear([warped ** 2], [1.0, np.sqrt(2) * warped, warped ** 2], rate_hz)
    return lfilter(b, a, values, axis=0)


def bandwidth_of_one(record, share, rng):
    """Pass the last channel through a low-pass at so many times the highest live frequency."""
    corner = share * record.live_hz[1]
    own = _low_pass(record.values[:, -1], corner, record.rate_hz)
    return _with_column(record.values, -1, own), {'corner_hz': corner}


def bandwidth_of_all(record, share, rng):
    """Pass all channels through a low-pass at so many times the highest live frequency."""
    corner = share * record.live_hz[1]
    return _low_pass(record.values, corner, record.rate_hz), {'corner_hz': corner}


def at_instants(record, rows):
    """Return the values at other instants, given in rows."""
    count = len(record.values)
    spectrum = np.fft.rfft(record.values, axis=0)
    fine = np.fft.irfft(spectrum, FINER * count, axis=0) * FINER
    return CubicSpline(np.arange(FINER * count), fine)(np.clip(rows, 0, count - 1) * FINER)


def channel_delay(record, share, rng):
    """Delay the last channel by a share of the shortest live period."""
    delay = share / record.live_hz[1]
    moved = at_instants(record, np.arange(len(record.values)) - delay * record.rate_hz)
    return _with_column(record.values, -1, moved[:, -1]), {'delay_s': delay}


def clock_rate(record, ppm, rng):
    """Sample at another rate."""
    rows = int(len(record.values) / (1 + max(ppm, 0.0) * 1e-6)) - 2
    return at_instants(record, np.arange(rows) * (1 + ppm * 1e-6)), {'ppm': ppm}


def timestamp_jitter(record, share, rng):
    """Move every instant by an error of a share of the shortest live period."""
    rms = share / record.live_hz[1]
    errors = rms * record.rate_hz * rng.standard_normal(len(record.values))
    return at_instants(record, np.arange(len(record.values)) + errors), {'rms_s': rms}


def dropped_samples(record, share, rng):
    """Lose rows at random."""
    values = record.values.copy()
    values[rng.random(len(values)) < share] = np.nan
    return values, {'fraction': share}


def _shape(record, rng):
    return rng.uniform(0.4, 1.0, record.values.shape[1]) * record.rms


def harmonic_disturbance(record, share, rng):
    """Add a sine on all channels, of a shape of its own, of a share of their rms."""
    low, high = record.live_hz
    frequency = low + 0.377 * (high - low)
    wave = np.sqrt(2) * share * np.sin(2 * np.pi * frequency * record.times_s + 1.0)
    return record.values + wave[:, None] * _shape(record, rng), {'frequency_hz': frequency}


def wheel_speed_sweep(record, share, rng):
    """Add a sine whose frequency rises over the record."""
    low, high = record.live_hz
    start, end = low + 0.2 * (high - low), low + 0.7 * (high - low)
    t = record.times_s
    phase = 2 * np.pi * (start * t + (end - start) * t ** 2 / (2 * t[-1]))
    wave = np.sqrt(2) * share * np.sin(phase)
    return record.values + wave[:, None] * _shape(record, rng), {
        'start_hz': start, 'end_hz': end}


def impulsive_events(record, size, rng):
    """Add knocks to which damped waves answer; the first peak is `size` times the rms."""
    rows, width = record.values.shape
    low, high = record.live_hz
    count = max(5, rng.poisson(rows / record.rate_hz * high / 40))
    knocks = np.zeros(rows)
    knocks[rng.integers(0, rows, count)] = 1.0
    t = np.arange(int(8 / (PULSE_DAMPING * low * 2 * np.pi) * record.rate_hz)) / record.rate_hz
    total = np.zeros((rows, width))
    for f in np.geomspace(low * 1.3, high * 0.9, PULSE_MODES):
        w = 2 * np.pi * f
        wave = np.exp(-PULSE_DAMPING * w * t[:rows]) * np.cos(w * t[:rows])
        answer = np.fft.irfft(np.fft.rfft(knocks, 2 * rows) * np.fft.rfft(wave, 2 * rows))
        total += answer[:rows, None] * rng.uniform(-1.0, 1.0, width)
    return record.values + size * record.rms * total, {
        'rate_per_min': 60 * count * record.rate_hz / rows}


def nonstationary_excitation(record, depth, rng):
    """Let the level swing three times."""
    period = record.times_s[-1] / 3
    level = 1 + depth * np.sin(2 * np.pi * record.times_s / period)
    return record.values * level[:, None], {'depth': depth, 'period_s': period}


# name: (effect of the library, sizes, function, needs a second channel)
CASES = {
    'gain': ('sensor_gain', (1.02, 1.1), sensor_gain, True),
    'crosstalk': ('sensor_crosstalk', (0.02, 0.1), sensor_crosstalk, True),
    'noise': ('sensor_noise', (0.02, 0.2), sensor_noise, False),
    'drift': ('sensor_drift', (0.1, 0.5), sensor_drift, False),
    'steps': ('quantisation', (0.03, 0.3), quantisation, False),
    'rails': ('saturation', (2.5, 1.5), saturation, False),
    'low-pass of one': ('sensor_bandwidth', (3.0, 1.0), bandwidth_of_one, True),
    'low-pass of all': ('sensor_bandwidth', (3.0, 1.0), bandwidth_of_all, False),
    'delay': ('channel_delay', (0.01, 0.1), channel_delay, True),
    'clock': ('clock_rate', (2000.0, 10000.0), clock_rate, False),
    'jitter': ('timestamp_jitter', (0.01, 0.1), timestamp_jitter, False),
    'losses': ('dropped_samples', (0.005, 0.1), dropped_samples, False),
    'line': ('harmonic_disturbance', (0.03, 0.3), harmonic_disturbance, False),
    'sweep': ('wheel_speed_sweep', (0.1, 0.5), wheel_speed_sweep, False),
    'knocks': ('impulsive_events', (0.5, 3.0), impulsive_events, False),
    'swing': ('nonstationary_excitation', (0.1, 0.4), nonstationary_excitation, False),
}
