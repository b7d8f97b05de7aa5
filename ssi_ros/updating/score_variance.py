"""
The variance of scores of lightly damped modes, whose bins and segments are correlated, (105b).

A resonance narrower than a bin has one random height, which all bins of its leakage share; and
what a mode does in one segment rings on into the next. Both are in the covariance of the
periodograms, which the likelihood (97) takes for that of independent bins.
"""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.candidate import Candidate
from ssi_ros.windows import autocorrelation, unit_taper

AROUND = 60             # bins of a segment on both sides of a mode that its score is taken of
LEAKS = 12              # bins that the transform of the taper is followed
APART = 6               # bins that two frequencies are apart, at most
LINES = 4.0             # points on the half-power width of a mode
MOST_ROWS = 400_000     # of the record that the true spectrum is taken of, for memory
TAPER_SHARE = 0.25      # of the record behind the true spectrum


def score_std(simulator, score, lower, at_hz, rate):
    """
    Return the standard deviation of a score over that of independent bins and segments.

    The score is sum tr V (L^-1 Y Y^H L^-H - 1), with its whitened direction V, (k, l, l), and L^-1
    of the expected periodograms; `rate` is the decay of the mode's amplitude in a segment, xi w T.
    """
    frame = simulator.frame
    fine = int(max(4, min(np.ceil(LINES * np.pi / rate), MOST_ROWS // frame.rows)))
    centre = round(at_hz * frame.rows / frame.rate_hz)
    begin, end = max(frame.first, centre - AROUND), min(
        frame.last, centre + AROUND, frame.rows // 2 - LEAKS - APART)
    if begin >= end:
        return 1.0
    own = slice(begin - frame.first, end - frame.first)
    local = np.sum(np.abs(score[own]) ** 2)
    weights = lower[own].conj().swapaxes(1, 2) @ score[own] @ lower[own]
    low, high = max(0, begin - LEAKS), end + LEAKS      # bins of the true spectrum
    power = _spectrum(simulator, fine, low, high + APART)
    padded = np.zeros((high - low + 2 * LEAKS, *score.shape[1:]), complex)
    padded[begin - low + LEAKS:end - low + LEAKS] = weights
    # all bins that a frequency leaks into: axes frequency, l, l, bin less frequency
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * LEAKS + 1, axis=0)[:high - low]
    taper = np.fft.fft(frame.taper, fine * frame.rows)
    offsets = fine * np.arange(-LEAKS, LEAKS + 1)
    total = 0.0
    for part in range(fine):
        for apart in range(APART + 1):
            leakage = taper[offsets - part].conj() * taper[offsets - part - fine * apart]
            both = windows @ leakage
            there = power[apart:apart + high - low, part]
            total += (1 + (apart > 0)) * np.einsum(
                'kij,kjm,kmn,kin->', power[:high - low, part], both, there, both.conj(),
                optimize=True).real
    exact = total / (fine * frame.rows ** 2 * frame.inflation)
    return float(np.sqrt(1 + (exact - local) / np.sum(np.abs(score) ** 2)))


def _spectrum(simulator, fine, low, high):
    """Return the true spectrum, that of a long record, shape (bins, fine, l, l)."""
    frame = simulator.frame
    rows = fine * frame.rows
    taper = unit_taper(rows, TAPER_SHARE)
    side = simulator.on(replace(
        frame, rows=rows, begins=(0,), first=fine * low, last=fine * high, taper=taper,
        overlap=autocorrelation(taper)))
    found = side.expected(Candidate()).at_nominal.mean(axis=0)
    return found.reshape(high - low, fine, *found.shape[1:])


def energies(decay):
    """
    Return how many independent energies of a mode a record holds, and what its ends take away.

    The first is one over the relative variance of the mean energy, the second that variance over
    that of an endless record times its length; the amplitude decays by `decay`, xi w t.
    """
    share = 1 + np.expm1(-2 * decay) / (2 * decay)
    return decay / share, share


def as_gaussian(z, skewness):
    """
    Return standardised scores (t,) of such skewness (t,) with the tail that a Gaussian has.

    A mean of few powers is nearly a gamma variable, whose cube root is Gaussian (Wilson and
    Hilferty, PNAS 17, 1931). Scores on the side of the shorter tail stay as they are.
    """
    skewness, out = np.asarray(skewness, float), np.array(z, float)
    long = skewness * out > 0.0
    n, size = 4 / skewness[long] ** 2, np.abs(out[long])
    few = 3 * np.sqrt(n) * (1 / (9 * n) - 1 + np.cbrt(1 + size / np.sqrt(n)))
    out[long] = np.sign(out[long]) * np.clip(few, 0.0, size)
    return out
