"""From samples to tapered spectra of pieces of the record, eq. (93) of docs/theory-gap.md."""
from dataclasses import dataclass

import numpy as np
from scipy.signal.windows import tukey

TAPER_SHARE = 0.25      # of a piece, on which the taper rises and falls
PRESENT = 0.8           # of the rows of the fullest piece, that a piece must have


@dataclass(frozen=True, eq=False)
class Frame:
    """
    How a record is cut and tapered: all that the expected spectrum needs to know of it.

    Attributes
    ----------
    rate_hz : float
        Rate of the stamps [Hz].
    rows, pieces : int
        Samples a piece, and pieces, which follow each other without overlap.
    first, last : int
        Bins used: first, ..., last - 1 of the DFT of one piece.
    taper : ndarray, shape (rows,)
        Weights w, of sum w^2 = 1.
    overlap : ndarray, shape (rows,)
        Mean over the pieces of sum_n w_n w_(n+lag) at every lag, missing rows counted as zero.
    used : tuple of int
        Pieces that are there; of the others too many rows are missing.
    crowding : float
        How much neighbouring bins repeat each other, rows sum w^4 >= 1; the information in all
        bins is smaller than their number by this factor.

    """

    rate_hz: float
    rows: int
    pieces: int
    first: int
    last: int
    taper: np.ndarray
    overlap: np.ndarray
    crowding: float
    used: tuple = ()

    def crowding_of(self, bins):
        """Return the crowding of so many neighbouring bins, whose ends have fewer neighbours."""
        steps = np.arange(1, bins)
        alike = np.abs(np.fft.fft(self.taper ** 2)[steps]) ** 2
        return 1.0 + 2.0 * float(np.sum((1 - steps / bins) * alike))

    @property
    def frequencies_hz(self):
        """Frequency of every bin used, shape (k,), [Hz]."""
        return np.arange(self.first, self.last) * self.rate_hz / self.rows


def make_frame(rows_total, rate_hz, settings, present=None):
    """
    Choose the pieces of a record.

    Parameters
    ----------
    rows_total : int
        Samples of the record.
    rate_hz : float
        Their rate [Hz].
    settings : DiagnosisSettings
        Length of a piece and band used.
    present : ndarray of bool, shape (rows_total,), optional
        Which rows are there.

    Returns
    -------
    Frame

    Raises
    ------
    ValueError
        If the record is too short, with the length that it needs.

    """
    duration_s = rows_total / rate_hz
    rows = int(min(settings.segment_s, duration_s / settings.least_segments) * rate_hz)
    first = max(1, int(np.ceil(settings.low_hz * rows / rate_hz)))
    last = int(settings.high_share * rows / 2)
    if last - first < 4 * settings.band_bins:
        need = settings.least_segments * 8 * settings.band_bins / rate_hz
        raise ValueError(f'the record has {duration_s:g} s; {need:g} s are needed for '
                         f'{settings.least_segments} pieces with enough frequency bins')
    pieces = rows_total // rows
    taper = tukey(rows + 2, TAPER_SHARE)[1:-1]
    taper = taper / np.sqrt(np.sum(taper ** 2))
    there = np.ones((pieces, rows)) if present is None else (
        present[:pieces * rows].reshape(pieces, rows))
    # a long gap takes its pieces out; rows lost at random thin out all of them alike
    share = there.mean(axis=1)
    used = np.flatnonzero(share >= PRESENT * share.max())
    if len(used) < settings.least_segments / 2:
        raise ValueError(f'the record has gaps: {len(used)} of its {pieces} pieces of '
                         f'{rows / rate_hz:g} s are there, and {settings.least_segments // 2} are '
                         'needed; give a longer record, or a shorter segment_s')
    padded = np.fft.rfft(taper * there[used], 2 * rows, axis=1)
    overlap = np.fft.irfft(np.mean(np.abs(padded) ** 2, axis=0))[:rows]
    return Frame(rate_hz, rows, pieces, first, last, taper, overlap,
                 rows * float(np.sum(taper ** 4)), tuple(used.tolist()))


def whole_frame(rows, rate_hz, settings, edge_s, present):
    """
    Return the frame of a record in one piece, tapered over `edge_s` at both ends.

    Its bins are as close as the record allows, which lines need.
    """
    share = min(1.0, 2 * edge_s * rate_hz / rows)
    taper = tukey(rows + 2, share)[1:-1]
    taper = taper / np.sqrt(np.sum(taper ** 2))
    padded = np.fft.rfft(taper * present, 2 * rows)
    overlap = np.fft.irfft(np.abs(padded) ** 2)[:rows]
    first = max(1, int(np.ceil(settings.low_hz * rows / rate_hz)))
    return Frame(rate_hz, rows, 1, first, int(settings.high_share * rows / 2), taper, overlap,
                 rows * float(np.sum(taper ** 4)))


def spectra(samples, frame):
    """
    Return the tapered DFT of every piece, shape (pieces, k, l); missing rows count as zero.

    Parameters
    ----------
    samples : Samples
        The record; a row with a NaN in any channel counts as missing.
    frame : Frame
        How to cut it.

    """
    values = samples.values[:frame.pieces * frame.rows]
    values = np.where(np.isnan(values).any(axis=1)[:, None], 0.0, values)
    pieces = values.reshape(frame.pieces, frame.rows, -1) * frame.taper[None, :, None]
    return np.fft.rfft(pieces, axis=1)[:, frame.first:frame.last]


def periodograms(spectrum):
    """Return Y Y^H of spectra (pieces, k, l), shape (pieces, k, l, l)."""
    return spectrum[..., :, None] * spectrum[..., None, :].conj()
