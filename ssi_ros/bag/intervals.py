"""The intervals of a topic's times, in bounded memory: rate, gaps, missing samples."""
import numpy as np

from .interleaved import in_turn

_GAP = 1.5            # an interval of so many median ones is a gap: a message or more is missing
STAMPS = ('stamp_gaps', 'stamps_missing', 'stamps_doubled', 'stamps_by_turns')
_ENOUGH = 100         # times from which a median interval is taken where more are to come


class Intervals:
    """
    Statistics of times that come in parts.

    The first times that are folded fix the median and the mean interval; gaps are counted over
    all. Times of one part may come in any order, those of another fold may not be before them.
    """

    def __init__(self):
        self._parts, self._first, self._last = [], None, None
        self._median = self._usual = self._even = None
        self._gaps, self._longest, self._longest_at = 0, -1, 0
        self._stamp_gaps = self._missing = self._doubled = self._by_turns = 0

    def add(self, times):
        """Add times [ns]."""
        self._parts.append(times)

    def fold(self, rest=False):
        """Book the times held so far and forget them; few are kept unless it is the `rest`."""
        held = sum(map(len, self._parts))
        if not held or (held < _ENOUGH and not rest):
            return
        times = np.sort(np.concatenate(self._parts))
        self._parts = []
        if self._first is None:
            self._first = int(times[0])
        else:
            times = np.concatenate(([self._last], times))
        steps = np.diff(times)
        if len(steps):
            self._book(times, steps)
        self._last = int(times[-1])

    def _book(self, times, steps):
        positive = steps[steps > 0]
        if self._median is None and len(positive):
            self._median, mean = float(np.median(steps)), float(np.mean(steps))
            self._usual, self._even = self._median, float(np.median(positive))
            if self._median < 0.5 * mean:      # in bunches, as /clock or a busy machine logs them
                self._median, self._usual = mean, max(mean, float(np.quantile(steps, 0.99)))
        if self._median is None:
            return
        self._gaps += int((steps > _GAP * self._usual).sum())
        at = int(steps.argmax())
        if steps[at] > self._longest:
            self._longest, self._longest_at = int(steps[at]), int(times[at]) - self._first
        self._doubled += int((steps == 0).sum())
        self._by_turns += int(in_turn(np.unique(times))[0])
        periods = positive / self._even
        self._stamp_gaps += int((periods > _GAP).sum())
        self._missing += int(np.maximum(np.rint(periods) - 1.0, 0.0).sum())

    def pace(self):
        """Return rate and gaps of log times; None where there are too few messages."""
        self.fold(rest=True)
        if self._median is None:
            return {'rate_hz': None, 'gaps': 0, 'longest_gap_s': None, 'longest_gap_at_s': None}
        return {'rate_hz': 1e9 / self._median, 'gaps': self._gaps,
                'longest_gap_s': self._longest / 1e9 if self._gaps else None,
                'longest_gap_at_s': self._longest_at / 1e9 if self._gaps else None}

    def missing(self):
        """Return gaps, and missing and doubled samples, by header stamps; None without any."""
        self.fold(rest=True)
        if self._median is None or not self._first:
            return dict.fromkeys(STAMPS)
        return dict(zip(STAMPS, (self._stamp_gaps, self._missing, self._doubled,
                                 self._by_turns)))
