"""
How scores of modes scatter that ring for long: their bins and pieces repeat each other.

A line narrower than a bin has one random height, which all bins of its leakage show; and what a
mode does in one piece rings on into the next. Both are in the covariance of the periodograms,
which the likelihood (97) takes for that of independent bins, eq. (105b).
"""
from dataclasses import replace

import numpy as np
from scipy.signal.windows import tukey

from ssi_ros.gap.candidate import Candidate

AROUND = 60             # bins of a piece on both sides of a mode that its score is taken of
LEAKS = 12              # bins that the transform of the taper is followed
APART = 6               # bins that two frequencies are apart, at most
LINES = 4.0             # points on the half-power width of a mode
MOST_ROWS = 400_000     # of the record that the true spectrum is taken of, for memory
TAPER_SHARE = 0.25      # of the record that the true spectrum is seen through


def repeats(simulator, score, lower, at_hz, rate):
    """
    Return the standard deviation of a score over that of independent bins, of many pieces.

    Parameters
    ----------
    simulator : Simulator
        Model side.
    score : ndarray, shape (k, l, l)
        Whitened direction V of the score sum tr V (L^-1 Y Y^H L^-H - 1).
    lower : ndarray, shape (k, l, l)
        L^-1, of the expected periodograms.
    at_hz : float
        Frequency of the mode.
    rate : float
        Decay of its amplitude in a piece, xi w T.

    Returns
    -------
    float

    """
    frame = simulator.frame
    fine = int(max(4, min(np.ceil(LINES * np.pi / rate), MOST_ROWS // frame.rows)))
    centre = round(at_hz * frame.rows / frame.rate_hz)
    begin, end = max(frame.first, centre - AROUND), min(frame.last, centre + AROUND)
    if begin >= end:
        return 1.0
    own = slice(begin - frame.first, end - frame.first)
    local = np.sum(np.abs(score[own]) ** 2)
    weights = lower[own].conj().swapaxes(1, 2) @ score[own] @ lower[own]
    low, high = max(0, begin - LEAKS), end + LEAKS      # bins of the true spectrum
    power = _spectrum(simulator, fine, low, high + APART)
    padded = np.zeros((high - low + 2 * LEAKS, *score.shape[1:]), complex)
    padded[begin - low + LEAKS:end - low + LEAKS] = weights
    # all bins that see a frequency: axes frequency, l, l, bin less frequency
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * LEAKS + 1, axis=0)[:high - low]
    taper = np.fft.fft(frame.taper, fine * frame.rows)
    offsets = fine * np.arange(-LEAKS, LEAKS + 1)
    total = 0.0
    for part in range(fine):
        for apart in range(APART + 1):
            seen = taper[offsets - part].conj() * taper[offsets - part - fine * apart]
            both = windows @ seen
            there = power[apart:apart + high - low, part]
            total += (1 + (apart > 0)) * np.einsum(
                'kij,kjm,kmn,kin->', power[:high - low, part], both, there, both.conj(),
                optimize=True).real
    seen = total / (fine * frame.rows ** 2 * frame.crowding)
    return float(np.sqrt(1 + (seen - local) / np.sum(np.abs(score) ** 2)))


def _spectrum(simulator, fine, low, high):
    """Return the true spectrum, that of a long record, shape (bins, fine, l, l)."""
    frame = simulator.frame
    rows = fine * frame.rows
    taper = tukey(rows + 2, TAPER_SHARE)[1:-1]
    taper = taper / np.sqrt(np.sum(taper ** 2))
    overlap = np.fft.irfft(np.abs(np.fft.rfft(taper, 2 * rows)) ** 2)[:rows]
    side = simulator.on(replace(
        frame, rows=rows, pieces=1, first=fine * low, last=fine * high, taper=taper,
        overlap=overlap))
    found = side.expected(Candidate())
    found = found.at(np.ones(len(found.names))).mean(axis=0)
    return found.reshape(high - low, fine, *found.shape[1:])


def energies(decay):
    """
    Return how many independent energies of a mode a record holds, and how few pieces count.

    Parameters
    ----------
    decay : float
        Of the amplitude over the whole record, xi w t.

    Returns
    -------
    count : float
        One over the relative variance of the mean energy.
    share : float
        That variance over what it would be of an endless record, times its length.

    """
    share = 1 + np.expm1(-2 * decay) / (2 * decay)
    return decay / share, share


def as_gaussian(z, count):
    """
    Return standardised scores of a damping with the tail that a mean of energies has.

    More energy than expected looks like less damping, and the mean of few energies is a gamma
    variable, whose cube root is Gaussian (Wilson and Hilferty, PNAS 17, 1931). Positive scores
    stay as they are: their tail is the shorter one.

    Parameters
    ----------
    z : ndarray, shape (t,)
        Scores over their standard deviation.
    count : ndarray, shape (t,)
        How many independent energies each is of; infinite where it is of none.

    Returns
    -------
    ndarray, shape (t,)

    """
    few = np.isfinite(count) & (z < 0)
    n, out = count[few], np.array(z, float)
    out[few] = 3 * np.sqrt(n) * (1 - 1 / (9 * n) - np.cbrt(1 - z[few] / np.sqrt(n)))
    return out
