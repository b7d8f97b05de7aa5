"""How much of a sliding window is missing, and its longest gap, as a sentence."""
from collections import deque

import numpy as np
from ssi_ros.quantity import choice

SHARE = choice(0.01, '1', 'below it the errors of the modes change by less than a twentieth '
               '(docs/validation/missing.md)')
GAP_S = choice(0.5, 's', 'a longer one is an interruption of the link, not a lost message')


class Gaps:
    """
    Remember which samples of the last pieces of a stream are missing.

    Parameters
    ----------
    pieces : int
        How many pieces the window holds.

    """

    def __init__(self, pieces):
        self._pieces = deque(maxlen=pieces)

    def push(self, missing):
        """Take a mask of one piece, shape (n, l), true where a sample is missing."""
        # most pieces lack nothing: then the length is enough
        self._pieces.append(missing if missing.any() else missing.shape)

    def words(self, names, rate_hz):
        """
        Return the sentence, empty where next to nothing is missing.

        Parameters
        ----------
        names : sequence of str
            Of the l channels.
        rate_hz : float
            Of the rows [Hz].

        Returns
        -------
        str

        """
        if all(isinstance(p, tuple) for p in self._pieces):
            return ''
        missing = np.concatenate([np.zeros(p, dtype=bool) if isinstance(p, tuple) else p
                                  for p in self._pieces])
        longest = [_longest(column) for column in missing.T]
        share, gap_s = missing.mean(), max(longest) / rate_hz
        if share < SHARE.value and gap_s < GAP_S.value:
            return ''
        on = [name for name, rows in zip(names, longest) if rows == max(longest)]
        where = 'all channels' if len(on) == len(names) > 1 else ', '.join(on)
        return (f'{100 * share:.2g} % of the samples are missing, the longest gap {gap_s:.3g} s '
                f'on {where}')


def _longest(missing):
    """Return the length of the longest run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))
