"""
A sweep: a line whose frequency moves linearly from start to end, eq. (168), (169), (179).

Nobody knows the way from the disturbance to the channels, so nothing is summed in phase: powers of
short pieces are, along straight lines in time and frequency. A sweep is nowhere for long; whatever
stays at its frequency, as modes and lines do, is in the usual power of that frequency.
"""
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.stats import gamma, t as student

from ssi_ros.gap.reference.forms import Form
from ssi_ros.gap.reference.signs import NEVER, Sign
from ssi_ros.gap.tracks import cells, HALF_LAPPED, straight

LONGER = (1, 2, 4)      # times the shortest pieces: slower sweeps stay longer in a bin
MOST_PIECES = 400       # so that a long record costs no more
LEAST_BINS = 4          # between the ends, else it is a line or a mode that moved
LEAST_PIECES = 16
LAGS = 6                # pieces after which the power of a frequency has forgotten itself
CLEARLY = 3.0           # standard deviations of a correlation that is more than chance
BESIDE = 3              # bins to which a mode may have moved with its long memory
SURE = 1e-3
FEWEST_CLEAR = 2        # groups that must be left of a band
SPREAD_BINS = 12        # of a segment, to which its taper carries a strong sweep


@dataclass(frozen=True, eq=False)
class Sonogram:
    """
    Powers of short pieces over the usual power of their frequency and of their time.

    `powers` has the shape (k, f), mean 1; `usual` (f,) is its long-run variance; pieces are `rows`
    long and half overlap.
    """

    powers: np.ndarray
    usual: np.ndarray
    rows: int
    channels: int


def sonogram(left, rows):
    """
    Return the sonogram of what the past does not predict.

    Parameters
    ----------
    left : ndarray, shape (n, l)
        Residuals of unit variance.
    rows : int
        Of a piece, even.

    Returns
    -------
    Sonogram

    """
    powers = cells(left, rows)
    powers /= powers.mean()
    away = powers - powers.mean(axis=0)
    usual = (away ** 2).mean(axis=0)
    chance = CLEARLY * usual / np.sqrt(len(powers))
    for lag in range(1, min(LAGS, len(powers) // 4) + 1):
        alike = (away[lag:] * away[:-lag]).mean(axis=0)
        usual = usual + 2 * np.where(alike > chance, alike, 0.0)
    least = (1 + 2 * HALF_LAPPED) / left.shape[1]
    usual = maximum_filter1d(np.maximum(usual, least), 2 * BESIDE + 1)
    return Sonogram(powers, usual, rows, left.shape[1])


def sweep(left_one, left_two, rate_hz):
    """
    Search a sweep over the whole record that the reference does not have.

    Parameters
    ----------
    left_one, left_two : ndarray, shape (n, l)
        What the past does not predict of reference and record.
    rate_hz : float
        Their rate [Hz].

    Returns
    -------
    Sign or None

    """
    # the shortest pieces have as many bins as there are pieces
    shortest = max(np.sqrt(2 * len(left_two)), 2 * len(left_two) / MOST_PIECES)
    sizes = [int(longer * shortest) // 2 * 2 for longer in LONGER]
    sizes = [rows for rows in sizes if LEAST_PIECES * rows < 2 * min(len(left_one), len(left_two))]
    if not sizes:
        return None
    found = [_along(*(sonogram(v, rows) for v in (left_one, left_two)), rate_hz)
             for rows in sizes]
    chance = min(f[0] for f in found) * len(LONGER)
    if not chance < SURE:
        return None
    # of those that see it, longer pieces know its ends better
    start, end, size = [f for f in found if f[0] < SURE][-1][1:]
    return Sign('wheel_speed_sweep', {}, {'start_hz': (start, 'Hz'), 'end_hz': (end, 'Hz')},
                float(max(chance, 10 * NEVER)),
                f'a sweep from {start:.4g} to {end:.4g} Hz, {size:.0f} sd')


def _along(one, two, rate_hz):
    """Return the chance of the best straight line, its ends [Hz] and its size in deviations."""
    count, bins = two.powers.shape
    # a mode that rings long, or a shaker's signal, has its variance in the reference, too
    units = ((two.powers - 1) / np.sqrt(one.usual)).astype(np.float32)
    track = straight(units, LEAST_BINS, min(count, bins))
    if track is None:
        return 1.0, 0.0, 0.0, 0.0
    path = track.path
    size = float(units[np.arange(count), path].sum()) / np.sqrt(count)
    least = (1 + 2 * HALF_LAPPED) / two.channels
    lines = 2.0 * bins * count
    chance = lines * gamma.sf(count / least + size * np.sqrt(count / least), count / least)
    chance = max(chance, lines * _by_turns(units, path))
    if _mean_along(one, path, rate_hz) > size / 2:
        chance = 1.0
    start, end = (rate_hz * bin_ / two.rows for bin_ in (track.start, track.end))
    return min(float(chance), 1.0), start, end, size


def _by_turns(units, path):
    """Return the chance of a sum along a path by the same frequencies at other times."""
    count = len(path)
    turns = np.arange(count // 8, count - count // 8)
    at = (np.arange(count) + turns[:, None]) % count
    others = units[at, path].sum(axis=1)
    own = units[np.arange(count), path].sum()
    return float(student.sf((own - others.mean()) / others.std(), len(turns) // 2))


def _mean_along(sono, path, rate_hz):
    """Return the size of the same path, from start to end, in another recording."""
    count = len(sono.powers)
    same = path[np.rint(np.linspace(0, len(path) - 1, count)).astype(int)]
    same = np.clip(same, 0, sono.powers.shape[1] - 1)
    units = (sono.powers[np.arange(count), same] - 1) / np.sqrt(sono.usual[same])
    return float(units.sum() / np.sqrt(count))


def of_sweep(sign, two, duration_s):
    """
    Return the form of a sweep: the record without the cells that it crosses, eq. (179).

    Its spectrum in a piece of time is that of the way to the channels, which nobody knows; but
    what it does in a band it does in few groups, and the others show the band without it.

    Parameters
    ----------
    sign : Sign
        What was seen.
    two : Spectra
        Of the record.
    duration_s : float
        Length of the record [s].

    Returns
    -------
    Form

    """
    cut = two.cut
    start, end = (sign.numbers[f'{word}_hz'][0] for word in ('start', 'end'))
    half_s = two.weights * cut.rows / cut.rate_hz / 2
    # what it has set in motion late in a group still rings in the next
    ends = [start + (end - start) * t / duration_s
            for t in (two.times_s - 2 * half_s, two.times_s + half_s)]
    reach = cut.width_hz / 2 + SPREAD_BINS * cut.resolution_hz
    low, high = np.min(ends, axis=0) - reach, np.max(ends, axis=0) + reach
    middles = cut.middles_hz
    crossed = (middles > low[:, None]) & (middles < high[:, None])
    # a band that the sweep never leaves shows nothing without it
    crossed &= np.count_nonzero(~crossed, axis=0) >= FEWEST_CLEAR
    return Form(sign.effect, sign.place, (), lambda n, x: (None, None), sign.text,
                constants=sign.numbers, crossed=crossed)
