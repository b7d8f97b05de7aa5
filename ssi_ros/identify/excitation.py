"""
Whether the structure was excited: why a mode was lost, and whether a window is of one piece.

A mode that nothing excites cannot be seen; that is no death of the mode. Section 9 of
docs/theory-identification.md.
"""
import numpy as np

PARTS = 4               # the newest of so many parts of the window says what goes on now
QUIET = 0.1             # of the power that a mode was seen with; below it the excitation stopped
FORGET = 0.99           # a window; so the power that is remembered follows a slow decline
NAMED = 3               # modes that a reason names one by one
UNEVEN = 20.0           # largest over smallest power of the parts, beyond which a window is uneven


def part_powers(pieces, channels):
    """
    Return the power of every part of a window, summed over the channels.

    Parameters
    ----------
    pieces : ndarray, shape (m, 2)
        Of each piece of the window by rising time: the sum of squares of its samples, and how
        many there are.
    channels : int
        Number of channels l.

    Returns
    -------
    ndarray, shape (4,), [m^2/s^4]
        NaN for a part without samples.

    """
    out = np.full(PARTS, np.nan)
    for k, part in enumerate(np.array_split(pieces, PARTS)):
        power, number = part.sum(axis=0)
        if number:
            out[k] = power * channels / number
    return out


def effective_share(pieces):
    """
    Return the share of a window that its motion fills, 1 where the power is even.

    The canonical correlations of noise depend on how many samples there are; what stands still,
    or nearly so, adds none: (sum of p)^2 over m times the sum of p^2.

    Parameters
    ----------
    pieces : ndarray, shape (m, 2)
        See `part_powers`.

    Returns
    -------
    float

    """
    power = pieces[:, 0] / max(float(pieces[:, 0].max()), 1e-300)
    return float(power.sum() ** 2 / max(len(power) * (power ** 2).sum(), 1e-300))


def band_of(frequency_hz, bands):
    """Return the number of the lowest band that answers for a frequency."""
    return max((k for k, b in enumerate(bands) if frequency_hz <= b.high_hz), default=0)


def remember(heard, modes, powers, bands):
    """
    Return the power that every identity was seen with, in its band.

    Parameters
    ----------
    heard : dict
        Power by identity, from the window before.
    modes : sequence of Mode
        Of this window, with identities.
    powers : sequence of ndarray
        From `part_powers`, one a band.
    bands : sequence of Band
        That the identification runs in.

    Returns
    -------
    dict

    """
    out = dict(heard)
    for m in modes:
        now = np.nanmean(powers[band_of(m.frequency_hz, bands)])
        out[m.identity] = max(now, FORGET * heard.get(m.identity, 0.0))
    return out


def why_lost(heard, missing, powers, bands):
    """
    Say which missing modes are missing because the excitation stopped.

    Parameters
    ----------
    heard, powers, bands
        See `remember`.
    missing : sequence of Mode
        The last sight of every identity that this window lacks.

    Returns
    -------
    str
        Empty if there is none.

    """
    lost = []
    for m in missing:
        before, now = heard.get(m.identity), powers[band_of(m.frequency_hz, bands)][-1]
        if before and now < QUIET * before:
            lost.append((m, now / before))
    if not lost:
        return ''
    if len(lost) <= NAMED:
        names = 'mode ' + ', '.join(f'{m.identity} ({m.frequency_hz:.3f} Hz)' for m, _ in lost)
    else:
        f = [m.frequency_hz for m, _ in lost]
        names = f'{len(lost)} modes from {min(f):.3f} to {max(f):.3f} Hz'
    least, most = min(r for _, r in lost), max(r for _, r in lost)
    share = f'{100 * most:.2g} %' if most < 1.5 * least else (
        f'{100 * least:.2g} to {100 * most:.2g} %')
    return (f'not excited: {names} not detected, and the power of the band is {share} of what it '
            'was: the excitation stopped, the structure may be unchanged')


def unevenness(powers):
    """Return what is wrong with a window whose parts differ, '' where they are alike."""
    seen = powers[np.isfinite(powers)]
    if len(seen) < 2 or seen.max() <= UNEVEN * seen.min():
        return ''
    return (f'the excitation is not stationary: its power changes '
            f'{min(seen.max() / max(seen.min(), 1e-300), 1e9):.0f} times within the window')
