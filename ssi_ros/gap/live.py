"""
The gap meter on sliding windows: rows in, gap, site, leading effect and alarm out.

Spectra are taken of one hop at a time, and every result is computed from whole hops, so it does
not depend on how the rows arrive. Equations (130) to (136) of docs/theory-live.md.
"""
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.gap.alarm import quiet, step
from ssi_ros.gap.fit import fit
from ssi_ros.gap.likelihood import Evidence
from ssi_ros.gap.live_holes import fill
from ssi_ros.gap.live_model import BLAS, LEAST_MEANS
from ssi_ros.gap.live_score import leading, sight, statistics
from ssi_ros.gap.meter import measure
from ssi_ros.gap.spectra import spectra
from ssi_ros.records import Samples

WILD = 1e9      # m/s^2; no acceleration: it counts as missing


@dataclass(frozen=True)
class GapUpdate:
    """
    The gap of one window.

    Attributes
    ----------
    start_ns, end_ns : int
        Stamp of the first sample, and of the one after the last [ns].
    value, floor, floor_std : float
        Gap, and its mean and standard deviation where the model is right [nats]; NaN without
        usable hops.
    levels : dict of str to float
        Fitted power over nominal of every random part of the excitation and of the sensor noise.
    sites : dict of str to float
        Share of every site: its best squared score over their sum.
    leading, leading_text : str
        Effect of the most improbable statistic of the window, and the template or line.
    leading_z, leading_p : float
        That score, and its chance where the model is right, all of them considered.
    alarm_level : float
        Logarithm of the alarm's sum over its threshold.
    raised_ns : int or None
        When the alarm was raised; it stays until it is acknowledged.
    cause : str
        What weighed most then.
    reason : str
        What limits the result; empty when all is well.

    """

    start_ns: int
    end_ns: int
    value: float = float('nan')
    floor: float = float('nan')
    floor_std: float = float('nan')
    levels: dict = None
    sites: dict = None
    leading: str = ''
    leading_text: str = ''
    leading_z: float = float('nan')
    leading_p: float = 1.0
    alarm_level: float = -np.inf
    raised_ns: int = None
    cause: str = ''
    reason: str = ''

    @property
    def deviations(self):
        """How many standard deviations the gap is above its floor."""
        return (self.value - self.floor) / self.floor_std


@dataclass(frozen=True, eq=False)
class _Hop:
    """One usable hop of the window: its spectrum and its statistics."""

    spectrum: np.ndarray
    statistics: np.ndarray = None


class LiveGap:
    """
    Measure the gap of a stream on sliding windows.

    Parameters
    ----------
    model : LiveModel
        Of `prepare`, for the same settings.
    channels : sequence of str
        Names of the columns; those of the model in any order, others are left out.
    start_ns : int
        Stamp of the first row [ns].
    settings : LiveSettings
        Settings.
    alarm : Alarm, optional
        To go on with, as after a jump of the clock.

    Raises
    ------
    ValueError
        If a channel of the model is not among them.

    """

    def __init__(self, model, channels, start_ns, settings, alarm=None):
        self.model, self.settings, self.start_ns = model, settings, int(start_ns)
        self.columns = order_of(model.simulator.spacecraft, channels)
        self.rate_hz, self.rows = model.frame.rate_hz, model.frame.rows
        hops = int(settings.window_s / settings.hop_s + 1e-9)
        self.window = deque(maxlen=hops)          # None for a hop that was left out
        self.means = deque(maxlen=max(hops, LEAST_MEANS))
        self.waiting = np.empty((0, len(self.columns)))
        self.hop, self.levels = 0, None
        self.alarm = quiet(model.bank) if alarm is None else alarm

    def push(self, values):
        """
        Take rows; return one GapUpdate for every hop that they completed.

        Parameters
        ----------
        values : ndarray, shape (n, channels), [m/s^2]
            NaN where a sample is missing.

        """
        values = np.asarray(values, dtype=float)[:, self.columns]
        self.waiting = np.concatenate([self.waiting, values])
        updates = []
        with BLAS.limit(limits=1):
            while len(self.waiting) >= self.rows:
                rows, self.waiting = self.waiting[:self.rows], self.waiting[self.rows:]
                updates.append(self._take(rows))
        return updates

    def acknowledge(self):
        """Take the alarm back, and watch anew."""
        self.alarm = quiet(self.model.bank)

    @property
    def log_threshold(self):
        """Logarithm of the mean number of hops between false alarms."""
        return float(np.log(self.settings.false_alarm_every_s * self.rate_hz / self.rows))

    def _take(self, rows):
        self.hop += 1
        rows, reasons = self._usable(rows)
        self.window.append(None)
        statistics = None
        if rows is not None:
            samples = Samples(rows, self.rate_hz, [''] * rows.shape[1])
            self.window[-1] = _Hop(spectra(samples, self.model.frame)[0])
        found = self._fit() if self._held() else None
        if found is None:
            reasons.append('no usable hop in the window')
        elif self.window[-1] is not None:
            statistics = self._score(found)
        self.alarm = step(self.alarm, self.model.bank, statistics, self.log_threshold,
                          self._stamp(self.hop))
        return self._update(found, reasons)

    def _usable(self, rows):
        """Return the rows without gaps, or None if too much is missing, and what is wrong."""
        channels, reasons = self.model.simulator.spacecraft.sensors, []
        rows = np.where(np.abs(rows) < WILD, rows, np.nan)
        lost = np.isnan(rows)
        for channel, gone, column in zip(channels, lost.T, rows.T):
            if gone.mean() > self.settings.missing_share:
                reasons.append(f'channel {channel.name} misses {100 * gone.mean():.0f} % of its '
                               'samples')
            elif np.ptp(column[~gone]) == 0.0:
                reasons.append(f'channel {channel.name} is constant')
        share = lost.any(axis=1).mean()
        if share > self.settings.missing_share:
            return None, reasons or [f'{100 * share:.0f} % of the rows are not complete']
        rows = rows - self._offset(rows)
        try:
            return fill(rows, self.model.covariance), reasons
        except ValueError as error:
            return None, reasons + [str(error)]

    def _offset(self, rows):
        """
        Return the constant part of every channel, over the hops of a window.

        The mean of one hop alone holds some of its slowest vibration; without that the lowest
        bins would have less power than expected.
        """
        self.means.append(np.nanmean(rows, axis=0))
        return np.mean(self.means, axis=0)

    def _held(self):
        return [h for h in self.window if h is not None]

    def _fit(self):
        """Fit the levels to the window; return fit and evidence."""
        held = self._held()
        frame = replace(self.model.frame, pieces=len(held))
        evidence = Evidence(frame, np.array([h.spectrum for h in held]), tuple(range(len(held))))
        found = fit(self.model.simulator, evidence, levels=self.levels)
        if found is None and self.levels is not None:        # from a level that no longer holds
            found = fit(self.model.simulator, evidence)
        if found is None:
            return None
        self.levels = found.levels
        return found, evidence

    def _score(self, found):
        """Return the statistics of the newest hop at the fitted levels, and keep them."""
        newest = self.window[-1]
        seen = sight(self.model, found[0].levels)
        found = statistics(self.model, seen, newest.spectrum)
        self.window[-1] = replace(newest, statistics=found)
        return found

    def _update(self, found, reasons):
        model, alarm, hops = self.model, self.alarm, len(self.window)
        if hops < self.window.maxlen:
            reasons.append(f'the window holds {hops * self.settings.hop_s:g} s of '
                           f'{self.window.maxlen * self.settings.hop_s:g} s')
        update = GapUpdate(
            self._stamp(self.hop - hops), self._stamp(self.hop), alarm_level=alarm.level,
            raised_ns=alarm.raised_ns, reason='; '.join(reasons),
            cause=model.cause(alarm.statistic) if alarm.raised_ns is not None else '')
        if found is None:
            return update
        fitted, evidence = found
        gap = measure(fitted.model, evidence, self.settings.band_bins)
        return replace(
            update, value=gap.value, floor=gap.floor, floor_std=gap.floor_std,
            levels=dict(zip(model.expected.names, map(float, fitted.levels))),
            **leading(model, [h.statistics for h in self._held() if h.statistics is not None]))

    def _stamp(self, hop):
        return self.start_ns + round(hop * self.rows * 1e9 / self.rate_hz)


def order_of(spacecraft, channels):
    """Return the column of every sensor of the model, ValueError if one is not there."""
    names, wanted = list(channels), [s.name for s in spacecraft.sensors]
    missing = [n for n in wanted if n not in names]
    if missing:
        raise ValueError(f'the channels are {", ".join(names)}, but the model also has '
                         f'{", ".join(missing)}; name the channels as the model does')
    return [names.index(n) for n in wanted]
