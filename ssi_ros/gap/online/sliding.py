"""
The gap meter on sliding windows: rows in, gap, site, leading effect and alarm out.

Spectra are taken of one hop at a time, and every result is computed from whole hops, so it does
not depend on how the rows arrive. Equations (130) to (136) of docs/theory-live.md.
"""
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.gap.inference.goodness_of_fit import measure
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.whittle import BLAS, Evidence
from ssi_ros.gap.online.calibration import LEAST_MEANS
from ssi_ros.gap.online.e_detector import quiet, step
from ssi_ros.gap.online.imputation import fill
from ssi_ros.gap.online.thresholds import LIMITS
from ssi_ros.gap.online.window_statistics import leading, project, statistics
from ssi_ros.gap.spectra.segmentation import spectra
from ssi_ros.records import Samples


@dataclass(frozen=True)
class GapUpdate:
    """The gap of one window."""

    start_ns: int                       # stamp of the first sample [ns]
    end_ns: int                         # stamp of the one after the last [ns]
    value: float = float('nan')         # gap [nats]; NaN without usable hops
    floor: float = float('nan')         # its mean where the model is right [nats]
    floor_std: float = float('nan')     # its standard deviation there [nats]
    levels: dict = None                 # {name: power over nominal} of random excitation and noise
    sites: dict = None                  # {site: share}, its best squared score over their sum
    leading: str = ''                   # effect of the most improbable statistic of the window
    leading_text: str = ''              # its template or line
    leading_z: float = float('nan')     # that score
    leading_p: float = 1.0              # its chance where the model is right, all considered
    alarm_level: float = -np.inf        # logarithm of the alarm's sum over its threshold
    raised_ns: int = None               # of the alarm; stays until it is acknowledged
    cause: str = ''                     # the statistic with the largest part of it then
    reason: str = ''                    # what limits the result; empty when all is well
    measured: bool = True               # whether the alarm has seen the newest hop

    @property
    def deviations(self):
        """How many standard deviations the gap is above its floor."""
        return (self.value - self.floor) / self.floor_std


class LiveGap:
    """
    Measure the gap of a stream on sliding windows.

    `model` is a LiveModel of `prepare` for the same settings; `channels` name the columns, those
    of the model in any order, others are left out; `start_ns` is the stamp of the first row [ns];
    `alarm` an Alarm to go on with, as after a jump of the clock. ValueError if a channel of the
    model is not among them.
    """

    def __init__(self, model, channels, start_ns, settings, alarm=None):
        self.model, self.settings, self.start_ns = model, settings, int(start_ns)
        self.columns = order_of(model.simulator.spacecraft, channels)
        self.rate_hz, self.rows = model.frame.rate_hz, model.frame.rows
        hops = int(settings.window_s / settings.hop_s + 1e-9)
        # of each hop its spectrum and its statistics, None where it was not used
        self.window, self.scores = deque(maxlen=hops), deque(maxlen=hops)
        self.means = deque(maxlen=max(hops, LEAST_MEANS))
        self.waiting = np.empty((0, len(self.columns)))
        self.hop, self.levels = 0, None
        self.alarm = quiet(model.bank) if alarm is None else alarm

    @BLAS.wrap(limits=1)
    def push(self, values):
        """Take rows (n, channels) [m/s^2], NaN where missing; return a GapUpdate of each hop."""
        values = np.asarray(values, dtype=float)[:, self.columns]
        self.waiting = np.concatenate([self.waiting, values])
        updates = []
        while len(self.waiting) >= self.rows:
            rows, self.waiting = self.waiting[:self.rows], self.waiting[self.rows:]
            updates.append(self._take(rows))
        return updates

    def acknowledge(self):
        """Take the alarm back, and watch anew."""
        self.alarm = quiet(self.model.bank)

    def _take(self, rows):
        self.hop += 1
        rows, reasons = self._usable(rows)
        self.window.append(None if rows is None else spectra(
            Samples(rows, self.rate_hz, [''] * rows.shape[1]), self.model.frame)[0])
        found = self._fit()
        if found is None:
            reasons.append('no usable hop in the window')
        self.scores.append(None if found is None or rows is None else self._score(found))
        between_alarms = self.settings.false_alarm_every_s * self.rate_hz / self.rows
        self.alarm = step(self.alarm, self.model.bank, self.scores[-1],
                          float(np.log(between_alarms)), self._stamp(self.hop))
        return self._update(found, reasons)

    def _usable(self, rows):
        """Return the rows without gaps, or None if too much is missing, and what is wrong."""
        channels, reasons = self.model.simulator.spacecraft.sensors, []
        rows = np.where(np.abs(rows) < LIMITS.acceleration.value, rows, np.nan)
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
        # the mean of one hop alone holds some of its slowest vibration, without which the lowest
        # bins would have less power than expected
        self.means.append(np.nanmean(rows, axis=0))
        try:
            return fill(rows - np.mean(self.means, axis=0), self.model.covariance), reasons
        except ValueError as error:
            return None, reasons + [str(error)]

    def _fit(self):
        """Fit the levels to the window; return fit and evidence, None without a usable hop."""
        held = [s for s in self.window if s is not None]
        if not held:
            return None
        frame = replace(self.model.frame, begins=tuple(range(len(held))))
        evidence = Evidence(frame, np.array(held), tuple(range(len(held))))
        found = fit(self.model.simulator, evidence, levels=self.levels)
        if found is None and self.levels is not None:        # from levels of the past
            found = fit(self.model.simulator, evidence)
        if found is None:
            return None
        self.levels = found.levels
        return found, evidence

    def _score(self, found):
        """Return the statistics of the newest hop at the fitted levels."""
        return statistics(self.model, project(self.model, found[0].levels), self.window[-1])

    def _update(self, found, reasons):
        model, alarm, hops = self.model, self.alarm, len(self.window)
        if hops < self.window.maxlen:
            reasons.append(f'the window holds {hops * self.settings.hop_s:g} s of '
                           f'{self.window.maxlen * self.settings.hop_s:g} s')
        update = GapUpdate(
            self._stamp(self.hop - hops), self._stamp(self.hop), alarm_level=alarm.level,
            raised_ns=alarm.raised_ns, reason='; '.join(reasons),
            measured=self.scores[-1] is not None,
            cause=model.cause(alarm.statistic) if alarm.raised_ns is not None else '')
        if found is None:
            return update
        fitted, evidence = found
        gap = measure(fitted.model, evidence, self.settings.band_bins)
        return replace(
            update, value=gap.value, floor=gap.floor, floor_std=gap.floor_std,
            levels=dict(zip(model.expected.names, map(float, fitted.levels))),
            **leading(model, [s for s in self.scores if s is not None]))

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
