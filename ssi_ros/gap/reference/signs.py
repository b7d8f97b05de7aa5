"""
Signs that no mean spectrum shows, each compared with the reference, eq. (159) to (162).

What the reference shows too is no difference and is not told.
"""
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.stats import binomtest, f as fisher, gamma, t as student

from ssi_ros.gap.reference.pair import TOLERANCE

PILED = 5e-3            # share of rounded values that a rail must show
RAIL_HITS = 5           # times that a channel must show exactly its extreme
WINDOWS = 60            # of the shorter recording, in which the level is followed
PEAK, FEW = 16.0, 12     # fewer bins than FEW within PEAK of the largest: no smooth level
AROUND = 10             # bins around a line in which the reference is looked at
OWN_BINS = 3            # of a line itself under its taper, on each side
NEVER = 1e-300


@dataclass(frozen=True)
class Sign:
    """
    A sign of one effect: where, with which numbers {name: (value, unit)}, and its p-value.

    One that is `faint` is no gap by itself, but may explain one.
    """

    effect: str
    place: dict
    numbers: dict
    p_value: float
    text: str
    faint: bool = False


def losses(missing):
    """Compare the shares of missing rows, (159); `missing` as in Pair."""
    one, two = (int(np.count_nonzero(m)) for m in missing)
    share = two / len(missing[1])
    usual = one / len(missing[0])
    if share <= 1.5 * usual or binomtest(two, len(missing[1]), max(usual, 1e-4),
                                         'greater').pvalue > 1e-4:
        return None
    return Sign('dropped_samples', {}, {'fraction': (share, '1')}, NEVER,
                f'{100 * share:.2g} % of the rows are missing, {100 * usual:.2g} % in the '
                'reference')


def step_of(column):
    """Return the step of which all values are multiples, 0 where there is none."""
    values = np.unique(column[np.isfinite(column)])
    inner = values[1:-1]                           # the rails need not be multiples
    if len(inner) < 3 or len(values) > 0.5 * len(column):
        return 0.0
    gaps = np.diff(inner)
    step = gaps[gaps > 1e-6 * gaps.max()].min()
    step = np.median(gaps[gaps < 1.5 * step])
    step = (inner[-1] - inner[0]) / np.rint((inner[-1] - inner[0]) / step)
    phase = (inner - inner[0]) / step
    return float(step) if np.abs(phase - np.rint(phase)).max() < 0.01 else 0.0


def steps(one, two):
    """Compare the steps of the channels of two raw recordings, shape (n, l)."""
    coarse = []
    for a, b in zip(one.T, two.T):
        before, after = step_of(a), step_of(b)
        # a record can hardly be told from its steps where they are far below its rms
        if after > 1.5 * before and after > 1e-4 * np.nanstd(b):
            coarse.append(after)
    if not coarse or len(coarse) < one.shape[1] / 2:
        return None
    step = float(np.median(coarse))
    return Sign('quantisation', {}, {'step_m_s2': (step, 'm/s^2')}, NEVER,
                f'all values are multiples of {step:.4g} m/s^2, in the reference they are not')


def rail_of(column):
    """Return the level at which a channel is cut off, 0 where it is not."""
    size = np.abs(column[np.isfinite(column)])
    top = size.max()
    hits = np.count_nonzero(size >= top * (1 - 1e-9))
    if step := step_of(column):
        # values that are rounded repeat themselves: a rail turns a tail that falls into one that
        # rises at its end
        near = np.count_nonzero(size > top - 1.5 * step) - hits
        return float(top) if hits > near and hits > PILED * len(size) else 0.0
    near = np.count_nonzero(size > 0.99 * top) - hits
    return float(top) if hits >= RAIL_HITS and hits > 2 * near + 3 else 0.0


def rails(one, two, channels):
    """Compare the rails of the channels of two raw recordings."""
    limits = {c: rail_of(b) for c, a, b in zip(channels, one.T, two.T) if not rail_of(a)}
    limits = {c: v for c, v in limits.items() if v}
    if not limits:
        return None
    limit = min(limits.values())
    return Sign('saturation', {}, {'limit_m_s2': (limit, 'm/s^2')}, NEVER,
                f'{", ".join(limits)} repeat their extreme of {limit:.4g} m/s^2 exactly')


def _swing(left, size):
    count = len(left) // size
    return np.log((left[:size * count].reshape(count, -1) ** 2).mean(axis=1))


def level_swings(left_one, left_two, rate_hz):
    """Compare how the level wanders, by the variances over windows, (160)."""
    shorter = min(len(left_one), len(left_two))
    if shorter < 20 * WINDOWS:
        return None
    # windows of one length: shorter ones scatter more, whatever the level does
    size = shorter // WINDOWS
    before, after = _swing(left_one, size), _swing(left_two, size)
    ratio = after.var() / before.var()
    # neighbouring windows repeat each other, so fewer degrees than windows
    p = float(fisher.sf(ratio, len(after) // 2, len(before) // 2))
    swing = np.fft.rfft(after - after.mean())
    best = 1 + int(np.argmax(np.abs(swing[1:])))
    depth = float(min(np.sqrt(max(after.var() - before.var(), 0.0) / 2), 0.99))
    if p > 1e-3 or depth < 0.02:
        return None
    return Sign('nonstationary_excitation', {}, {
        'depth': (depth, '1'), 'period_s': (len(after) * size / rate_hz / best, 's')}, p,
        f'the level wanders by {100 * depth:.2g} %, {ratio:.3g} times the variance of the '
        'reference')


def line(one, two, cut, usual, level):
    """
    Search a line in the record that the reference does not have, (162).

    Parameters
    ----------
    one, two : ndarray, shape (n, l)
        Recordings.
    cut : Cut
        Bands.
    usual : ndarray, shape (b, l, l)
        Mean spectrum of the reference.
    level : float
        Power of the record over that of the reference.

    Returns
    -------
    Sign or None

    """
    seen, before = _fine(two, cut), _fine(one, cut)
    f_two, f_one = (np.fft.rfftfreq(len(v), 1 / cut.rate_hz) for v in (two, one))
    usable = (f_two > cut.ends_hz[0]) & (f_two < cut.ends_hz[1])
    ends = cut.middles_hz + cut.width_hz / 2
    bands = np.clip(np.searchsorted(ends, f_two[usable]), 0, cut.bands - 1)
    scale = level * np.einsum('bii->bi', usual).real
    excess = (np.abs(seen[usable]) ** 2 / scale[bands]).mean(axis=1)
    fine = level * (np.abs(before) ** 2)
    reach = max(AROUND, int(np.ceil(AROUND * len(one) / len(two))))
    top = maximum_filter1d(fine, 2 * reach + 1, axis=0)
    at = np.clip(np.rint(f_two[usable] * len(one) / cut.rate_hz).astype(int), 0, len(f_one) - 1)
    excess = np.minimum(excess, (np.abs(seen[usable]) ** 2 / top[at]).mean(axis=1))
    width = two.shape[1]
    # A line stands alone; a narrow mode that moved here has flanks. The channels may move as one.
    power = np.abs(seen) ** 2
    flank = np.ones(2 * AROUND + 1)
    flank[AROUND - OWN_BINS:AROUND + OWN_BINS + 1] = 0.0
    flank /= flank.sum()
    local = np.apply_along_axis(np.convolve, 0, power, flank, 'same')[usable]
    alone = (power[usable] / local).mean(axis=1)
    bins = 2 * (AROUND - OWN_BINS)
    chance = np.maximum(gamma.sf(excess * width, width), fisher.sf(alone, 2, 2 * bins))
    # of a peak of few bins, or of the lines of a periodic excitation, the level is a guess
    high = uniform_filter1d((fine > top / PEAK).astype(float), 2 * reach + 1, axis=0)
    rough = (high[at] * (2 * reach + 1) < FEW).any(axis=1)
    # there two recordings of one narrow mode differ as two exponential variables do
    chance[rough] = 1 / (1 + excess[rough])
    # of a sine of amplitude A under this taper the density is A^2 T / 3
    share = power[usable] * 1.5 * cut.rate_hz / len(two) / two.var(axis=0)
    faint = share.max(axis=1) < TOLERANCE ** 2
    chance *= len(excess)
    loud = np.where(faint, 1.0, chance)
    best = int(np.argmin(loud if loud.min() < 1e-3 else chance))
    if not chance[best] < 1e-3:
        return None
    frequency = float(f_two[usable][best])
    vector = seen[usable][best] * np.sqrt(3 * cut.rate_hz / len(two))
    return Sign('harmonic_disturbance', {'shape': tuple(vector)}, {
        'frequency_hz': (frequency, 'Hz'),
        'acceleration_m_s2': (float(np.linalg.norm(vector)), 'm/s^2')},
        float(max(chance[best], 10 * NEVER)), f'a line at {frequency:.5g} Hz', bool(faint[best]))


def _fine(values, cut):
    taper = np.hanning(len(values) + 2)[1:-1]
    taper /= np.sqrt(np.sum(taper ** 2) * cut.rate_hz / 2)
    return np.fft.rfft(values * taper[:, None], axis=0)


def steady_or_drifting(track, times_s):
    """
    Return the log odds of a drift from the start of a record over a change that stays, (163).

    Parameters
    ----------
    track : ndarray, shape (g,)
        Scores of the groups against the reference, in standard deviations.
    times_s : ndarray, shape (g,), [s]
        Their middles.

    Returns
    -------
    float

    """
    u = times_s / times_s[-1]
    left = [np.sum((track - (track @ v) / (v @ v) * v) ** 2) for v in (np.ones(len(u)), u)]
    scatter = max(1.0, min(left) / max(len(u) - 1, 1))
    return float((left[0] - left[1]) / (2 * scatter))


def trend(track, times_s):
    """Return slope over the record and p-value of a track of group scores, (163)."""
    if len(track) < 6:
        return 0.0, 1.0
    u = 2 * (times_s - times_s.mean()) / (times_s[-1] - times_s[0])
    slope = np.sum(u * track) / np.sum(u ** 2)
    left = track - track.mean() - slope * u
    spread = np.sqrt(max(np.sum(left ** 2) / (len(u) - 2), 1.0) / np.sum(u ** 2))
    return float(slope), float(2 * student.sf(abs(slope) / spread, len(u) - 2))
