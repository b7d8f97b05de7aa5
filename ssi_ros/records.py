"""The nouns that the stages pass on: frozen records with read-only arrays."""
from dataclasses import dataclass, replace

import numpy as np


def read_only(array, dtype=float):
    """Return the array, converted to `dtype` and closed for writing."""
    array = np.asarray(array, dtype=dtype)
    if array.flags.writeable:
        array = array.view()
        array.flags.writeable = False
    return array


@dataclass(frozen=True)
class Samples:
    """
    Channels sampled together on an even grid; a missing sample is NaN.

    Attributes
    ----------
    values : ndarray, shape (n, l), [m/s^2]
        One row a sampling instant, one column a channel.
    rate_hz : float
        Sampling rate [Hz].
    channels : tuple of str
        Names of the l channels.
    start_ns : int
        Stamp of the first row [ns].
    as_sampled : ndarray, shape (n, l), [m/s^2], or None
        The values before channels were moved to the instants of the rows; None if none was.
        Steps and limits of a converter show in these alone.
    late : tuple of float, [samples]
        By how much later than its row each channel was sampled; empty if all were at once.

    """

    values: np.ndarray
    rate_hz: float
    channels: tuple
    start_ns: int = 0
    as_sampled: np.ndarray = None
    late: tuple = ()

    def __post_init__(self):
        values = read_only(self.values)
        if values.ndim != 2 or values.shape[1] != len(self.channels):
            raise ValueError(f'values have shape {values.shape}, but there are '
                             f'{len(self.channels)} channels: one column a channel is needed')
        if not (np.isfinite(self.rate_hz) and self.rate_hz > 0.0):
            raise ValueError(f'rate_hz={self.rate_hz} must be a positive number [Hz]')
        object.__setattr__(self, 'values', values)
        object.__setattr__(self, 'channels', tuple(self.channels))

    @property
    def duration_s(self):
        """Length of the record [s]."""
        return len(self.values) / self.rate_hz

    def stamps_ns(self):
        """Return the stamp of every row, shape (n,), [ns], on the exact grid."""
        steps = np.arange(len(self.values), dtype=np.float64) * (1e9 / self.rate_hz)
        return self.start_ns + np.rint(steps).astype(np.int64)

    def between(self, start_s, end_s):
        """Return the rows from `start_s` up to, not including, `end_s` after the first."""
        first = max(0, int(np.ceil(start_s * self.rate_hz - 1e-9)))
        last = min(len(self.values), int(np.ceil(end_s * self.rate_hz - 1e-9)))
        return Samples(self.values[first:last], self.rate_hz, self.channels,
                       self.start_ns + round(first * 1e9 / self.rate_hz),
                       None if self.as_sampled is None else self.as_sampled[first:last],
                       self.late)

    @property
    def before_moves(self):
        """Return the same record with the values as they were sampled."""
        return self if self.as_sampled is None else replace(
            self, values=self.as_sampled, as_sampled=None)

    @property
    def staggered(self):
        """Return by how many samples the values of each channel are late; () if they are not."""
        return self.late if self.as_sampled is None else ()


@dataclass(frozen=True)
class Mode:
    """
    One identified mode.

    Attributes
    ----------
    identity : int
        Stays with the mode over the windows in which it is tracked; -1 before tracking.
    label : str
        'structural', 'input_line' or 'undecided'.
    frequency_hz, frequency_std_hz : float
        Natural frequency |lambda| / 2 pi and its standard deviation [Hz].
    damping_ratio, damping_ratio_std : float
        -Re(lambda) / |lambda| and its standard deviation [1].
    shape : ndarray, shape (l,), complex, [1]
        Mode shape at the channels, largest component 1.
    shape_std : ndarray, shape (l,), [1]
        Standard deviation of each component's modulus of error, NaN where it is not known.

    """

    frequency_hz: float
    damping_ratio: float
    shape: np.ndarray
    frequency_std_hz: float = float('nan')
    damping_ratio_std: float = float('nan')
    shape_std: np.ndarray = None
    identity: int = -1
    label: str = 'undecided'
    note: str = ''

    def __post_init__(self):
        shape = read_only(self.shape, complex)
        std = np.full(shape.shape, np.nan) if self.shape_std is None else self.shape_std
        object.__setattr__(self, 'shape', shape)
        object.__setattr__(self, 'shape_std', read_only(std))


@dataclass(frozen=True)
class Pole:
    """A pole that did not become a mode, and why ("where did my poles above 20 Hz go?")."""

    frequency_hz: float
    damping_ratio: float
    order: int
    reason: str


@dataclass(frozen=True)
class WindowModes:
    """
    The modes of one window; without modes, the reason why.

    Attributes
    ----------
    start_ns, end_ns : int
        Stamp of the first sample, and of the one after the last [ns].
    modes : tuple of Mode
        By rising frequency.
    reason : str
        Why there are no modes, or what limits them; empty when all is well.
    rejected : tuple of Pole
        The poles that were left out.
    births, deaths : tuple of int
        Identities that began and ended with this window.

    """

    start_ns: int
    end_ns: int
    modes: tuple
    reason: str = ''
    rejected: tuple = ()
    births: tuple = ()
    deaths: tuple = ()
