"""
A recording that repeats itself, as what repeats and what does not, eq. (170) to (172).

Under a shaker that plays one signal over and over, a structure that stays as it is and is
excited by nothing else gives the same period again and again. Its length is that of the signal by
the clock of the recorder; what differs between periods came from elsewhere.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.nominal.periodic.period import autocorrelation, LEAST_PERIODS
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.scipy_later import uniform_filter1d

ENOUGH_PERIODS = 3      # below it what differs between them has no spectrum of its own
CLOCKS = 0.05           # share by which the periods of two recordings of one signal may differ
FINER = 3               # corrections of a delay of less than a row
ROW = 1.0               # that a period may be wrong by before it is refined
CLEAR = 100.0           # times what does not repeat, above which a line has a phase
BESIDE = 9              # lines over which that is averaged
ARRIVED, MOST_STEPS = 0.1, 60   # rows of a correction that is none, and corrections
FEW = 0.95              # quantile of the lines where none is so clear
INDEPENDENT = 10        # lines at most
TAPS, SHARPNESS = 32, 8.0       # on each side of an instant between samples, and their taper
CHUNK = 100_000         # instants at a time


@dataclass(frozen=True, eq=False)
class Repeats:
    """The whole periods of a recording, sampled anew so that each has the same rows."""

    periods: np.ndarray     # (p, n, l), without offset
    period_rows: float      # length of a period in rows of the recording
    period_std: float       # standard deviation of that
    rate_hz: float          # of the rows of `periods`, by the clock of the recording
    recorded: float         # periods in the recording, whole or not

    @property
    def seconds(self):
        """Length of all whole periods [s]."""
        return self.periods.shape[0] * self.periods.shape[1] / self.rate_hz

    @property
    def mean(self):
        """Return what repeats: the mean period, shape (n, l)."""
        return self.periods.mean(axis=0)

    @property
    def rest(self):
        """Return what does not, shape (p n, l), scaled for what the mean took of its power."""
        count = len(self.periods)
        rest = (self.periods - self.mean) * np.sqrt(count / (count - 1))
        return rest.reshape(-1, rest.shape[2])

    @property
    def share(self):
        """Return the share of the power of all channels, each scaled to 1, that repeats."""
        total = np.square(self.periods).mean(axis=(0, 1))
        return 1.0 - float(np.mean(np.square(self.rest).mean(axis=0) / total))


def at_instants(values, rows):
    """Return values (n, l) between samples, at rows (m,), by a tapered sinc; 0 beyond the ends."""
    near = np.arange(1 - TAPS, TAPS + 1)
    taper = np.kaiser(16 * 2 * TAPS + 1, SHARPNESS)
    padded = np.pad(values, ((TAPS, TAPS + 1), (0, 0)))
    found = np.empty((len(rows), values.shape[1]))
    for first in range(0, len(rows), CHUNK):
        some = rows[first:first + CHUNK]
        whole = np.clip(np.floor(some).astype(int), 0, len(values) - 1)
        away = near - (some - whole)[:, None]
        weight = np.sinc(away) * np.interp(away, np.linspace(-TAPS, TAPS, len(taper)), taper)
        parts = padded[whole[:, None] + near + TAPS]
        found[first:first + CHUNK] = np.einsum('mk,mkl->ml', weight, parts)
    return found


def repeats_of(values, rate_hz, guess):
    """Return the Repeats of a recording (n, l), None where it has too few or they differ."""
    # the rows of a period are a guess, by a clock that may be wrong by CLOCKS
    values = values - values.mean(axis=0)
    period = _nearest_repeat(values, guess)
    rows = int(round(guess))
    lag, last, std, steps = 1, _count(values, period) - 1, 0.0, 0
    if last + 1 < LEAST_PERIODS:
        return None
    while lag:
        late, std = _lateness(_cut(values, period, rows)[:last + 1], lag)
        period += late / lag
        std /= lag
        last = min(last, _count(values, period) - 1)
        if abs(late) < ARRIVED:
            lag = min(2 * lag, last) if lag < last else 0
        steps += 1
        if steps == MOST_STEPS:
            return None
    if last + 1 < LEAST_PERIODS:
        return None
    periods = _cut(values, period, rows)
    # where each is late by another time, as of a drive that hunts, so is their mean
    late = [_lateness(periods[k:k + 2], 1)[0] for k in range(last)]
    std = max(std, np.std(late) / np.sqrt(max(last - 1, 1)))
    split = Repeats(periods, period, std, rate_hz * rows / period, len(values) / period)
    return split if split.share > LIMITS.repeats.value else None


def delay_between(one, two):
    """Return by how many rows a record is late, 0 to n, and the correlation of mean periods."""
    first, second = (np.fft.rfft(r.mean / r.mean.std(axis=0), axis=0) for r in (one, two))
    cross = (first.conj() * second).mean(axis=1)
    rows = one.mean.shape[0]
    delay = float(np.argmax(np.fft.irfft(cross, rows)))
    w = 2 * np.pi * np.fft.rfftfreq(rows)
    # the peak lies between rows: the remaining phases rise with frequency
    for _ in range(FINER):
        rest = cross * np.exp(1j * w * delay)
        delay -= np.sum(w * rest.imag) / np.sum(np.square(w) * np.abs(rest))
    alike = np.fft.irfft(cross * np.exp(1j * w * delay), rows)[0] / rows
    return float(delay) % rows, float(alike)


def same_signal(one, two):
    """Return whether one signal drove both recordings."""
    return delay_between(one, two)[1] > LIMITS.same_signal.value


def turned(one, delay):
    """Return the mean period of a recording, late by so many rows, shape (n, l)."""
    rows = len(one.mean)
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(rows) * delay)[:, None]
    return np.fft.irfft(np.fft.rfft(one.mean, axis=0) * turn, rows, axis=0)


def _nearest_repeat(values, guess):
    """Return the lag near a guess at which a recording is most like itself."""
    lags = np.arange(int(guess * (1 - CLOCKS)), min(int(guess * (1 + CLOCKS)) + 2, len(values)))
    if not len(lags):
        return guess
    return float(lags[np.argmax(autocorrelation(values)[lags])])


def _count(values, period):
    """Return how many periods a recording holds; the last may lack a part of a row."""
    return int((len(values) + ROW) // period)


def _cut(values, period, rows):
    """Return whole periods, each sampled anew in as many rows, shape (p, rows, l)."""
    step = period / rows
    count = _count(values, period)
    instants = np.arange(count * rows) * step
    return at_instants(values, instants).reshape(count, rows, -1)


def _lateness(periods, lag):
    """Return by how many rows a period is late after so many others, with its spread, (171)."""
    # A delay turns the phase of every line by its frequency; a structure that changes turns those
    # near its modes. The median over the lines, with the weight of their frequency, is the delay
    # of most of them.
    y = np.fft.rfft(periods, axis=1)[:, 1:]
    turned = np.einsum('pfl,pfl->fl', y[:-lag].conj(), y[lag:]) / (len(y) - lag)
    # by sizes alone, which are half of it: what is late would make noise of the lines that show it
    sizes = np.abs(y)
    noise = 2 * np.square(sizes - sizes.mean(axis=0)).sum(axis=0) / (len(y) - 1)
    noise = uniform_filter1d(noise, BESIDE, axis=0)
    w = np.tile(2 * np.pi * np.arange(1, len(turned) + 1)[:, None] / periods.shape[1], y.shape[2])
    clear = np.abs(turned) > CLEAR * noise
    if not clear.any():
        clear = np.abs(turned) >= np.quantile(np.abs(turned), FEW)
    late, weight = -np.angle(turned[clear]) / w[clear], w[clear]
    order = np.argsort(late)
    share = np.cumsum(weight[order]) / weight.sum()
    low, middle, high = late[order][np.searchsorted(share, (0.25, 0.5, 0.75))]
    # lines near each other turn alike: few are independent
    return float(middle), float((high - low) / np.sqrt(min(len(late), INDEPENDENT)))
