"""From two recordings to spectral matrices of bands, one a group of segments, eq. (140)."""
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.signal.windows import tukey

SEGMENT_S = 60.0        # longest segment
FEW_ROWS = 4096         # but never less than so many: a recorder's rate goes with its structure
SEGMENT_ROWS = 16384    # of a segment at most: resolution beyond it costs time and tells little
SEGMENTS = 8            # that the shorter recording is cut into at least, without overlap
GROUPS = 24             # groups of neighbouring segments at most
BAND_BINS = 4           # bins of a band at least
BANDS = 1500            # at most
TAPER_SHARE = 0.4       # of a segment, on which the taper rises and falls
SILENT = 1e-3           # of the power of a channel
ROUND_OFF = 1e-10       # of the power of a channel in a band, and
LEAST_POWER = 1e-14     # of its mean power: what is below is arithmetic, not motion
HIGH_SHARE = 0.98       # of half of the rate


@dataclass(frozen=True, eq=False)
class Cut:
    """
    How both recordings are cut: segments of `rows`, side by side, tapered.

    Attributes
    ----------
    rate_hz : float
        Rate [Hz].
    rows : int
        Rows a segment.
    first, band_bins : int
        First bin, bins of a band.
    chosen : tuple of int
        Numbers of the bands that count, from 0.
    together : int
        Segments that make one period of a recording that repeats itself: they stay together.

    """

    rate_hz: float
    rows: int
    first: int
    band_bins: int
    chosen: tuple
    together: int = 1

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
        taper = tukey(self.rows, TAPER_SHARE, sym=False)
        return taper / np.sqrt(np.sum(taper ** 2) * self.rate_hz)

    def freedom(self, segments):
        """Return how many independent spectra the mean of a band stands for."""
        steps = np.arange(1, self.band_bins)
        alike = np.abs(np.fft.fft(self.taper ** 2 * self.rate_hz)[steps]) ** 2
        return segments * self.band_bins / (1 + 2 * np.sum((1 - steps / self.band_bins) * alike))


@dataclass(frozen=True, eq=False)
class Spectra:
    """
    Spectral matrices of the groups of one recording, shape (g, b, l, l) [unit^2 / Hz].

    `weights` are the segments of each group, `times_s` their middles.
    """

    cut: Cut
    groups: np.ndarray
    weights: np.ndarray
    times_s: np.ndarray

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
        """Return the spectra with the level of each group taken out, shape (g,)."""
        return replace(self, groups=self.groups / np.reshape(levels, (-1, 1, 1, 1)))

    def without(self, crossed):
        """Return the spectra with some cells, (g, b), as their band is in the other groups."""
        clear = ~crossed * self.weights[:, None]
        usual = np.einsum('gb,gbij->bij', clear / clear.sum(axis=0), self.groups)
        return replace(self, groups=np.where(crossed[..., None, None], usual, self.groups))

    def padded(self, share):
        """Return the spectra with a share of each channel's own mean power added to it."""
        power = np.einsum('bii->bi', self.mean).real * share
        padding = power[:, :, None] * np.eye(power.shape[1])
        return replace(self, groups=self.groups + padding)

    def __len__(self):
        return len(self.groups)


def plan(rows, rate_hz, channels, period=None):
    """
    Choose the segments and bands that suit two recordings.

    Parameters
    ----------
    rows : int
        Of the shorter recording.
    rate_hz : float
        Rate [Hz].
    channels : int
        Channels l.
    period : int, optional
        Rows after which the reference repeats itself: whole periods have no scatter.

    Returns
    -------
    Cut

    Raises
    ------
    ValueError
        If it is too short, with the length needed.

    """
    longest = min(max(SEGMENT_S * rate_hz, FEW_ROWS), SEGMENT_ROWS)
    together = 1
    if period is not None and rows >= period:
        together = int(np.ceil(max(period / longest, SEGMENTS / (rows // period))))
        longest = period / together
        rows = rows // period * period
    size = int(min(rows / SEGMENTS, longest)) // 2 * 2
    first = 2                           # below it the taper sees the offset
    usable = int(HIGH_SHARE * size / 2) - first
    segments = rows // max(size, 1)
    # a mean of fewer than twice as many spectra as channels has no sound determinant
    bins = max(BAND_BINS, -(-usable // BANDS))
    while size > 4 * bins and (Cut(rate_hz, size, first, bins, (0,)).freedom(segments)
                               < 2 * channels + 4):
        bins += 1
    if usable < 8 * bins:
        need = SEGMENTS * 2 * (8 * bins + 4) / rate_hz
        raise ValueError(f'the shorter recording has {rows / rate_hz:g} s; about {need:.3g} s '
                         f'are needed to compare {channels} channels at {rate_hz:g} Hz')
    return Cut(rate_hz, size, first, bins, tuple(range(usable // bins)), together)


def spectra_of(values, cut):
    """
    Return the spectra of a recording, shape (n, l), eq. (140).

    The segments share no sample and are gathered in at most GROUPS groups of neighbours, whose
    scatter tells how sure their mean is, whatever the excitation.
    """
    periods = len(values) // (cut.rows * cut.together)
    parts = [np.arange(p[0] * cut.together, (p[-1] + 1) * cut.together)
             for p in np.array_split(np.arange(periods), min(GROUPS, periods))]
    width = values.shape[1]
    groups = np.zeros((len(parts), cut.bands, width, width), complex)
    chosen = np.array(cut.chosen)
    last = cut.first + (chosen[-1] + 1) * cut.band_bins
    for group, part in zip(groups, parts):
        for s in part:
            segment = values[s * cut.rows:(s + 1) * cut.rows] * cut.taper[:, None]
            y = np.fft.rfft(segment, axis=0)[cut.first:last]
            y = y.reshape(-1, cut.band_bins, width)[chosen]
            group += y.swapaxes(1, 2) @ y.conj()
        group /= len(part) * cut.band_bins / 2
    # channels that are copies of each other, or still in a band, shall have a determinant
    power = np.einsum('gbii->gbi', groups).real
    least = ROUND_OFF * power + LEAST_POWER * power.mean(axis=1, keepdims=True)
    groups += least[..., None] * np.eye(width)
    weights = np.array([len(p) for p in parts], float)
    middles = np.array([p.mean() + 0.5 for p in parts]) * cut.rows / cut.rate_hz
    return Spectra(cut, groups, weights, middles)


def silent(power):
    """
    Return the weakest bands that together have less than SILENT of a power, shape (b,), (144).

    What is in them is noise, which does not grow with the level.
    """
    order = np.argsort(power)
    quiet = np.zeros(len(power), bool)
    quiet[order] = np.cumsum(power[order]) < SILENT * power.sum()
    return quiet


def silent_in_all(*means):
    """Return the bands that are silent in every channel of some mean spectra, shape (b,)."""
    powers = [p for m in means for p in np.einsum('bii->ib', m).real]
    return np.all([silent(p) for p in powers], axis=0)
