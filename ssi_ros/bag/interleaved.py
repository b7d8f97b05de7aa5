"""
Whether a channel of a bag holds the samples of several publishers, by its stamps and values.

A message in a bag does not say who sent it. Where two publishers sent on one topic, their stamps
are equal, alternate between two steps, or, half a period apart, come evenly at twice the rate:
then the last but one sample predicts the next, and the last one adds nothing.
"""
import numpy as np
from ssi_ros.arrays import distinct, marked_or_all, rising

SHARE = 0.05            # of a channel's samples that are doubled or alternate, at least
LEAST = 20              # of them, at least
BLOCK = 128             # stamps that are judged together,
TOGETHER = 2048         # and blocks of them at once
ALTERNATES = 0.1        # by so much of the sum of two steps in turn they differ at least,
KEEPS = 0.2             # and by so much of that difference every second step at most
# steps that differ by no more than what the stamps are rounded to are one step, rounded
COARSE = 1.5
PART = 4096             # samples of one part whose values are judged,
PARTS = 8               # and parts spread over a record
LAGS = 8                # samples two apart that predict the next, and as many between
PREDICTED = 0.3              # share of the power that the former predict at least;
# of what is left the latter predict 0.6 in one record of a structure, 0.02 in a mixture
NEW = 0.1
QUARTER = 0.02          # half width of a line at a quarter of the rate, over the rate, which looks
ALONE = 0.9             # alike: share of the power that lies elsewhere at least
LOUDEST = 1e100         # a sample whose square would overflow


def mixed_words(name, stamps_ns, values):
    """
    Return why the samples of a channel cannot be those of one publisher; empty where they can.

    Parameters
    ----------
    name : str
        Of the channel.
    stamps_ns : ndarray of int64, shape (n,)
        Stamps [ns], in any order.
    values : ndarray, shape (n,)
        Samples.

    Returns
    -------
    str

    """
    order = rising(stamps_ns)
    stamps, values = stamps_ns[order], values[order]
    twice = np.flatnonzero(stamps[1:] == stamps[:-1])
    twice = twice[values[twice + 1] - values[twice] != 0]
    if 2 * len(twice) > max(LEAST, SHARE * len(stamps)):
        return (f'{len(twice)} of {len(stamps)} samples of {name} have the stamp of another one, '
                f'and another value{_where(stamps, twice)}: two publishers sent on one topic, or '
                'the stamps are too coarse for the rate; record it again from one, or cut the '
                'record there')
    stamps = distinct(stamps)
    count, at = in_turn(stamps)
    if count > max(LEAST, SHARE * len(stamps)):
        first = at[len(at) // 2 // BLOCK * BLOCK]
        part = np.diff(stamps)[first:first + BLOCK]
        short, long = np.sort([np.median(part[k::2]) for k in (0, 1)]) * 1e-6
        return (f'{count} of {len(stamps)} stamps of {name} come by turns {short:.3g} and '
                f'{long:.3g} ms apart{_where(stamps, at)}: two publishers sent on one topic, or '
                'one sends its samples in pairs; record it again from one, or cut the record '
                'there')
    return ''


def _where(stamps, at):
    """Return from when to when samples lie, empty where it is the whole record."""
    first, last = ((int(stamps[i]) - int(stamps[0])) * 1e-9 for i in (at[0], at[-1]))
    whole = (int(stamps[-1]) - int(stamps[0])) * 1e-9
    return '' if last - first > 0.9 * whole else f', from {first:.1f} to {last:.1f} s'


def in_turn(stamps):
    """
    Return how many stamps alternate between two steps, and where.

    Parameters
    ----------
    stamps : ndarray of int64, shape (n,)
        Rising [ns].

    Returns
    -------
    count : int
    at : ndarray of int
        Numbers of these stamps.

    """
    steps = np.diff(stamps)
    quantum = int(np.gcd.reduce(steps)) if len(steps) else 1
    parts = steps[:len(steps) // BLOCK * BLOCK].reshape(-1, BLOCK)
    # a day at once would take five times the room of its stamps
    found = [_in_turn(parts[k:k + TOGETHER].astype(float), quantum)
             for k in range(0, len(parts), TOGETHER)]
    found = np.concatenate(found) if found else np.zeros(0, bool)
    return BLOCK * np.count_nonzero(found), np.flatnonzero(np.repeat(found, BLOCK))


def _in_turn(parts, quantum):
    """Return whether the steps of parts (p, BLOCK) alternate, (p,)."""
    turn = np.median(np.abs(np.diff(parts)), axis=1)
    again = np.median(np.abs(parts[:, 2:] - parts[:, :-2]), axis=1)
    period = np.median(parts[:, 1:] + parts[:, :-1], axis=1)
    return (turn > np.maximum(COARSE * quantum, ALTERNATES * period)) & (again < KEEPS * turn)


def doubtful_words(name, stamps_ns, values):
    """
    Return that every second sample of a channel seems to be another publisher's; empty where not.

    A structure with nothing but modes in pairs on either side of a quarter of the rate would look
    the same: so this is a doubt, not a proof.

    Parameters
    ----------
    name : str
        Of the channel.
    stamps_ns : ndarray of int64, shape (n,)
        Stamps [ns], in any order.
    values : ndarray, shape (n,)
        Samples.

    Returns
    -------
    str

    """
    order = rising(stamps_ns)
    stamps, values = stamps_ns[order], values[order]
    first = marked_or_all(np.append(True, stamps[1:] != stamps[:-1])[:len(stamps)])
    stamps, values = stamps[first], values[first]
    usable = marked_or_all(np.abs(values) < LOUDEST)
    stamps, values = stamps[usable], values[usable]
    if len(values) < PART // 2:
        return ''
    starts = np.unique(np.linspace(0, max(0, len(values) - PART), PARTS).astype(int))
    apart = [s for s in starts if _apart(values[s:s + PART])]
    if len(apart) < max(1, 2 * len(starts) // PARTS):
        return ''
    rate_hz = 1e9 / np.median(np.diff(stamps[apart[0]:apart[0] + PART]))
    return (f'every second sample of {name} tells nothing of the one before'
            f'{"" if len(apart) == len(starts) else " in a part of the record"}, as where two '
            f'publishers send on one topic at {rate_hz / 2:.4g} Hz each: modes of such samples do '
            'not exist')


def _apart(values):
    """Return whether samples two apart predict each other, and those between add nothing."""
    values = values - values.mean()
    n = len(values)
    if not values.any():
        return False
    lagged = np.lib.stride_tricks.sliding_window_view(values, 2 * LAGS + 1)[:, ::-1]
    # of a QR factorisation the last column holds what each column before it takes of the last one
    taken = np.linalg.qr(np.hstack([lagged[:, 2::2], lagged[:, 1::2], lagged[:, :1]]), 'r')[:, -1]
    power, alone, both = (np.sum(taken[k:] ** 2) for k in (0, LAGS, 2 * LAGS))
    # what as many columns of noise would take
    if alone > (1.0 - PREDICTED) * power or alone - both > (NEW + LAGS / n) * alone:
        return False
    spectrum = np.abs(np.fft.rfft(values * np.hanning(n))) ** 2
    far = np.abs(np.fft.rfftfreq(n) - 0.25) > QUARTER
    return spectrum[far].sum() > ALONE * spectrum.sum()
