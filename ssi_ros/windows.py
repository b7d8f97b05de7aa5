"""The Tukey window, whose home, `scipy.signal`, takes half a second to import."""
import numpy as np


def tukey(rows, share, periodic=False):
    """
    Return a window that rises and falls as a cosine on a share of its rows, (rows,).

    It begins and ends with 0; a periodic one begins with it alone.
    """
    edge = rows - 1 + periodic
    near = np.minimum(np.arange(rows), edge - np.arange(rows)) / edge
    return (1 - np.cos(np.pi * np.minimum(2 * near / share, 1.0))) / 2
