"""From samples to tapered spectra of segments of the record, eq. (93)."""
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ssi_ros.gap.spectra.thresholds import LIMITS
from ssi_ros.integrity.missing import parts_between, segment_rows
from ssi_ros.windows import autocorrelation, tapered_dft, unit_taper, variance_inflation

TAPER_SHARE = 0.25      # of a segment, on which the taper rises and falls
MOST, PARTS = 192, 96   # segments that are held one by one; parts of a record with more


@dataclass(frozen=True, eq=False)
class Frame:
    """
    How a record is cut and tapered: all that the expected spectrum needs to know of it.

    Of a segment, bins first, ..., last - 1 of the DFT are used; segments share no row, and lie
    between long gaps. `overlap` is the mean over the segments of sum_n w_n w_(n+lag) at every lag,
    missing rows counted as zero.
    """

    rate_hz: float          # of the stamps [Hz]
    rows: int               # samples of a segment
    begins: tuple           # (segments,), row that each begins with
    first: int
    last: int
    taper: np.ndarray       # (rows,), weights w, of sum w^2 = 1
    overlap: np.ndarray     # (rows,)
    settlings: float = 1.0  # of a motion that does not decay, over the record
    most: int = 0           # segments that are held one by one, 0: the usual number

    @property
    def segments(self):
        """Return the number of segments."""
        return len(self.begins)

    @property
    def settles(self):
        """Return the rows in which a motion settles that does not decay."""
        return (self.begins[-1] + self.rows) / self.settlings

    @property
    def parts(self):
        """Return in how many parts a record changes: its segments, or groups of neighbours."""
        return self.segments if self.segments <= (self.most or MOST) else self.most or PARTS

    def parts_of(self, segments):
        """Return the number of the part that each of some segments is in."""
        return np.asarray(segments, int) * self.parts // self.segments

    def mean_of_parts(self, values):
        """Return the means over the parts of values of all segments, (segments, ...)."""
        if self.parts == self.segments:
            return values
        each = self.parts_of(self.used)
        return np.stack([values[each == p].mean(axis=0) for p in range(self.parts)])

    @property
    def used(self):
        """Return the number of every segment, from 0."""
        return tuple(range(self.segments))

    @property
    def begins_s(self):
        """Return when each segment begins, (segments,), [s]."""
        return np.array(self.begins) / self.rate_hz

    @property
    def span_s(self):
        """Return the length of a segment [s]."""
        return self.rows / self.rate_hz

    @cached_property
    def inflation(self):
        """Rows sum w^4 >= 1, by which the information in all bins is below their number."""
        return self.rows * float(np.sum(self.taper ** 4))

    def cut_shorter(self, times, settings):
        """Return the frame of so many times as many segments, in the same parts."""
        rows = self.rows // times
        return replace(frame_at(self.rate_hz, rows, tuple(
            b + k * rows for b in self.begins for k in range(times)), settings), most=self.parts)

    def inflation_of(self, bins):
        """Return the variance inflation of so many neighbouring bins."""
        return variance_inflation(self.taper, bins)

    @property
    def frequencies_hz(self):
        """Frequency of every bin used, shape (k,), [Hz]."""
        return self.cycles * self.rate_hz

    @property
    def cycles(self):
        """Frequency of every bin used, shape (k,), [cycles a sample]."""
        return np.arange(self.first, self.last) / self.rows


def make_frame(rows_total, rate_hz, settings, present=None):
    """Choose the segments of a record of so many rows; ValueError if too few are `present`."""
    there = np.ones(rows_total, bool) if present is None else present
    parts = parts_between(there, LIMITS.filled_s.value * rate_hz)
    recorded_s = float(np.diff(parts).sum()) / rate_hz
    rows = int(min(settings.segment_s, recorded_s / settings.least_segments) * rate_hz)
    if recorded_s < rows_total / rate_hz and rows:
        least = 8 * settings.band_bins / (settings.high_share - 2 * settings.low_hz / rate_hz)
        rows = segment_rows(parts, rows, int(np.ceil(least)) + 2, settings.least_segments)
    first = max(1, int(np.ceil(settings.low_hz * rows / rate_hz)))
    last = int(settings.high_share * rows / 2)
    if settings.low_hz >= (top := settings.high_share * rate_hz / 2):
        raise ValueError(f'low_hz={settings.low_hz:g} is not below {top:g} Hz, the highest '
                         f'frequency used of a record of {rate_hz:g} Hz; set a lower one')
    if last - first < 4 * settings.band_bins:
        need = settings.least_segments * 8 * settings.band_bins / rate_hz
        raise ValueError(f'the record has {recorded_s:g} s; {need:g} s are needed for '
                         f'{settings.least_segments} segments with enough frequency bins'
                         + f', all between its {len(parts) - 1} gaps' * (len(parts) > 1))
    return frame_at(rate_hz, rows, tuple(
        int(b) for a, e in parts for b in range(a, e - rows + 1, rows)), settings, there)


def frame_at(rate_hz, rows, begins, settings, present=None):
    """Return the frame of segments of so many rows that begin at rows; all rows are there."""
    taper = unit_taper(rows, TAPER_SHARE)
    there = 1.0 if present is None else np.array([present[b:b + rows] for b in begins])
    return Frame(rate_hz, rows, begins, max(1, int(np.ceil(settings.low_hz * rows / rate_hz))),
                 int(settings.high_share * rows / 2), taper, autocorrelation(taper * there))


def frame_of(samples, settings):
    """Choose the segments of Samples; a row with any NaN is missing; see `make_frame`."""
    return make_frame(len(samples.values), samples.rate_hz, settings,
                      ~np.isnan(samples.values).any(axis=1))


def whole_frame(rows, rate_hz, settings, edge_s):
    """Return the frame of a record as one segment, for lines, tapered over `edge_s` at ends."""
    taper = unit_taper(rows, min(1.0, 2 * edge_s * rate_hz / rows))
    first = max(1, int(np.ceil(settings.low_hz * rows / rate_hz)))
    return Frame(rate_hz, rows, (0,), first, int(settings.high_share * rows / 2), taper,
                 autocorrelation(taper))


def spectra(samples, frame):
    """Return the tapered DFT (segments, k, l) of Samples; a row with any NaN counts as zero."""
    gone = np.isnan(samples.values).any(axis=1)[:, None]
    values = np.where(gone, 0.0, samples.values) if gone.any() else samples.values
    return tapered_dft(values, frame.taper, frame.begins)[:, frame.first:frame.last]


def periodograms(spectrum):
    """Return Y Y^H of spectra (segments, k, l), shape (segments, k, l, l)."""
    return spectrum[..., :, None] * spectrum[..., None, :].conj()
