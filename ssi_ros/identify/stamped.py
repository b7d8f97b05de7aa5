"""Identify stamped samples: the grid, then a monitor a segment; the node and the verb use it."""
from ssi_ros.quantity import quantities

from .grid import Grid
from .methods import Method
from .monitor import Monitor, never
from .pace import misfit
from .stamps import batches, nothing_on

CHUNK_S = 10.0            # stamped samples are pushed in pieces of this length


class SegmentMonitor:
    """
    Follow the rows of a grid; a clock jump begins a new window.

    Parameters
    ----------
    channels : sequence of str
        Names of the channels.
    settings : Identification
        Settings of the identification.
    method : Method
        How windows are identified; the columns of its inputs follow those of the channels.

    """

    def __init__(self, channels, settings, method=Method()):
        self.channels, self.settings, self.method = tuple(channels), settings, method
        self.monitor, self._segment, self._held = None, None, 0

    def push(self, rows, late=never):
        """Add Rows of the grid; return the windows whose end they reach; `late` as of Monitor."""
        if self.monitor is None or rows.segment != self._segment:
            start_ns = rows.origin_ns + round(rows.first * 1e9 / rows.rate_hz)
            self.monitor = Monitor(self.channels, rows.rate_hz, start_ns, self.settings,
                                   self.method)
            self._segment, self._held = rows.segment, 0
        self._held += len(rows.values)
        return self.monitor.push(rows.values, late)

    def restart(self):
        """Begin a new window with the next rows."""
        self.monitor = None

    def change(self, settings):
        """
        Take other settings.

        What shapes the window (see `Identification`) begins it anew; the rest holds from the next
        result on.
        """
        if self.monitor is not None and settings != self.settings:
            if any(not f.metadata['live'] and f.name in self.settings.changes(settings)
                   for f in quantities(settings)):
                self.monitor = None
            else:
                self.monitor.settings = settings
        self.settings = settings

    @property
    def fill(self):
        """Share of the window that is filled, 0 to 1."""
        if self.monitor is None:
            return 0.0
        return min(1.0, self._held / (self.settings.window_s * self.monitor.rate_hz))


def identify_stamped(names, stamps_ns, values, settings, *, arrivals_ns=None, rate_hz=0.0,
                     lateness_s=1.0, progress=None, method=Method()):
    """
    Identify channels of stamped samples on sliding windows.

    Parameters
    ----------
    names : sequence of str
        Names of the l channels; those of the method's inputs are the last.
    stamps_ns : sequence of ndarray of int64
        Stamps of each channel [ns], in the order of arrival.
    values : sequence of ndarray
        Samples of each channel.
    settings : Identification
        Settings of the identification.
    arrivals_ns : sequence of ndarray of int64, optional
        When each sample arrived [ns], rising; the stamps are taken where it is not known.
    rate_hz : float
        Sampling rate [Hz], 0 estimates it.
    lateness_s : float
        See `Grid` [s].
    progress : callable, optional
        Called with the share done, 0 to 1.
    method : Method
        How windows are identified.

    Returns
    -------
    windows : tuple of WindowModes
        One a hop; one with a reason where the record is too short for a window.
    grid : Grid
        With its counts of what was missing, late or doubled.

    Raises
    ------
    ValueError
        If no sample has a place on the grid, or no channel comes at the rate; says why.

    """
    if rate_hz:
        wrong = [misfit(n, s, rate_hz) for n, s in zip(names, stamps_ns) if len(s)]
        if wrong and all(wrong):
            raise ValueError(f'{wrong[0]}, not at the {rate_hz:.5g} Hz asked for: its modes would '
                             'not be those of the structure; leave out rate_hz, which is then '
                             'estimated')
    grid = Grid(names, rate_hz, lateness_s)
    follow = SegmentMonitor(names[:len(names) - len(method.inputs)], settings, method)
    windows = []
    pieces = batches(stamps_ns if arrivals_ns is None else arrivals_ns, round(CHUNK_S * 1e9))
    for done, piece in enumerate(pieces):
        for c, part in enumerate(piece):
            grid.push(c, stamps_ns[c][part], values[c][part])
        for rows in grid.rows(flush=done == len(pieces) - 1):
            windows += follow.push(rows)
        if progress is not None:
            progress((done + 1) / len(pieces))
    if follow.monitor is None:
        raise ValueError(nothing_on(grid))
    if not windows:
        windows = [follow.monitor.too_short()]
    return tuple(windows), grid
