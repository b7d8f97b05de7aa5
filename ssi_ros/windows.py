"""
The Tukey window, and what it makes of segments of a record.

Its home, `scipy.signal`, takes half a second to import.
"""
import numpy as np

from ssi_ros.scipy_later import uniform_filter1d

MOST = 1 << 18          # rows that are transformed at once
AROUND, WINDOWS = 960, 60       # rows over which a level is steady, at least, and in a recording


def slow(power):
    """Return the power (n,) over rows in which a level is steady, (n,)."""
    return uniform_filter1d(power, max(AROUND, len(power) // WINDOWS))


def tukey(rows, share, periodic=False):
    """
    Return a window that rises and falls as a cosine on a share of its rows, (rows,).

    It begins and ends with 0; a periodic one begins with it alone.
    """
    edge = rows - 1 + periodic
    near = np.minimum(np.arange(rows), edge - np.arange(rows)) / edge
    return (1 - np.cos(np.pi * np.minimum(2 * near / share, 1.0))) / 2


def unit_taper(rows, share, periodic=False):
    """Return a Tukey window, without zeros or periodic, of sum of squares 1, shape (rows,)."""
    taper = tukey(rows, share, periodic) if periodic else tukey(rows + 2, share)[1:-1]
    return taper / np.sqrt(np.sum(taper ** 2))


def centred(values, taper):
    """Return values (n, l) without their mean under a taper (n,): slow motion moves it least."""
    return values - taper @ values / taper.sum()


def autocorrelation(tapers):
    """Return sum_n w_n w_(n+lag) of tapers (..., rows) at every lag, the mean over them."""
    rows = tapers.shape[-1]
    power = np.abs(np.fft.rfft(tapers, 2 * rows, axis=-1)) ** 2
    return np.fft.irfft(power.reshape(-1, rows + 1).mean(axis=0))[:rows]


def variance_inflation(taper, bins):
    """Return the variance of a mean of bins, correlated by a taper, over independent ones."""
    steps = np.arange(1, bins)
    correlation = np.abs(np.fft.fft(taper ** 2)[steps]) ** 2
    return 1.0 + 2.0 * float(np.sum((1 - steps / bins) * correlation))


def tapered_dft(values, taper, begins):
    """Return the tapered DFT of segments of values (n, l) from rows on, (segments, bins, l)."""
    begins, rows = np.reshape(begins, (-1, 1)), np.arange(len(taper))
    found = np.empty((len(begins), len(taper) // 2 + 1, values.shape[1]), complex)
    # all segments of a long record at once would take three times its room
    some = max(1, MOST // max(1, len(taper)))
    for k in range(0, len(begins), some):
        segments = values[begins[k:k + some] + rows]
        found[k:k + some] = np.fft.rfft(segments * taper[:, None], axis=1)
    return found


def peak_near(series, line):
    """Return where the power of a series, (n,), is highest near a line, and how high, in lines."""
    # here, for it takes a while; a parabola through three lines would be up to 6 % too high
    from scipy.optimize import minimize_scalar

    share = np.arange(len(series)) / len(series)

    def power(at):
        return np.abs(series @ np.exp(-2j * np.pi * (at * share))) ** 2
    found = minimize_scalar(lambda at: -power(at), bounds=(line - 0.5, line + 0.5),
                            method='bounded', options={'xatol': 1e-3})
    return float(found.x), float(power(found.x))


def excess_around(powers, median, lines, least=0.5):
    """
    Return by how much the neighbours of each power are above a model, at least 1, (k,).

    Parameters
    ----------
    powers : ndarray, (k,)
        Over the expected ones.
    median : float
        What they have in a record of the model. A line hardly raises that of its neighbours.
    lines : int
        Neighbours that are looked at.
    least : float
        Up to which it is 1: what chance makes of so few neighbours. From twice that on all counts.

    """
    lines = min(lines, len(powers))
    around = np.pad(powers, (lines // 2, lines - lines // 2 - 1), mode='symmetric')
    windows = np.lib.stride_tricks.sliding_window_view(around, lines)
    found = np.partition(windows, lines // 2, axis=-1)[:, lines // 2] / median
    return 1.0 + np.maximum(found - 1.0, 0.0) * np.clip(found / least - 1.0, 0.0, 1.0)
