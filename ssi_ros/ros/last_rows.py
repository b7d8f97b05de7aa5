"""The last samples of a stream of rows, for whoever asks about them."""
from collections import deque

import numpy as np

from ssi_ros.gap.online.stream import start_of
from ssi_ros.records import Samples


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
