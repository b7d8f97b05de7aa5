"""
Recordings that are too short for spectra, or die away: compared by their strongest vibration.

A mean over segments needs a motion that goes on, and segments in which its strongest vibration
lies above the lowest band. What is shorter, or rings down, still has a frequency, which is known
to a part of the reciprocal of the length T, whatever excited it: two that differ by more than
1 / T are two vibrations, eq. (187).
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.regimes.thresholds import LIMITS

WINDOWS = 8             # of a recording, whose power may fall steadily
FINER = 8               # zero padding: a peak to an eighth of a bin
LOWEST_BINS = 3         # below it a peak is drift, not vibration
MAIN_LOBE = 2.0         # bins to either side of a peak that are its own, under a Hann taper
MOST_ROWS = 1 << 16     # whose frequency is taken; more resolution is of no use here


@dataclass(frozen=True, eq=False)
class Vibration:
    """The strongest vibration of a recording."""

    frequency_hz: float
    share: float            # of the power of the channel in which it stands out most
    shape: np.ndarray       # (l,), complex amplitudes of the channels, each over its noise
    seconds: float          # length of the recording
    falls_db: float         # by which its power falls through the recording; 0 if unsteadily
    varies_db: float        # between windows of the recording, without the fifths at either end

    @property
    def dies_away(self):
        """Whether the recording is of a motion that dies away."""
        return self.falls_db > LIMITS.dies_away.value


def vibration(values, rate_hz):
    """Return the strongest Vibration of a recording (n, l) without gaps."""
    values = values - values.mean(axis=0)
    rows = min(len(values), MOST_ROWS)
    taper = np.hanning(rows)[:, None]
    lines = np.fft.rfft(values[:rows] * taper, FINER * rows, axis=0)
    power = np.square(np.abs(lines))
    low, lobe = LOWEST_BINS * FINER, int(MAIN_LOBE * FINER)
    shares, peaks = [], []
    for column in power.T:
        peak = low + int(np.argmax(column[low:]))
        peaks.append(peak)
        shares.append(column[max(peak - lobe, 0):peak + lobe + 1].sum()
                      / max(column[low:].sum(), 1e-300))
    best = int(np.argmax(shares))
    peak = peaks[best]
    noise = np.sqrt(np.median(power[low:], axis=0))
    return Vibration(peak * rate_hz / (FINER * rows), float(shares[best]),
                     lines[peak] / np.maximum(noise, 1e-300), rows / rate_hz,
                     *_levels(values[:, best]))


def _levels(column):
    """Return by how many decibel the power of a channel falls steadily, and how far it varies."""
    power = np.array([np.mean(np.square(part)) for part in np.array_split(column, WINDOWS)])
    level = 10 * np.log10(np.maximum(power, 1e-300))
    at = np.arange(WINDOWS)
    slope, start = np.polyfit(at, level, 1)
    rest = level - slope * at - start
    steady = 1 - np.sum(rest ** 2) / max(np.sum((level - level.mean()) ** 2), 1e-300)
    low, high = np.quantile(level, [0.2, 0.8])
    return float(-slope * (WINDOWS - 1)) * (steady > LIMITS.steadily.value), float(high - low)


def unresolved(one, lowest_hz):
    """Return whether one vibration is most of a recording, and below what bands resolve."""
    return one.share > LIMITS.most.value and one.frequency_hz < lowest_hz


def moved(one, two):
    """Return whether two recordings hold one vibration each, which is elsewhere in the second."""
    if min(one.share, two.share) < LIMITS.most.value:
        return False
    apart = abs(two.frequency_hz - one.frequency_hz)
    if apart < 1 / min(one.seconds, two.seconds):
        return False
    clear = (np.minimum(np.abs(one.shape), np.abs(two.shape)) > LIMITS.stands_out.value)
    a, b = one.shape[clear], two.shape[clear]
    alike = abs(np.vdot(a, b)) ** 2 / max(np.vdot(a, a).real * np.vdot(b, b).real, 1e-300)
    # another mode of the same structure has another shape, or is far away
    return (clear.sum() < 2 or alike > LIMITS.same_shape.value) and (
        apart < LIMITS.same_mode.value * one.frequency_hz)
