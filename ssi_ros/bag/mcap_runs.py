"""Messages where they lie in the records of a chunk, many at once where they have one size."""
from array import array
from collections.abc import Sequence

import numpy as np

from .mcap_file import MESSAGE_HEAD
from .mcap_records import HEAD

MOST = 65536            # messages of a run, so that an attempt costs little
LEAST = 32              # of a run that is worth the call
FIELDS = {'opcode': ('u1', 0), 'length': ('<u8', 1), 'channel': ('<u2', 9), 'log': ('<u8', 15),
          'publish': ('<u8', 23)}


class Rows(Sequence):
    """CDR messages as slices of the records that hold them; a sequence of bytes."""

    def __init__(self, records, most=None):
        self.records, self.most = records, most
        self.starts, self.stops = array('q'), array('q')

    def append(self, start, stop):
        """Add the message between two offsets, at most `most` bytes of it."""
        self.starts.append(start)
        self.stops.append(stop if self.most is None else min(stop, start + self.most))

    def extend(self, starts, size):
        """Add messages of one size at offsets, (n,) of int64."""
        self.starts.frombytes(starts.tobytes())
        size = size if self.most is None else min(size, self.most)
        self.stops.frombytes((starts + size).tobytes())

    def __len__(self):
        return len(self.starts)

    def __getitem__(self, i):
        if isinstance(i, slice):
            return [self.records[a:b] for a, b in zip(self.starts[i], self.stops[i])]
        return self.records[self.starts[i]:self.stops[i]]

    def __add__(self, other):
        return [*self, *other]

    def sizes(self):
        """Return the size of every message, (n,) [byte]."""
        return np.frombuffer(self.stops, np.int64) - np.frombuffer(self.starts, np.int64)

    def column(self, offset, code):
        """Return the numbers of a code at an offset of every message, (n,); all must hold it."""
        dtype = np.dtype(code)
        every = np.ndarray((len(self.records) - dtype.itemsize + 1,), dtype, self.records, 0, (1,))
        return every[np.frombuffer(self.starts, np.int64) + offset]


def run(records, at, size):
    """
    Return the heads of the messages of one size that begin at an offset, (n,), n of any number.

    Parameters
    ----------
    records : bytes
        Records one behind the other.
    at : int
        Where a message record begins.
    size : int
        Of it, opcode and length included.

    Returns
    -------
    ndarray, shape (n,)
        A structured array of FIELDS.

    """
    form = np.dtype({'names': list(FIELDS), 'formats': [f for f, _ in FIELDS.values()],
                     'offsets': [o for _, o in FIELDS.values()], 'itemsize': size})
    heads = np.ndarray((min((len(records) - at) // size, MOST),), form, records, at)
    same = (heads['opcode'] == records[at]) & (heads['length'] == size - HEAD.size)
    return heads if same.all() else heads[:np.argmin(same)]


def take(heads, at, found, wanted):
    """
    Add a run of messages to what was found.

    Parameters
    ----------
    heads : ndarray, shape (n,)
        Of `run`, whose first message begins at the offset `at`.
    at : int
        See above.
    found : callable
        Returns the (log times, publish times, Rows) of a channel id.
    wanted : container of int or None
        Channel ids that are taken; all if None.

    """
    size, channels = heads.dtype.itemsize, heads['channel']
    # a channel of a bag comes in turn with few others
    for channel in np.flatnonzero(np.bincount(channels)).tolist():
        if wanted is not None and channel not in wanted:
            continue
        which = np.flatnonzero(channels == channel)
        logs, publishes, rows = found(channel)
        logs.frombytes(heads['log'][which].astype(np.uint64).tobytes())
        publishes.frombytes(heads['publish'][which].astype(np.uint64).tobytes())
        rows.extend(at + MESSAGE_HEAD.size + size * which.astype(np.int64),
                    size - MESSAGE_HEAD.size)
