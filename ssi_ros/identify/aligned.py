"""Rows of channels that are sampled at different instants, moved together while they come."""
from dataclasses import replace

import numpy as np
from ssi_ros.identify.offsets import EDGE, LARGE, moved

WAIT = 1024             # rows after which a channel whose instants are not known counts as silent
BLOCK = 256             # rows that are moved at a time; cut by their number, whoever bunched them
MARGIN = 4 * EDGE       # rows on either side that they are moved with


class Aligned:
    """
    Hand on the rows of a grid with all channels at the instants of the first.

    Where no offset is above LARGE, rows pass as they are. Else they come BLOCK by BLOCK and MARGIN
    later, and a moved channel lacks EDGE rows at either side of a gap.
    """

    def __init__(self):
        self.offsets, self._segment = None, None

    def push(self, rows, offsets):
        """
        Take Rows; return a list of Rows.

        Parameters
        ----------
        rows : Rows
            Of a grid.
        offsets : ndarray, shape (l,)
            `Grid.offsets()` [samples].

        Returns
        -------
        list of Rows

        """
        if rows.segment != self._segment:
            self._segment, self._held, self._known = rows.segment, [], False
            self._begin, self._out = rows.first, 0
            self.offsets = np.zeros(rows.values.shape[1])
        self._held.append(rows.values)
        count = sum(map(len, self._held))
        if not self._known:
            if np.isnan(offsets).any() and count < WAIT:
                return []
            self._known = True
            self.offsets = np.where(np.abs(offsets) > LARGE, offsets, 0.0)
        if not self.offsets.any():
            out, self._held = np.concatenate(self._held), []
            self._begin += len(out)
            return [replace(rows, first=self._begin - len(out), values=out)] if len(out) else []
        return self._blocks(rows)

    def _blocks(self, rows):
        """Return the blocks whose margin has come, moved."""
        values, out = np.concatenate(self._held), []
        while len(values) >= self._out + BLOCK + MARGIN:
            block = values[:self._out + BLOCK + MARGIN].copy()
            for c in np.flatnonzero(self.offsets):
                block[:, c] = moved(block[:, c], self.offsets[c])
            out.append(replace(rows, first=self._begin + self._out,
                               values=block[self._out:self._out + BLOCK]))
            gone = max(0, self._out + BLOCK - MARGIN)
            values, self._begin = values[gone:], self._begin + gone
            self._out = self._out + BLOCK - gone
        self._held = [values]
        return out
