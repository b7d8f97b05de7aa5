"""From two recordings to spectral matrices of bands, one a group of segments, eq. (140)."""
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ssi_ros.gap.spectra.thresholds import LIMITS
from ssi_ros.windows import tapered_dft, unit_taper, variance_inflation

SEGMENT_S = 60.0        # longest segment
FEW_ROWS = 4096         # but at least so many: a recorder's rate goes with its structure
SEGMENT_ROWS = 16384    # of a segment at most: more resolution costs time and gains little
SEGMENTS = 8            # that the shorter recording is cut into at least, without overlap
GROUPS = 24             # groups of neighbouring segments at most
BAND_BINS = 4           # bins of a band at least
BANDS = 1500            # at most
TAPER_SHARE = 0.4       # of a segment, on which the taper rises and falls
ROUND_OFF = 1e-10       # of the power of a channel in a band, and
LEAST_POWER = 1e-14     # of its mean power: rounding, not motion
HIGH_SHARE = 0.98       # of half of the rate
MEDIAN = np.pi / 2      # variance of a median over that of a mean


@dataclass(frozen=True, eq=False)
class Cut:
    """How both recordings are cut: segments of `rows`, side by side, tapered."""

    rate_hz: float      # [Hz]
    rows: int           # of a segment
    first: int          # bin
    band_bins: int      # bins of a band
    chosen: tuple       # numbers of the bands that count, from 0
    together: int = 1   # segments in one period of a periodic recording: they stay together

    @property
    def bands(self):
        """Return the number of bands b."""
        return len(self.chosen)

    @property
    def resolution_hz(self):
        """Distance of two bins [Hz]."""
        return self.rate_hz / self.rows

    @property
    def width_hz(self):
        """Width of a band [Hz]."""
        return self.band_bins * self.resolution_hz

    @cached_property
    def middles_hz(self):
        """Middle of each band, shape (b,), [Hz]."""
        starts = self.first - 0.5 + self.band_bins * np.array(self.chosen)
        return starts * self.resolution_hz + self.width_hz / 2

    @property
    def ends_hz(self):
        """Lowest and highest frequency that any band holds [Hz]."""
        return (self.middles_hz[0] - self.width_hz / 2, self.middles_hz[-1] + self.width_hz / 2)

    @cached_property
    def taper(self):
        """Weights of the rows of a segment; a sine of variance 1/2 a bin has density 1/2."""
        return unit_taper(self.rows, TAPER_SHARE, periodic=True) / np.sqrt(self.rate_hz)

    def freedom(self, segments):
        """Return how many independent spectra the mean of a band stands for."""
        return segments * self.band_bins / variance_inflation(
            self.taper * np.sqrt(self.rate_hz), self.band_bins)


@dataclass(frozen=True, eq=False)
class Spectra:
    """Spectral matrices of the groups of one recording."""

    cut: Cut
    groups: np.ndarray      # (g, b, l, l) [unit^2 / Hz]
    weights: np.ndarray     # (g,), segments of each group
    times_s: np.ndarray     # (g,), their middles

    @property
    def freedom(self):
        """Independent spectra behind the mean."""
        return self.cut.freedom(self.weights.sum())

    @property
    def mean(self):
        """Mean over the groups, shape (b, l, l)."""
        return np.tensordot(self.weights / self.weights.sum(), self.groups, 1)

    def only(self, which):
        """Return some of the groups."""
        which = np.asarray(which)
        return replace(self, groups=self.groups[which], weights=self.weights[which],
                       times_s=self.times_s[which])

    def in_bands(self, kept):
        """Return some of the bands, by an array of bool of shape (b,)."""
        cut = replace(self.cut, chosen=tuple(np.array(self.cut.chosen)[kept]))
        return replace(self, cut=cut, groups=self.groups[:, kept])

    def levelled(self, levels):
        """Return the spectra divided by the level of each group, shape (g,)."""
        return replace(self, groups=self.groups / np.reshape(levels, (-1, 1, 1, 1)))

    def without(self, masked):
        """Return the spectra with masked cells, (g, b), replaced by the mean of their band."""
        clear = ~masked * self.weights[:, None]
        usual = np.einsum('gb,gbij->bij', clear / clear.sum(axis=0), self.groups)
        return replace(self, groups=np.where(masked[..., None, None], usual, self.groups))

    def __len__(self):
        return len(self.groups)


def plan(rows, rate_hz, channels, period=None):
    """
    Choose the Cut, segments and bands, that suits two recordings, the shorter of so many rows.

    `period` is that of the reference in rows: whole periods have no scatter. ValueError if it is
    too short, with the length needed.
    """
    longest = min(max(SEGMENT_S * rate_hz, FEW_ROWS), SEGMENT_ROWS)
    together = 1
    if period is not None and rows >= period:
        together = int(np.ceil(max(period / longest, SEGMENTS / (rows // period))))
        longest = period / together
        rows = rows // period * period
    size = int(min(rows / SEGMENTS, longest)) // 2 * 2
    first = 2                           # below it the taper leaks the offset
    usable = int(HIGH_SHARE * size / 2) - first
    segments = rows // max(size, 1)
    # a mean of fewer than twice as many spectra as channels is nearly singular
    bins = max(BAND_BINS, -(-usable // BANDS))
    while size > 4 * bins and (Cut(rate_hz, size, first, bins, (0,)).freedom(segments)
                               < 2 * channels + 4):
        bins += 1
    if usable < 8 * bins:
        need = SEGMENTS * 2 * (8 * bins + 4) / rate_hz
        raise ValueError(f'the shorter recording has {rows / rate_hz:g} s; about {need:.3g} s '
                         f'are needed to compare {channels} channels at {rate_hz:g} Hz')
    return Cut(rate_hz, size, first, bins, tuple(range(usable // bins)), together)


def spectra_of(values, cut, filled=None):
    """
    Return the spectra of a recording, shape (n, l), eq. (140).

    Rows that were `filled`, (n,) of bool, do not count: a segment weighs as much as it has others,
    and none without half of them. ValueError if too little remains.
    """
    # The segments share no sample and are gathered in at most GROUPS groups of neighbours, whose
    # scatter gives the variance of their mean, whatever the excitation.
    periods = len(values) // (cut.rows * cut.together)
    used, width = periods * cut.together, values.shape[1]
    share = np.ones(used) if filled is None else 1 - filled[:used * cut.rows].reshape(
        used, cut.rows).mean(axis=1)
    whole = np.flatnonzero(share.reshape(periods, -1).min(axis=1) >= LIMITS.present.value)
    if cut.freedom(share.reshape(periods, -1)[whole].sum()) < 2 * width + 4:
        raise ValueError(f'{len(whole)} of {periods} segments of {cut.rows / cut.rate_hz:g} s '
                         'hold enough samples between the gaps; a longer record is needed')
    parts = [(p[:, None] * cut.together + np.arange(cut.together)).ravel()
             for p in np.array_split(whole, min(GROUPS, len(whole)))]
    groups = np.zeros((len(parts), cut.bands, width, width), complex)
    chosen = np.array(cut.chosen)
    last = cut.first + (chosen[-1] + 1) * cut.band_bins
    for group, part in zip(groups, parts):
        for s in part:
            segment = values[s * cut.rows:(s + 1) * cut.rows]
            y = tapered_dft(segment, cut.taper, (0,))[0, cut.first:last]
            y = y.reshape(-1, cut.band_bins, width)[chosen]
            group += share[s] * y.swapaxes(1, 2) @ y.conj()
        group /= share[part].sum() * cut.band_bins / 2
    # channels that are copies of each other, or silent in a band, must not be singular
    power = np.einsum('gbii->gbi', groups).real
    least = ROUND_OFF * power + LEAST_POWER * power.mean(axis=1, keepdims=True)
    groups += least[..., None] * np.eye(width)
    weights = np.array([share[p].sum() for p in parts])
    middles = np.array([p.mean() + 0.5 for p in parts]) * cut.rows / cut.rate_hz
    return Spectra(cut, groups, weights, middles)


def silent(power):
    """Return the weakest bands, (b,), with a small share of a power: noise at any level, (144)."""
    order = np.argsort(power)
    quiet = np.zeros(len(power), bool)
    quiet[order] = np.cumsum(power[order]) < LIMITS.silent.value * power.sum()
    return quiet


def level_of(one, two, n_one=np.inf, n_two=np.inf):
    """
    Return the logarithm of the level of one mean spectrum over another, and its deviation.

    A median over the bands that are not silent, equally weighted: where few modes hold all of the
    power, a mean by power would scatter as those few bands do. `one` and `two`, (b, l, l), are of
    reference and record, `n_one` and `n_two` the independent spectra behind each band of them.
    """
    levels, counts = [], []
    for before, after in zip(*(np.einsum('bii->ib', s).real for s in (one, two))):
        loud = ~(silent(before) | silent(after))
        loud = loud if loud.any() else ~silent(before)
        levels.append(np.median(np.log(after[loud] / before[loud])))
        counts.append(np.count_nonzero(loud))
    std = np.sqrt((1 / n_one + 1 / n_two) * MEDIAN / np.median(counts))
    # robust against a channel with another gain
    return float(np.median(levels)), float(std)
