"""
Tell a mode of the structure from the line of a rotating machine.

A line is sharper than any damping that its pole claims; a mode is as broad as its damping says.
Section 7 of docs/theory-identification.md. What the window is too short to resolve stays
'undecided'.
"""
from dataclasses import dataclass

import numpy as np
from scipy.fft import ifft, rfft          # four times as fast as NumPy's on a long window

REACH = 64              # bins of 1 / T on either side of a peak that are looked at
NEAR, FAR = 4, 14       # bins from the peak that make up its surroundings
SURPRISE = 14.0         # a Gaussian peak exceeds its expectation by this once in 1e5 windows
SHARP = 30.0            # peak over surroundings of an unresolved line
RESOLVED = 0.5          # half-power half-width in bins, above which a width is seen
WIDE = 1.5              # width in bins above which the shape of a peak is known
LINE_DAMPING = 1e-3     # below the damping of a space structure, which is 0.2 % and more
TYPICAL_DAMPING = 5e-3  # if not even the peak of this would be known, nothing is said
APART = 6               # bins from the peak at which other lines are looked for
ALONE = 3               # bins in which a line has fallen to its surroundings
COMB = 3                # so many of them are a comb: the excitation itself is periodic
UNKNOWN = 0.25          # of the damping, in place of a spread that era and okid do not have
STEADY = 20.0           # most by which the power of a running machine's line changes


@dataclass(frozen=True)
class Peaks:
    """
    What the spectrum of a window shows at some frequencies, one entry each.

    Attributes
    ----------
    sharpness : ndarray, shape (p,)
        Peak power within 2 bins of 1 / T over the median power 4 to 14 bins away, eq. (60).
    comb : ndarray of bool, shape (p,)
        Whether several other lines stand around it.
    change : ndarray, shape (p,)
        Power in the stronger half of the window over that in the weaker one.

    """

    sharpness: np.ndarray
    comb: np.ndarray
    change: np.ndarray


def look(rows, rate_hz, frequencies_hz):
    """
    Look at the spectrum around some frequencies.

    Parameters
    ----------
    rows : ndarray, shape (n, l)
        The window; NaN where missing.
    rate_hz : float
        Its rate [Hz].
    frequencies_hz : ndarray, shape (p,)
        Where to look [Hz].

    Returns
    -------
    Peaks

    """
    rows = rows.T
    absent = np.isnan(rows)
    if absent.any():
        rows = np.where(absent, 0.0, rows)
    power = np.einsum('ln,ln->l', rows, rows)
    lines = rfft(rows)
    size = rows.shape[1]
    centre = np.rint(np.asarray(frequencies_hz) * size / rate_hz).astype(int)
    at = (centre[:, None] + np.arange(-REACH - 1, REACH + 2)) % size
    near = lines[:, np.minimum(at, size - at)]             # the upper half is mirrored
    near = near / np.sqrt(np.where(power > 0.0, power, 1.0))[:, None, None]
    hann = near[..., 1:-1] - 0.5 * (near[..., :-2] + near[..., 2:])
    power = (hann.real ** 2 + hann.imag ** 2).sum(axis=0)
    middle = REACH
    peak = power[:, middle - 2:middle + 3].max(axis=1)
    away = np.concatenate([power[:, middle - FAR:middle - NEAR + 1],
                           power[:, middle + NEAR:middle + FAR + 1]], axis=1)
    inner, around = power[:, ALONE:-ALONE], np.maximum(power[:, :-2 * ALONE], power[:, 2 * ALONE:])
    tops = (inner > power[:, ALONE - 1:-ALONE - 1]) & (inner >= power[:, ALONE + 1:1 - ALONE])
    tops &= inner > SURPRISE * np.maximum(around, np.median(power, axis=1)[:, None])
    offset = np.arange(ALONE - REACH, REACH - ALONE + 1)
    apart = (np.abs(offset) >= APART) & (centre[:, None] + offset > 0)
    halves = (np.abs(ifft(near[..., middle - 7:middle + 10], axis=-1)) ** 2).sum(axis=0)
    first, second = halves[:, :8].sum(axis=1), halves[:, 9:].sum(axis=1)
    return Peaks(peak * np.log(2.0) / np.maximum(np.median(away, axis=1), 1e-300),
                 (tops & apart).sum(axis=1) >= COMB,
                 np.maximum(first, second) / np.maximum(np.minimum(first, second), 1e-300))


def expected_sharpness(width):
    """Return the sharpness of a mode whose half-power half-width is `width` bins, eq. (61)."""
    return 2.0 + (0.5 * (NEAR + FAR) / max(width, 1e-6)) ** 2      # the median is at the middle


def label(candidate, sharp, held_s, comb=False, change=1.0, decay=False):
    """
    Judge one candidate.

    Parameters
    ----------
    candidate : Candidate
        With frequency, damping and spreads.
    sharp, comb, change : float, bool, float
        From `look`.
    held_s : float
        Length of the window [s].
    decay : bool
        Whether the window is known to be a free decay. A line does not decay, so there a damping
        that is seen to act, by a factor e within the window, is that of a mode.

    Returns
    -------
    label : str
        'structural', 'input_line' or 'undecided'.
    note : str
        What decided.

    """
    bins = candidate.frequency_hz * held_s          # bins of 1 / T in the frequency
    if decay and 2.0 * np.pi * candidate.damping_ratio * bins > 1.0:
        return 'structural', ''
    std = candidate.damping_ratio_std
    if np.isnan(std):
        std = UNKNOWN * max(candidate.damping_ratio, 0.0)
    low = (candidate.damping_ratio - 2.0 * std) * bins
    width = max(candidate.damping_ratio, 0.0) * bins
    high = candidate.damping_ratio + 2.0 * std
    undamped = candidate.damping_ratio < LINE_DAMPING and (width < RESOLVED or high < LINE_DAMPING)
    note = ''
    if undamped and sharp > SHARP and TYPICAL_DAMPING * bins > WIDE:
        note = f'no damping, and {sharp:.0f} times above its surroundings'
    # where lines stand all around, each is sharp and none says anything about the peak they sample
    elif not comb and width > WIDE and sharp > SURPRISE * expected_sharpness(width):
        note = f'{sharp:.0f} times above its surroundings, sharper than its damping allows'
    if note and change > STEADY:
        return 'undecided', (f'its power changes {change:.0f} times within the window: a free '
                             'decay, or a line that was switched')
    if note:
        return 'input_line', note
    if low > 0.0 and width > RESOLVED:
        return 'structural', 'the excitation is a comb of lines' if comb else ''
    if width > 3.0 and sharp < SURPRISE:
        return 'structural', ''
    return 'undecided', 'the window is too short to tell its width from a line'
