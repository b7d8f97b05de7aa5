"""What a window was identified from, and what became of its modes."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.records import WindowModes


@dataclass(frozen=True)
class BandTrace:
    """
    How one band of one window was identified.

    Attributes
    ----------
    rate_hz : float
        Rate of the band [Hz].
    singular_values : ndarray, shape (r,)
        Canonical correlations (CVA) or singular values (UPC), falling.
    floor : float
        What noise alone reaches; those above it are significant.
    accepted : tuple of Pole
        The poles that make up the modes of the band.

    """

    rate_hz: float
    singular_values: np.ndarray
    floor: float
    accepted: tuple


@dataclass(frozen=True)
class TracedWindow(WindowModes):
    """
    The modes of one window with the trace of every band, and which of them split or merged.

    Attributes
    ----------
    bands : tuple of BandTrace
        From the highest rate to the lowest.
    splits, merges : tuple of (int, int)
        Two identities that were one before this window, or are one since; the first keeps its
        name throughout.

    """

    bands: tuple = ()
    splits: tuple = ()
    merges: tuple = ()
