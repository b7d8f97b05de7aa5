"""Impulses that are one sample long: of the input, and of single channels, eq. (108)."""
import numpy as np

from ssi_ros.arrays import moments
from ssi_ros.bootstrap.impulse_sizes import impulse_sizes, peaks, rms_of
from ssi_ros.effects.registry import deflection, detects
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.detectors.amplitude_modulation import level_of, strongest_modulation
from ssi_ros.gap.detectors.thresholds import LIMITS
from ssi_ros.tails import norm

TRIALS = 4              # independent heights and rates of the grid


@detects('impulsive_events', of='input')
def detect_impulses(effect, reconstruction):
    """
    Detect impulses of the input.

    The matched filter of an impulse has unit variance and a known response. Its peaks, the
    responses to larger ones taken out, are Rice's for Gaussian noise; impulses add a Poisson
    number of one height. A modulation of the level is taken out first: its crests are no impulses.
    """
    one = reconstruction
    unit = np.where(one.missing, 0.0, one.series(one.gain))[one.inside]
    modulation = strongest_modulation(one)
    if modulation is not None:
        unit = unit / level_of(unit, modulation.parameters['period_s'] * one.rate_hz)
    p_value, *peaks_alone, spectrum, (rows, probabilities) = _likelihood(one, unit, one.gain)
    if p_value > LIMITS.p_value.value:
        return None
    (count, count_std), (height, height_std) = (
        impulse_sizes(one, unit, spectrum) or reversed(peaks_alone))
    through = np.sqrt(2 * np.sum(one.gain ** 2)) * one.taper.max()
    impulse = 1 / through / one.rate_hz
    per_min = 60 * one.rate_hz / _recorded(one)
    return Detection.of_effect(
        effect.within(rate_per_min=per_min * count, impulse_n_m_s=impulse * height), p_value,
        f'The input has about {count:.0f} impulses of {impulse * height:.3g} N m s.',
        stds={'rate_per_min': per_min * count_std, 'impulse_n_m_s': impulse * height_std},
        trials=TRIALS, times=((one.inside.start + rows) / one.rate_hz, probabilities))


@deflection('impulsive_events')
def impulse_deflection(effect, sensitivity):
    """Return d' of one impulse; the number of impulses adds to it."""
    return effect.impulse_n_m_s * sensitivity.rate_hz * np.sqrt(
        2 * np.sum(sensitivity.gain ** 2)) * sensitivity.taper.max()


def anomalous_spikes(reconstruction, channel, i):
    """Detect spikes on channel `i`, called `channel`, that no input makes."""
    gain = reconstruction.residual_gain[:, i]
    unit = np.where(reconstruction.missing, 0.0, reconstruction.series(
        gain, reconstruction.residual[:, i]))[reconstruction.inside]
    p_value, height, count, *_ = _likelihood(reconstruction, unit, gain)
    p_value = float(p_value * reconstruction.white.shape[1])
    if p_value >= LIMITS.p_value.value:
        return None
    # whatever the channel: a candidate whose records have spikes may have them anywhere
    return Detection('', {'channel': channel}, p_value,
                     f'Channel {channel} has about {count[0]:.0f} spikes of {height[0]:.1f} '
                     'standard deviations that no input makes.',
                     trials=TRIALS * reconstruction.white.shape[1], basis='spikes')


def _likelihood(one, unit, gain):
    """Return p-value, height and count with their deviations, and the spectrum of noise."""
    # And the places of all peaks, with the probability of each to be an impulse.
    spectrum = np.zeros(one.rows // 2 + 1)
    spectrum[one.first:one.first + len(gain)] = gain ** 2
    response = np.fft.irfft(spectrum, one.rows)
    # the impulses themselves have raised the levels that the unit was taken from
    count = _recorded(one)
    places, heights = peaks(unit / rms_of(unit, count), response / response[0])
    heights = np.abs(heights)
    turns = 2 * np.pi * np.arange(len(spectrum)) / one.rows
    speed = np.sqrt(np.sum(turns ** 2 * spectrum) / np.sum(spectrum))
    usual = count * speed / np.pi               # times exp(-a^2 / 2): peaks above a
    least = LIMITS.least_peak.value
    sizes = np.linspace(0.5 * least, 1.1 * max(heights, default=least), 60)
    counts = np.geomspace(0.5, 1e4, 80)
    values = np.empty((len(sizes), len(counts)))
    noise = usual * heights * np.exp(-np.minimum(heights ** 2 / 2, 600.0))
    for row, height in zip(values, sizes):
        density = norm.pdf(heights - height) / noise
        row[:] = (np.log1p(counts[:, None] * density).sum(axis=1)
                  - counts * norm.sf(least - height))
    p_value = float(min(1.0, TRIALS * np.exp(-values.max())))
    # few impulses of one height and more of a smaller one are alike: means over all that fit
    weights = np.exp(values - values.max())
    size, count = (moments(sizes, weights.sum(axis=1)), moments(counts, weights.sum(axis=0)))
    there = count[0] * norm.pdf(heights, size[0], np.hypot(1.0, size[1]))
    return p_value, size, count, spectrum, (places, there / (there + noise))


def _recorded(one):
    """Return how many samples of a Reconstruction count."""
    return np.count_nonzero(~one.missing[one.inside])
