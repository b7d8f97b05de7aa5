"""
Octave-like bands: low and high modes from one stream, without the user choosing.

A short set of lags at a low rate sees as many cycles of a slow mode as the same set at the full
rate sees of a fast one. Every band is the one above it, low-pass filtered and thinned; each
answers for its own range of frequencies, eq. (41) of docs/theory-identification.md.
"""
from dataclasses import dataclass

import numpy as np

FACTOR = 5              # rate of a band over the rate of the next
STOP_DB = 80.0          # what folds back is below 1e-4 of the amplitude
EDGE = 0.40             # pass band of a thinned band, over its rate; folds back above 0.6
LOW, HIGH = 0.045, 0.36  # a band answers for this range, over its rate
SAMPLES_MIN = 400       # a window with fewer samples in a band does not identify it
COVERAGE = 0.7          # least weight of present samples under the filter, else missing


@dataclass(frozen=True)
class Band:
    """
    One band of the stream.

    Attributes
    ----------
    rate_hz : float
        Sampling rate of the band [Hz].
    low_hz, high_hz : float
        Range of frequencies for which the band answers [Hz]; neighbours overlap.
    factor : int
        Rate of the band above, or of the stream, over the rate of this one.

    """

    rate_hz: float
    low_hz: float
    high_hz: float
    factor: int


def plan_bands(rate_hz, window_s, cycles_min, count=0, decimation=1):
    """
    Choose the bands for a stream.

    Parameters
    ----------
    rate_hz : float
        Rate of the stream [Hz].
    window_s : float
        Length of the window [s].
    cycles_min : float
        Cycles that the window must hold of a mode.
    count : int
        Number of bands; 0 goes down until the window holds too few samples or cycles.
    decimation : int
        Factor by which the stream itself is thinned first.

    Returns
    -------
    tuple of Band
        From the highest rate to the lowest.

    """
    floor_hz = cycles_min / window_s
    rate_hz = rate_hz / decimation
    high = 0.49 if decimation == 1 else HIGH        # above it the filter falls
    bands = [Band(rate_hz, max(LOW * rate_hz, floor_hz), high * rate_hz, decimation)]
    while count == 0 or len(bands) < count:
        rate = bands[-1].rate_hz / FACTOR
        if count == 0 and (rate * window_s < SAMPLES_MIN or bands[-1].low_hz <= floor_hz):
            break
        bands.append(Band(rate, max(LOW * rate, floor_hz), HIGH * rate, FACTOR))
    last = bands[-1]
    bands[-1] = Band(last.rate_hz, floor_hz, last.high_hz, last.factor)
    return tuple(bands)


def low_pass(factor):
    """
    Return the linear-phase taps that precede thinning by `factor`; they sum to 1.

    A windowed sinc by Kaiser's formulas, as `scipy.signal.firwin` has it, whose import alone
    would take longer than the identification of a minute.
    """
    width = 2.0 * (1.0 - 2.0 * EDGE) / factor          # of the transition, Nyquist is 1
    count = int(np.ceil((STOP_DB - 7.95) / (2.285 * np.pi * width) + 1.0)) | 1
    window = np.kaiser(count, 0.1102 * (STOP_DB - 8.7))
    taps = np.sinc((np.arange(count) - count // 2) / factor) * window
    return taps / taps.sum()


class Thinner:
    """
    Filter and thin a stream of rows, causally, with missing samples.

    A missing sample has no weight under the filter and the rest is scaled up (normalised
    convolution, Knutsson and Westin 1993); where less than `COVERAGE` of the weight is present
    the output is missing too.
    """

    def __init__(self, factor, channels):
        self.factor, self.taps = factor, low_pass(factor)[::-1].copy()
        self.past = np.full((len(self.taps) - 1, channels), np.nan)
        self.phase = 0          # rows to skip before the next output

    def push(self, rows):
        """Take rows, shape (n, l), NaN where missing; return the thinned rows, (m, l)."""
        length = len(self.taps)
        rows = np.concatenate([self.past, rows])
        self.past = rows[len(rows) - length + 1:]
        fresh = len(rows) - length + 1
        starts = np.arange(self.phase, fresh, self.factor)
        self.phase = (self.phase - fresh) % self.factor
        if len(starts) == 0:
            return np.empty((0, rows.shape[1]))
        windows = np.lib.stride_tricks.sliding_window_view(rows, length, axis=0)[starts]
        present = ~np.isnan(windows)
        if present.all():
            return windows @ self.taps
        weight = present @ self.taps
        share = present @ np.abs(self.taps) / np.abs(self.taps).sum()
        total = np.where(present, windows, 0.0) @ self.taps
        with np.errstate(divide='ignore', invalid='ignore'):
            return np.where(share >= COVERAGE, total / weight, np.nan)
