"""
A sweep: a line whose frequency moves linearly from start to end, eq. (168), (169), (179).

The transfer from the disturbance to the channels is unknown, so nothing is summed in phase: powers
of short segments are, along straight lines in time and frequency. A sweep is nowhere for long;
whatever stays at its frequency, as modes and lines do, is in the usual power of that frequency.
"""
from functools import partial

import numpy as np

from ssi_ros.effects.registry import detects
from ssi_ros.events.track import cells, HALF_LAPPED, straight
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.nominal.forms.candidate import Form
from ssi_ros.gap.nominal.stationary.samples import EXACT
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.scipy_later import maximum_filter1d
from ssi_ros.tails import gamma, student

LONGER = (1, 2, 4)      # times the shortest segments: slower sweeps stay longer in a bin
MOST_SEGMENTS = 400     # so that a long record costs no more
LEAST_BINS = 4          # between the ends, else it is a line or a mode that moved
LEAST_SEGMENTS = 16
LAGS = 6                # segments after which the power of a frequency is uncorrelated
BESIDE = 3              # bins to which a mode may have moved with its long memory
FEWEST_CLEAR = 2        # groups of a band that must not be crossed
SPREAD_BINS = 12        # of a segment, to which its taper carries a strong sweep


def sonogram(residual, rows):
    """Return powers of segments (k, f) over the usual ones, and their variance in time (f,)."""
    powers = cells(residual, rows)
    powers /= powers.mean()
    away = powers - powers.mean(axis=0)
    usual = (away ** 2).mean(axis=0)
    chance = LIMITS.sweep_correlation.value * usual / np.sqrt(len(powers))
    for lag in range(1, min(LAGS, len(powers) // 4) + 1):
        alike = (away[lag:] * away[:-lag]).mean(axis=0)
        usual = usual + 2 * np.where(alike > chance, alike, 0.0)
    least = (1 + 2 * HALF_LAPPED) / residual.shape[1]
    return powers, maximum_filter1d(np.maximum(usual, least), 2 * BESIDE + 1)


@detects('wheel_speed_sweep', of='recordings')
def swept_line(effect, recordings):
    """Detect a sweep over the whole record; what periods do not repeat shows it better."""
    found = None if recordings.enough_periods else sweep(
        *recordings.prediction_errors, recordings.pair.rate_hz)
    if found is None:
        return None
    p, start, end, size = found
    return Detection(effect.name, {'start_hz': start, 'end_hz': end}, max(p, 10 * EXACT),
                     f'a sweep from {start:.4g} to {end:.4g} Hz, {size:.0f} sd',
                     basis=partial(without_sweep, start_hz=start, end_hz=end))


def sweep(residual_one, residual_two, rate_hz):
    """Return p-value, start, end [Hz], size [sd] of a sweep that the reference lacks, or None."""
    # the shortest segments have as many bins as there are segments
    shortest = max(np.sqrt(2 * len(residual_two)), 2 * len(residual_two) / MOST_SEGMENTS)
    sizes = [int(longer * shortest) // 2 * 2 for longer in LONGER]
    shorter = min(len(residual_one), len(residual_two))
    sizes = [rows for rows in sizes if LEAST_SEGMENTS * rows < 2 * shorter]
    if not sizes:
        return None
    found = [(chance, *(rate_hz * bin_ / rows for bin_ in ends), size) for rows in sizes
             for chance, ends, size in [_along(residual_one, residual_two, rows)]]
    chance = min(f[0] for f in found) * len(LONGER)
    if not chance < LIMITS.detected.value:
        return None
    # of those that detect it, longer segments estimate its ends better
    return (float(chance), *[f for f in found if f[0] < LIMITS.detected.value][-1][1:])


def _along(residual_one, residual_two, rows):
    """Return the chance of the best straight line, its ends [bins] and its size in deviations."""
    (before, usual), (powers, _) = (sonogram(v, rows) for v in (residual_one, residual_two))
    count, bins = powers.shape
    # a mode that rings long, or a shaker's signal, has its variance in the reference, too
    units = ((powers - 1) / np.sqrt(usual)).astype(np.float32)
    track = straight(units, LEAST_BINS, min(count, bins))
    if track is None:
        return 1.0, (0.0, 0.0), 0.0
    path = track.path
    size = float(units[np.arange(count), path].sum()) / np.sqrt(count)
    least = (1 + 2 * HALF_LAPPED) / residual_two.shape[1]
    lines = 2.0 * bins * count
    chance = lines * gamma.sf(count / least + size * np.sqrt(count / least), count / least)
    chance = max(chance, lines * _by_turns(units, path))
    if _mean_along(before, usual, path) > size / 2:
        chance = 1.0
    return min(float(chance), 1.0), (track.start, track.end), size


def _by_turns(units, path):
    """Return the chance of a sum along a path by the same frequencies at other times."""
    count = len(path)
    turns = np.arange(count // 8, count - count // 8)
    at = (np.arange(count) + turns[:, None]) % count
    others = units[at, path].sum(axis=1)
    own = units[np.arange(count), path].sum()
    return float(student.sf((own - others.mean()) / others.std(), len(turns) // 2))


def _mean_along(powers, usual, path):
    """Return the size of the same path, from start to end, in another recording."""
    count = len(powers)
    same = path[np.rint(np.linspace(0, len(path) - 1, count)).astype(int)]
    same = np.clip(same, 0, powers.shape[1] - 1)
    units = (powers[np.arange(count), same] - 1) / np.sqrt(usual[same])
    return float(units.sum() / np.sqrt(count))


def without_sweep(recordings, start_hz, end_hz):
    """Return the form of a sweep: the record without the cells that it crosses, eq. (179)."""
    # Its spectrum in a segment is that of the transfer to the channels, which is unknown; but what
    # it does in a band it does in few groups, and the others show the band without it.
    two = recordings.two
    cut, duration_s = two.cut, len(recordings.clean.record) / recordings.clean.rate_hz
    half_s = two.weights * cut.rows / cut.rate_hz / 2
    # what it has excited late in a group still rings in the next
    ends = [start_hz + (end_hz - start_hz) * t / duration_s
            for t in (two.times_s - 2 * half_s, two.times_s + half_s)]
    reach = cut.width_hz / 2 + SPREAD_BINS * cut.resolution_hz
    low, high = np.min(ends, axis=0) - reach, np.max(ends, axis=0) + reach
    middles = cut.middles_hz
    crossed = (middles > low[:, None]) & (middles < high[:, None])
    # a band that the sweep never leaves shows nothing without it
    crossed &= np.count_nonzero(~crossed, axis=0) >= FEWEST_CLEAR
    return (Form({}, (), masked=crossed),)
