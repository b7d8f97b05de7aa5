"""The rows of a sliding window side by side in memory, and the power of each of its pieces."""
from collections import deque

import numpy as np


class Window:
    """
    Keep the rows of the last pieces of a stream.

    Parameters
    ----------
    pieces : int
        How many pieces the window holds.
    channels : int
        Columns of a row.

    """

    def __init__(self, pieces, channels):
        self.lengths, self.sums = deque(maxlen=pieces), np.zeros((pieces, 2))
        # channels first, as transforms over time want it
        self.store, self.begin, self.end = np.empty((channels, 64)), 0, 0

    def push(self, rows):
        """Take the rows of one piece, shape (n, l), NaN where missing; forget the oldest piece."""
        if len(self.lengths) == self.lengths.maxlen:
            self.begin += self.lengths[0]
        if self.end + len(rows) > self.store.shape[1]:
            held = self.store[:, self.begin:self.end]
            # twice what is held, so that rows move once a window and not once a piece
            size = max(self.store.shape[1], 2 * (held.shape[1] + len(rows)))
            self.store = np.empty((len(held), size))
            self.store[:, :held.shape[1]] = held
            self.begin, self.end = 0, held.shape[1]
        self.store[:, self.end:self.end + len(rows)] = rows.T
        self.end += len(rows)
        self.lengths.append(len(rows))
        present = rows[~np.isnan(rows)]
        self.sums[:-1] = self.sums[1:]
        self.sums[-1] = present @ present, present.size

    @property
    def powers(self):
        """Return the sum of squares of each piece and how many samples it has, shape (m, 2)."""
        return self.sums[len(self.sums) - len(self.lengths):]

    @property
    def rows(self):
        """Return the rows, shape (n, l), a view that the next piece may change."""
        return self.store[:, self.begin:self.end].T
