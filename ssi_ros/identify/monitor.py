"""
The sliding window: rows in, modes out.

Every result is computed from whole hops, so it does not depend on how the rows arrive.
"""
from dataclasses import replace
import math

import numpy as np

from ssi_ros.identify.bands import plan_bands, Thinner
from ssi_ros.identify.excitation import (
    effective_share, part_powers, remember, unevenness, why_lost)
from ssi_ros.identify.families import judge_families
from ssi_ros.identify.harmonics import label, look
from ssi_ros.identify.lags import BLOCKS, Ring
from ssi_ros.identify.methods import Method, realise
from ssi_ros.identify.missing import Gaps
from ssi_ros.identify.modes import band_modes
from ssi_ros.identify.picks import one_of_each_pick
from ssi_ros.identify.settings import Identification
from ssi_ros.identify.shapes import mac
from ssi_ros.identify.traced import TracedWindow
from ssi_ros.identify.track import told, track, Tracks
from ssi_ros.identify.usable import usable
from ssi_ros.identify.window import Window
from ssi_ros.records import Mode, Pole, WindowModes
from threadpoolctl import ThreadpoolController

BLAS = ThreadpoolController()     # more threads only slow these small matrices down
CHANNELS_MAX = 64
WILD = 1e100            # no acceleration: its square would overflow
SIZE = 120              # side l i of the covariance matrix that automatic block rows aim at


def block_rows_for(channels, settings):
    """Return the block rows i: the setting, or one that suits the number of channels."""
    return settings.block_rows or int(np.clip(round(SIZE / channels), 8, 60))


def never(rows):
    """Return that no window is late."""
    return False


class Monitor:
    """
    Identify the modes of a stream on sliding windows.

    Parameters
    ----------
    channels : sequence of str
        Names, 1 to 64.
    rate_hz : float
        Rate of the rows [Hz].
    start_ns : int
        Stamp of the first row [ns].
    settings : Identification
        Settings.
    method : Method
        SSI-COV, or another with its recorded inputs.

    Raises
    ------
    ValueError
        For settings that the rate or the channels cannot serve.

    """

    def __init__(self, channels, rate_hz, start_ns=0, settings=Identification(),
                 method=Method()):
        self.channels, self.rate_hz = tuple(channels), float(rate_hz)
        self.start_ns, self.settings, self.method = int(start_ns), settings, method
        if not 1 <= len(self.channels) <= CHANNELS_MAX:
            raise ValueError(f'{len(self.channels)} channels given; 1 to {CHANNELS_MAX} can be '
                             'identified together')
        if not (np.isfinite(self.rate_hz) and self.rate_hz > 0.0):
            raise ValueError(f'rate_hz={rate_hz} must be a positive number [Hz]')
        rate = self.rate_hz / settings.decimation
        if settings.hop_s * rate < 1.0:
            raise ValueError(f'hop_s={settings.hop_s:g} holds less than one sample at '
                             f'{rate:g} Hz; at least {1.0 / rate:g} is needed')
        self.rows = block_rows_for(len(self.channels), settings)
        needed = 4 * self.rows
        if settings.window_s * rate < needed:
            raise ValueError(
                f'window_s={settings.window_s:g} holds {settings.window_s * rate:.0f} '
                f'samples at {rate:g} Hz; block_rows={self.rows} needs {needed} or more: '
                'lengthen window_s or lower block_rows')
        self.bands = plan_bands(self.rate_hz, settings.window_s, settings.cycles_min,
                                settings.bands, settings.decimation)
        width = len(self.channels) + len(method.inputs)
        # spreads need data blocks: where hops are too few, each is booked in several pieces
        self.pieces = int(np.clip(-(-BLOCKS // settings.hops), 1, max(1.0, settings.hop_s * rate)))
        count = settings.hops * self.pieces
        self.thinners = [Thinner(b.factor, width) if b.factor > 1 else None for b in self.bands]
        self.rings = [Ring(count, 2 * self.rows - 1, len(self.channels)) for _ in self.bands]
        self.kept = [Window(count, len(self.channels)) for _ in self.bands]
        self.driven = [Window(count, len(method.inputs)) for _ in self.bands]
        self.waiting = np.empty((0, width))
        self.offset, self.wild, self.gaps = None, 0, Gaps(count)
        self.taken = 0                     # whole pieces taken in
        self.tracks, self.heard = Tracks(), {}

    def push(self, values, late=never):
        """
        Take rows; return the results of the hops that they completed.

        Parameters
        ----------
        values : ndarray, shape (n, l), [m/s^2]
            NaN where a sample is missing. Columns of the method's inputs follow.
        late : callable
            Asked at the end of a hop with the number of rows that wait behind it; where it says
            True, the samples are taken in and the window is not identified.

        Returns
        -------
        list of WindowModes
            One for every hop that ended and was not late, once the first window is full.

        """
        values = np.asarray(values, dtype=float)
        width = self.waiting.shape[1]
        if values.ndim != 2 or values.shape[1] != width:
            raise ValueError(f'rows of shape {values.shape} given; (n, {width}) is '
                             'needed, one column a channel')
        self.waiting = np.concatenate([self.waiting, values])
        results = []
        with BLAS.limit(limits=1):
            while len(self.waiting) >= (
                    size := self._row(self.taken + 1) - self._row(self.taken)):
                rows, self.waiting = self.waiting[:size].copy(), self.waiting[size:]
                self._take(rows)
                if self.rings[0].full and self.taken % self.pieces == 0 and not late(
                        len(self.waiting)):
                    results.append(self._identify())
        return results

    def identify_now(self):
        """Return the modes of the whole hops that the window holds now."""
        with BLAS.limit(limits=1):
            return self._identify(keep=False)

    def too_short(self):
        """Return a window without modes that says how much longer the record must be."""
        rows = self._row(self.taken) + len(self.waiting)
        reason = (f'the record holds {rows / self.rate_hz:g} s; the window needs '
                  f'{self.settings.window_s:g} s: shorten window_s or record longer')
        end_ns = self.start_ns + round(rows * 1e9 / self.rate_hz)
        return WindowModes(self.start_ns, end_ns, (), reason)

    def _row(self, piece):
        """Return the number of rows before a piece of a hop."""
        return round(piece / self.pieces * self.settings.hop_s * self.rate_hz)

    def _stamp(self, piece):
        return self.start_ns + round(self._row(piece) * 1e9 / self.rate_hz)

    def _take(self, rows):
        """Book one piece of rows in every band."""
        usable = np.abs(rows) < WILD           # a NaN is not
        self.wild += int(np.count_nonzero(~usable & ~np.isnan(rows)))
        rows = np.where(usable, rows, np.nan)
        self.gaps.push(~usable[:, :len(self.channels)])
        if self.offset is None:
            # a large constant would cost digits; a median, or one wild sample of the beginning
            # would stay in every later row
            self.offset = np.zeros(rows.shape[1])
            there = ~np.isnan(rows).all(axis=0)
            self.offset[there] = np.nanmedian(rows[:, there], axis=0)
        rows = rows - self.offset
        own = len(self.channels)
        for thinner, ring, kept, driven in zip(self.thinners, self.rings, self.kept, self.driven):
            if thinner is not None:
                rows = thinner.push(rows)
            ring.push(rows[:, :own])
            kept.push(rows[:, :own])
            driven.push(rows[:, own:])
        self.taken += 1

    def _identify(self, keep=True):
        """Identify the window that ends with the newest piece."""
        filled, piece_s = self.rings[0].filled, self.settings.hop_s / self.pieces
        held_s = filled * piece_s
        start_ns, end_ns = self._stamp(self.taken - filled), self._stamp(self.taken)
        if filled < self.pieces:
            return WindowModes(start_ns, end_ns, (), f'no whole hop of {self.settings.hop_s:g} s '
                               'has arrived yet')
        reason = ''
        if not self.rings[0].full:
            reason = (f'the window holds {held_s:g} s of {self.settings.window_s:g} s')
        first = self.rings[0].covariances(piece_s)
        live, hops, why = usable(self.rings[0], first, self.offset[:len(self.channels)],
                                 self.channels, self._row(filled) / self.settings.decimation)
        wild = (f'{self.wild} samples beyond {WILD:g} were treated as missing' if self.wild
                else '')
        reason = '; '.join(filter(None, (
            reason, self.gaps.words(self.channels, self.rate_hz), why, wild)))
        powers = [part_powers(kept.powers, len(self.channels)) for kept in self.kept]
        uneven = unevenness(powers[0]) if live.any() else ''
        held = effective_share(self.kept[0].powers) if uneven else 1.0
        candidates, rejected, traces = [], [], []
        for number, (band, ring) in enumerate(zip(self.bands, self.rings)):
            if not live.any():
                break
            try:
                whole = number == 0 and hops is None
                covariances = (first if whole else ring.covariances(piece_s, hops)).of(live)
                covariances = replace(covariances, counts=held * covariances.counts)
                kept, driven = self.kept[number].rows, self.driven[number].rows
                realised = realise(
                    self.method, covariances, kept if live.all() else kept[:, live], driven,
                    self.rows, self.settings)
                found, left, trace = band_modes(*realised, covariances, band, number, self.rows,
                                                self.settings, self.method.picks)
            except (np.linalg.LinAlgError, ValueError) as error:
                reason = '; '.join(filter(None, (reason, f'band of {band.rate_hz:g} Hz: {error}')))
                continue
            candidates += [spread_shape(c, live) for c in found]
            rejected += left
            traces.append(trace)
        if not candidates and not reason:
            reason = 'no mode stands above the noise of the window'
        picks = self.method.picks
        kept, double = one_of_each_pick(candidates, picks) if picks else one_of_each(candidates)
        rejected += double
        modes = self._labelled(kept, held_s)
        tracks, modes, births, deaths = track(self.tracks, modes)
        missing = [t.mode for t in tracks.alive if t.missed]
        lost = why_lost(self.heard, missing, powers, self.bands)
        reason = '; '.join(filter(None, (reason, told(tracks), lost, uneven)))
        if keep:
            self.tracks = tracks
            alive = {t.mode.identity for t in tracks.alive}
            heard = remember(self.heard, modes, powers, self.bands)
            self.heard = {k: v for k, v in heard.items() if k in alive}
        return TracedWindow(start_ns, end_ns, modes, reason, tuple(rejected), births, deaths,
                            tuple(traces), tracks.splits, tracks.merges)

    def _labelled(self, candidates, held_s):
        """Turn candidates into modes, each judged as a mode or a line."""
        judged = []
        for number, (band, kept) in enumerate(zip(self.bands, self.kept)):
            own = [c for c in candidates if c.band == number]
            if not own:
                continue
            peaks = look(kept.rows, band.rate_hz, [c.frequency_hz for c in own])
            for c, *seen in zip(own, peaks.sharpness, peaks.comb, peaks.change):
                judged.append((c, seen[0], *label(c, seen[0], held_s, *seen[1:],
                                                  self.method.name == 'era')))
        words = judge_families(judged, held_s, 0.5 * self.rate_hz)
        return tuple(Mode(c.frequency_hz, c.damping_ratio, c.shape, c.frequency_std_hz,
                          c.damping_ratio_std, c.shape_std, label=word, note=note)
                     for (c, *_), (word, note) in zip(judged, words))


def spread_shape(candidate, live):
    """Return a candidate whose shape covers all channels, 0 where one was left out."""
    if live.all():
        return candidate
    shape, std = np.zeros(len(live), dtype=complex), np.full(len(live), np.nan)
    shape[live], std[live] = candidate.shape, candidate.shape_std
    return replace(candidate, shape=shape, shape_std=std)


def one_of_each(candidates):
    """
    Resolve the overlap of the bands: of two candidates of one mode the sharper one stays.

    Returns
    -------
    kept : list of Candidate
    double : list of Pole

    """
    kept, double = [], []
    for c in sorted(candidates, key=lambda c: c.frequency_std_hz / c.frequency_hz):
        same = next((k for k in kept if k.band != c.band and _alike(k, c)), None)
        if same is None:
            kept.append(c)
        else:
            double.append(Pole(c.frequency_hz, c.damping_ratio, 0,
                               f'the band that found {same.frequency_hz:.4g} Hz is sharper'))
    return kept, double


def _alike(a, b):
    """Tell whether two candidates of different bands are one mode."""
    spread = math.hypot(a.frequency_std_hz, b.frequency_std_hz)
    gate = max(0.0 if math.isnan(spread) else 5.0 * spread, 0.002 * b.frequency_hz)
    return (abs(a.frequency_hz - b.frequency_hz) < gate
            and mac(a.shape[None], b.shape[None])[0, 0] > 0.7)


def identify(samples, settings=Identification(), progress=None, method=Method()):
    """
    Identify the modes of a whole record on sliding windows.

    Parameters
    ----------
    samples : Samples
        The record.
    settings : Identification
        Settings.
    progress : callable, optional
        Called with (hops done, hops in all).
    method : Method
        SSI-COV, or another; its inputs are the last channels of the record.

    Returns
    -------
    tuple of WindowModes
        One a hop; for a record shorter than the window one that says what is missing.

    """
    channels = samples.channels[:len(samples.channels) - len(method.inputs)]
    monitor = Monitor(channels, samples.rate_hz, samples.start_ns, settings, method)
    total = int(samples.duration_s / settings.hop_s + 1e-9)
    windows, step = [], settings.hop_s * samples.rate_hz
    for hop in range(total):
        windows += monitor.push(samples.values[round(hop * step):round((hop + 1) * step)])
        if progress is not None:
            progress(hop + 1, total)
    windows += monitor.push(samples.values[round(total * step):])     # part of a hop
    if not windows:
        windows.append(monitor.too_short())
    return tuple(windows)
