"""
Rows that wait for a worker, and when windows are skipped so that they do not wait for ever.

A machine that is too slow for good would gather rows without end. Windows go first, never samples:
the rows are still taken in, and the newest window is identified from all of them.
"""
import queue
import threading
import time

# A window is late when it waits for longer than a publisher keeps samples for a reader that stands
# still [s]: what the transport survives costs no window,
LATE_S = 10.0
# and when as much as a whole window waits behind it, so that the newest one shares no sample with
# it. More than that, or than LATE_S of samples, does not gather.


class Backlog:
    """
    A queue of `Rows` that knows how much waits in it.

    Parameters
    ----------
    say : callable
        Called once, with a sentence, when the first window is skipped.

    """

    def __init__(self, say):
        self._say, self._queue, self._lock = say, queue.SimpleQueue(), threading.Lock()
        self.waiting, self.skipped, self.skipped_at = 0, 0, None
        self._since, self._catching_up = time.monotonic(), False

    def put(self, rows):
        """Add Rows, or None for the end."""
        with self._lock:
            self.waiting += 0 if rows is None else len(rows.values)
        self._queue.put((rows, time.monotonic()))

    def get(self):
        """Wait for the oldest Rows and return them; None is the end."""
        rows, self._since = self._queue.get()
        with self._lock:
            self.waiting -= 0 if rows is None else len(rows.values)
        return rows

    def words(self):
        """Return how many windows were skipped, in words; empty where none was."""
        return f', {self.skipped} skipped' if self.skipped else ''

    def skips_lately(self, window_s):
        """Return whether a window was skipped in the last `window_s`."""
        return self.skipped_at is not None and time.monotonic() - self.skipped_at < window_s

    def late(self, left, rate_hz, settings):
        """
        Return whether a window is to be skipped, and count it.

        Parameters
        ----------
        left : int
            Rows that were taken out of the queue and wait behind the window.
        rate_hz : float
            Of the rows [Hz].
        settings : Identification
            With the window and the hop [s].

        Returns
        -------
        bool
            Once one window was late, all are until less than a hop waits: the newest one is
            identified.

        """
        behind_s = (self.waiting + left) / rate_hz
        if self._catching_up:
            self._catching_up = behind_s >= settings.hop_s
        else:
            self._catching_up = (behind_s >= settings.window_s
                                 and time.monotonic() - self._since > LATE_S)
        if self._catching_up:
            if not self.skipped:
                self._say(f'{behind_s:.0f} s of samples wait to be identified: windows are '
                          'skipped up to the newest one, no sample is; raise hop_s or lower '
                          'order_max (said once, /diagnostics counts them)')
            self.skipped += 1
            self.skipped_at = time.monotonic()
        return self._catching_up
