"""Follow the rows of a grid: a live meter a segment with one alarm, and the last samples."""
from collections import deque

import numpy as np

from ssi_ros.gap.live import LiveGap
from ssi_ros.records import Samples


class LiveStream:
    """
    Feed the rows of a grid to live meters; a jump of the clock begins a new window.

    Parameters
    ----------
    model : LiveModel
        Of `prepare`.
    channels : sequence of str
        Names of the columns.
    settings : LiveSettings
        Settings.

    Raises
    ------
    ValueError
        If a channel of the model is not among them.

    """

    def __init__(self, model, channels, settings):
        self.model, self.channels, self.settings = model, tuple(channels), settings
        self.meter, self._segment = LiveGap(model, channels, 0, settings), None

    def push(self, rows):
        """Take Rows of the grid; return one GapUpdate for every hop that they completed."""
        if rows.segment != self._segment:
            self.meter = LiveGap(self.model, self.channels, start_of(rows), self.settings,
                                 self.meter.alarm)
            self._segment = rows.segment
        return self.meter.push(rows.values)

    def change(self, settings):
        """Take settings that do not shape the window."""
        self.settings = self.meter.settings = settings


class LastRows:
    """
    Keep the last rows of a grid, up to `kept_s`; a jump of the clock begins anew.

    Parameters
    ----------
    channels : sequence of str
        Names of the columns.
    rate_hz, kept_s : float
        Rate of the rows [Hz] and how much is kept [s].

    """

    def __init__(self, channels, rate_hz, kept_s):
        self.channels, self.rate_hz = tuple(channels), rate_hz
        self.most = max(1, round(kept_s * rate_hz))
        self._rows, self._count = deque(), 0

    def push(self, rows):
        """Take Rows of the grid."""
        if self._rows and rows.segment != self._rows[-1].segment:
            self._rows.clear()
            self._count = 0
        self._rows.append(rows)
        self._count += len(rows.values)
        while self._count - len(self._rows[0].values) >= self.most:
            self._count -= len(self._rows.popleft().values)

    def samples(self):
        """Return them as Samples; None before the first."""
        rows = list(self._rows)
        if not rows:
            return None
        values = np.concatenate([r.values for r in rows])
        extra = max(0, len(values) - self.most)
        return Samples(values[extra:], self.rate_hz, self.channels,
                       start_of(rows[0]) + round(extra * 1e9 / self.rate_hz))


def start_of(rows):
    """Return the stamp of the first of Rows [ns]."""
    return rows.origin_ns + round(rows.first * 1e9 / rows.rate_hz)
