"""Follow the rows of a grid: a live meter for each segment of the clock, with one alarm."""
from ssi_ros.gap.online.sliding import LiveGap


class LiveStream:
    """
    Feed the rows of a grid to live meters; a jump of the clock begins a new window.

    `model` is a LiveModel of `prepare`, `channels` are the names of the columns; ValueError if a
    channel of the model is not among them.
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


def start_of(rows):
    """Return the stamp of the first of Rows [ns]."""
    return rows.origin_ns + round(rows.first * 1e9 / rows.rate_hz)
