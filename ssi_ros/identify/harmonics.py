"""
Tell a mode of the structure from the line of a rotating machine.

A line is sharper than any damping that its pole claims; a mode is as broad as its damping says.
Section 7 of docs/theory-identification.md. What the window is too short to resolve stays
'undecided'.
"""
import numpy as np

SEGMENTS = 64           # the window is demodulated in so many pieces: 64 spectral bins
NEAR, FAR = 4, 14       # bins from the peak that make up its surroundings
SURPRISE = 14.0         # a Gaussian peak exceeds its expectation by this once in 1e5 windows
SHARP = 30.0            # peak over surroundings of an unresolved line
RESOLVED = 0.5          # half-power half-width in bins, above which a width is seen
WIDE = 1.5              # width in bins above which the shape of a peak is known
LINE_DAMPING = 1e-3     # below the damping of a space structure, which is 0.2 % and more
TYPICAL_DAMPING = 5e-3  # if not even the peak of this would be known, nothing is said


def sharpness(rows, rate_hz, frequencies_hz):
    """
    Return how far the spectrum at each frequency stands above its surroundings.

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
    ndarray, shape (p,)
        Peak power within 2 bins of 1 / T over the median power 4 to 14 bins away, eq. (60).

    """
    size = len(rows) // SEGMENTS
    rows = np.nan_to_num(rows[:size * SEGMENTS])
    scale = rows.std(axis=0)
    rows = rows / np.where(scale > 0.0, scale, 1.0)
    pieces = rows.reshape(SEGMENTS, size, -1)
    turn = -2j * np.pi * np.asarray(frequencies_hz) / rate_hz
    within = np.exp(np.outer(np.arange(size), turn))
    slow = np.exp(np.outer(np.arange(SEGMENTS) * size, turn))
    z = np.einsum('snl,np->slp', pieces, within, optimize=True) * slow[:, None, :]
    z = z * np.hanning(SEGMENTS + 2)[1:-1, None, None]
    power = np.fft.fftshift((np.abs(np.fft.fft(z, axis=0)) ** 2).sum(axis=1), axes=0)
    centre = SEGMENTS // 2
    peak = power[centre - 2:centre + 3].max(axis=0)
    away = np.concatenate([power[centre - FAR:centre - NEAR + 1],
                           power[centre + NEAR:centre + FAR + 1]])
    return peak * np.log(2.0) / np.maximum(np.median(away, axis=0), 1e-300)


def expected_sharpness(width):
    """Return the sharpness of a mode whose half-power half-width is `width` bins, eq. (61)."""
    away = np.arange(NEAR, FAR + 1)
    width = np.maximum(width, 1e-6)
    return 1.0 + np.median(1.0 + (away / np.asarray(width)[..., None]) ** 2, axis=-1)


def label(candidate, sharp, held_s):
    """
    Judge one candidate.

    Parameters
    ----------
    candidate : Candidate
        With frequency, damping and spreads.
    sharp : float
        From `sharpness`.
    held_s : float
        Length of the window [s].

    Returns
    -------
    label : str
        'structural', 'input_line' or 'undecided'.
    note : str
        What decided.

    """
    bins = candidate.frequency_hz * held_s          # bins of 1 / T in the frequency
    low = (candidate.damping_ratio - 2.0 * candidate.damping_ratio_std) * bins
    width = max(candidate.damping_ratio, 0.0) * bins
    if candidate.damping_ratio < LINE_DAMPING and sharp > SHARP:
        if width < RESOLVED and TYPICAL_DAMPING * bins > WIDE:
            return 'input_line', f'no damping, and {sharp:.0f} times above its surroundings'
    if width > WIDE and sharp > SURPRISE * expected_sharpness(width):
        return 'input_line', (f'{sharp:.0f} times above its surroundings, sharper than its '
                              'damping allows')
    if low > 0.0 and width > RESOLVED:
        return 'structural', ''
    if width > 3.0 and sharp < SURPRISE:
        return 'structural', ''
    return 'undecided', 'the window is too short to tell its width from a line'
