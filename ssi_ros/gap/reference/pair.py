"""Bring two recordings of one structure together: channels, rate, missing rows."""
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from scipy.signal import resample_poly

SAME_RATIO = 2e-4       # how near the ratio of two other rates must be to whole numbers
SAME_RATE = 5e-3        # rates nearer than this are one clock's, as the stamps tell it
LARGEST_TERM = 32       # of the ratio p / q of two rates
WILD = 1e100            # no acceleration: its square would overflow
PRESENT_MIN = 1 / 3     # share of its samples that a channel must have
TOLERANCE = 0.01        # of the rms of a channel: noise below it is nobody's business


@dataclass(frozen=True, eq=False)
class Pair:
    """
    Two recordings with the same channels and rate, without offset and without gaps.

    Attributes
    ----------
    reference, record : ndarray, shape (n, l)
        Values; rows that are missing in either are bridged in both.
    rate_hz : float
        Their rate [Hz].
    channels : tuple of str
        Names in common.
    missing : tuple of ndarray of bool, each of shape (n,)
        Rows that were missing in the reference, and in the record.
    notes : tuple of str
        What was left out or changed, in words.

    """

    reference: np.ndarray
    record: np.ndarray
    rate_hz: float
    channels: tuple
    missing: tuple
    notes: tuple


def make_pair(reference, record):
    """
    Bring two recordings to the same channels and the lower of their rates.

    Parameters
    ----------
    reference, record : Samples
        Two recordings of one structure; NaN where a sample is missing.

    Returns
    -------
    Pair

    Raises
    ------
    ValueError
        If they share no live channel, or their rates are not in a ratio of small whole numbers.

    """
    both = tuple(c for c in reference.channels if c in record.channels)
    if not both:
        raise ValueError(f'the record has the channels {", ".join(record.channels)}, the '
                         f'reference {", ".join(reference.channels)}: none is in both; give the '
                         'channels the same names, for example with ssi_ros import --names')
    notes = [f'channel {c} is only in the {where} and was left out: a partial answer'
             for where, one, other in (('reference', reference, record),
                                       ('record', record, reference))
             for c in one.channels if c not in other.channels]
    one, two = (_columns(s, both) for s in (reference, record))
    dead = {c: why for where, values in (('reference', one), ('record', two))
            for c, why in _dead(values, both, where)}
    live = [i for i, c in enumerate(both) if c not in dead]
    if not live:
        raise ValueError('no channel can be compared: ' + '; '.join(dead.values()))
    notes += [f'{why}; it was left out: a partial answer' for why in dead.values()]
    channels = tuple(both[i] for i in live)
    one, two, rate_hz, told = _same_rate(one[:, live], two[:, live], reference.rate_hz,
                                         record.rate_hz)
    gaps = tuple(np.isnan(v).any(axis=1) for v in (one, two))
    # bridged alike, a gap changes both spectra alike
    one = _bridged(one, gaps[0] | np.resize(gaps[1], len(one)))
    two = _bridged(two, gaps[1] | np.resize(gaps[0], len(two)))
    return Pair(one, two, rate_hz, channels, gaps, tuple(notes + told))


def dithered(pair, seed=0):
    """
    Return both recordings with the same white noise, TOLERANCE of the lower rms of each channel.

    What lies deeper below the motion changes from hour to hour on any hardware, and is no gap. As
    noise in the samples it scatters as noise does, so that no floor has to know of it.
    """
    rng = np.random.default_rng(seed)
    both = pair.reference, pair.record
    size = TOLERANCE * np.min([v.std(axis=0) for v in both], axis=0)
    noisy = [v + size * rng.standard_normal(v.shape) for v in both]
    return replace(pair, reference=noisy[0], record=noisy[1])


def _columns(samples, names):
    values = samples.values[:, [samples.channels.index(n) for n in names]]
    return np.where(np.abs(values) < WILD, values, np.nan)       # a NaN is not below it


def _dead(values, names, where):
    for name, column in zip(names, values.T):
        seen = column[np.isfinite(column)]
        if len(seen) < PRESENT_MIN * len(column) or not len(seen):
            yield name, f'channel {name} has {len(seen)} of {len(column)} samples in the {where}'
        elif np.ptp(seen) <= 1e-12 * np.abs(seen).max():
            yield name, f'channel {name} is dead in the {where}: it shows {seen[0]:g} all the time'


def _same_rate(one, two, rate_one, rate_two):
    ratio = rate_two / rate_one
    if abs(ratio - 1) < SAME_RATE:
        return one, two, rate_one, []
    simple = Fraction(ratio).limit_denominator(LARGEST_TERM)
    if not simple or simple.numerator > LARGEST_TERM or abs(simple / ratio - 1) > SAME_RATIO:
        raise ValueError(f'the record is sampled at {rate_two:g} Hz, the reference at '
                         f'{rate_one:g} Hz: no ratio of whole numbers up to {LARGEST_TERM}; '
                         'resample one of them')
    p, q = simple.numerator, simple.denominator
    if p > q:
        two, low = _resampled(two, q, p), rate_one
    else:
        one, low = _resampled(one, p, q), rate_two
    return one, two, low, [f'rates of {rate_one:g} Hz (reference) and {rate_two:g} Hz were '
                           f'brought to {low:g} Hz']


def _resampled(values, up, down):
    gaps = np.isnan(values).any(axis=1)
    offset = np.nanmedian(values, axis=0)
    out = resample_poly(_bridged(values, gaps), up, down, axis=0)
    touched = np.interp(np.arange(len(out)) * down / up, np.arange(len(gaps)), gaps) > 0.0
    out[touched] = np.nan
    return out + offset


def _bridged(values, gaps):
    """Return values without their median, with straight lines over the gaps."""
    out = values - np.nanmedian(values, axis=0)
    if gaps.any():
        rows = np.arange(len(out))
        for column in out.T:
            column[gaps] = np.interp(rows[gaps], rows[~gaps], column[~gaps])
    return out
