"""Bring two recordings of one structure together: channels, rate, missing rows."""
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from ssi_ros.gap.check import PARTIAL, TooLittleData
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.gap.spectra.band_averages import FEW_ROWS, SEGMENT_ROWS, SEGMENT_S, spectra_of
from ssi_ros.gap.spectra.thresholds import LIMITS as SPECTRA
from ssi_ros.integrity.filling import filled_alike
from ssi_ros.integrity.missing import best_channels, missing_of, parts_between
from ssi_ros.windows import centred, unit_taper

SAME_RATIO = 2e-4       # how near the ratio of two other rates must be to whole numbers
SAME_RATE = 5e-3        # rates nearer than this are one clock's, as the stamps show it
LARGEST_TERM = 32       # of the ratio p / q of two rates
WILD = 1e100            # no acceleration: its square would overflow


@dataclass(frozen=True, eq=False)
class Pair:
    """Two recordings with the same channels and rate, without offset and without gaps."""

    reference: np.ndarray   # (n, l); short gaps of either are bridged in both, long ones filled
    record: np.ndarray      # (n, l)
    rate_hz: float
    channels: tuple         # names in common
    missing: tuple          # rows of short gaps of the reference, and of the record, (n,) each
    filled: tuple           # rows of long gaps of both, likewise: they hold draws
    notes: tuple            # what was left out or changed, in sentences

    def spectra(self, cut):
        """Return the Spectra of both; what was filled does not count."""
        return tuple(spectra_of(v, cut, f)
                     for v, f in zip((self.reference, self.record), self.filled))


def make_pair(reference, record):
    """Bring two recordings (Samples) to the same channels and the lower of their rates."""
    # ValueError if they share no live channel, or their rates are not in a ratio of small whole
    # numbers.
    both = tuple(c for c in reference.channels if c in record.channels)
    if not both:
        raise ValueError(f'the record has the channels {", ".join(record.channels)}, the '
                         f'reference {", ".join(reference.channels)}: none is in both; give the '
                         'channels the same names, for example with ssi_ros import --names')
    notes = [f'channel {c} is only in the {where}; {PARTIAL}'
             for where, one, other in (('reference', reference, record),
                                       ('record', record, reference))
             for c in one.channels if c not in other.channels]
    one, two = (_columns(s, both) for s in (reference, record))
    dead = {c: why for where, values in (('reference', one), ('record', two))
            for c, why in _dead(values, both, where)}
    live = [i for i, c in enumerate(both) if c not in dead]
    if not live:
        raise TooLittleData('no channel can be compared: ' + '; '.join(dead.values()))
    best = [{live[i] for i in best_channels(~np.isnan(v[:, live]), s.rate_hz,
                                            SPECTRA.gap_s.value * s.rate_hz)}
            for s, v in ((reference, one), (record, two))]
    kept = sorted(best[0] & best[1] or best[1])
    dead.update({both[i]: f'channel {both[i]} is silent for so long that the others hold more '
                 'without it' for i in live if i not in kept})
    live = kept
    notes += [f'{why}; {PARTIAL}' for why in dead.values()]
    channels = tuple(both[i] for i in live)
    one, two, rate_hz, changes = _same_rate(one[:, live], two[:, live], reference.rate_hz,
                                            record.rate_hz)
    gaps = tuple(np.isnan(v).any(axis=1) for v in (one, two))
    longest = SPECTRA.gap_s.value * rate_hz
    filled = tuple(_long(g, longest) for g in gaps)
    short = tuple(g & ~f for g, f in zip(gaps, filled))
    # bridged alike, a short gap changes both spectra alike
    one = _bridged(one, gaps[0] | np.resize(short[1], len(one)))
    two = _bridged(two, gaps[1] | np.resize(short[0], len(two)))
    rows = int(min(max(SEGMENT_S * rate_hz, FEW_ROWS), SEGMENT_ROWS))
    one, two = (filled_alike(v, f, rows) if f.any() else v for v, f in zip((one, two), filled))
    if filled[0].any():
        changes = [*changes, f'{missing_of(reference).text}, in the reference']
    # a median follows the motion itself: what it leaves of an offset leaks into the lowest bands
    one, two = (centred(v, unit_taper(len(v), 1.0)) for v in (one, two))
    return Pair(one, two, rate_hz, channels, short, filled, tuple(notes + changes))


def _long(gaps, longest):
    """Return which rows of gaps, (n,), are those of gaps of more than `longest` rows."""
    found = gaps.copy()
    for first, last in parts_between(~gaps, longest):
        found[first:last] = False
    return found


def dither_of(pair):
    """Return the rms of noise that is negligible beside both recordings, (l,)."""
    return LIMITS.negligible_noise.value * np.min(
        [v.std(axis=0) for v in (pair.reference, pair.record)], axis=0)


def dithered(pair, seed=0):
    """Return both recordings with the same white noise, negligible beside the rms."""
    # What lies deeper below the motion changes from hour to hour on any hardware, and is no gap.
    return noisy(pair, [dither_of(pair)] * 2, seed)


def noisy(pair, sizes, seed=1):
    """Return both recordings with white noise of rms (2, l) in their samples."""
    # there it scatters as noise does, so that no floor has to know of it
    rng = np.random.default_rng(seed)
    reference, record = (v + s * rng.standard_normal(v.shape) for v, s in zip(
        (pair.reference, pair.record), sizes))
    return replace(pair, reference=reference, record=record)


def _columns(samples, names):
    values = samples.values[:, [samples.channels.index(n) for n in names]]
    return np.where(np.abs(values) < WILD, values, np.nan)       # a NaN is not below it


def _dead(values, names, where):
    for name, column in zip(names, values.T):
        present = column[np.isfinite(column)]
        if len(present) < LIMITS.present.value * len(column) or not len(present):
            yield name, (f'channel {name} has {len(present)} of {len(column)} samples in the '
                         f'{where}')
        elif np.ptp(present) <= 1e-12 * np.abs(present).max():
            yield name, (f'channel {name} is dead in the {where}: it shows {present[0]:g} all the '
                         'time')


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
    from scipy.signal import resample_poly
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
