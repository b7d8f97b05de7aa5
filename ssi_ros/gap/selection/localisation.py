"""Where the gap lies: shares of sensors, bands, modes, times and amplitudes, eq. (111)."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.comparison import GapStatistic, Location
from ssi_ros.gap.inference.goodness_of_fit import floor_of_band
from ssi_ros.tails import norm

HALF_POWER_BANDS = 3    # half-power bandwidths around a mode that are its own
MOST_BANDS = 12         # of a table that a person reads
REGIMES = 3             # of amplitude that the segments are sorted into


@dataclass(frozen=True, eq=False)
class Segment:
    """The gap of one segment: when it was [s], how large the motion was, how far it is off."""

    start_s: float
    end_s: float
    rms: float
    gap: GapStatistic


@dataclass(frozen=True, eq=False)
class Change:
    """
    What a fitted effect changes, free of noise, and how probable the effect is.

    `bands` (b,) and `segments` (s,) are distances in any common unit.
    """

    bands: np.ndarray
    segments: np.ndarray
    probability: float


@dataclass(frozen=True, eq=False)
class Measured:
    """
    What localisation is computed from.

    Spectra are whitened by S^-1/2: the symmetric root treats all channels alike, while a Cholesky
    factor moves what is wrong with one channel into those after it.
    """

    channels: tuple         # names
    gap: GapStatistic       # of all segments, with its bands
    whitened: np.ndarray    # (b, l, l), recorded spectra of wide or narrow bands, whitened
    averages: float         # effective number of averages behind each of them
    modes: tuple            # (frequency [Hz], damping ratio, name) of each
    segments: tuple         # `Segment`s of the record


def locate(measured, change=None):
    """Return the shares of the gap, with p-values."""
    # A p-value is the chance of so much above the floor where the nominal is right. With a fitted
    # change the shares of bands, modes and times are its own, by its probability, (111a).
    gap = measured.gap
    above = np.array([s.gap.value - s.gap.floor for s in measured.segments])
    excess, times = gap.bands, shares_of(above)
    if change:
        excess = _mixed(excess, change.bands, change.probability)
        times = _mixed(times, change.segments, change.probability)
    coarse = np.array_split(np.arange(len(gap.bands)), min(MOST_BANDS, len(gap.bands)))
    # noise above and below the floor cancels in a wide band
    sums = shares_of(np.array([excess[i].sum() for i in coarse]))
    sensors, chances = _sensors(measured)
    return Location(
        tuple({'name': n, 'share': s, 'p_value': p} for n, s, p in zip(
            measured.channels, sensors, chances)),
        tuple({'low_hz': gap.edges_hz[i[0]], 'high_hz': gap.edges_hz[i[-1] + 1],
               'share': share, 'p_value': _chance(gap, i)} for i, share in zip(coarse, sums)),
        _modes(measured, excess),
        tuple({'start_s': s.start_s, 'end_s': s.end_s, 'share': share,
               'p_value': float(norm.sf(s.gap.deviations))}
              for s, share in zip(measured.segments, times)),
        _amplitudes(measured.segments, shares_of(above)))


def shares_of(excess):
    """Return what is above the floor, as shares of its sum."""
    above = np.maximum(excess, 0.0)
    return above / above.sum() if above.sum() > 0 else np.zeros(len(above))


def _sensors(measured):
    """Return shares of the channels, by variance, u - log u - 1, and coherence, and p-values."""
    w, n = measured.whitened, measured.averages
    own, others = np.einsum('bii->bi', w).real, w.shape[1] - 1
    known = w.shape[1] - len(measured.channels)     # inputs, whose own spectrum is no gap
    floor, spread = floor_of_band(n, 1)
    level = own - np.log(own) - 1 - floor
    coherence = np.abs(w) ** 2 / (own[:, :, None] * own[:, None, :])
    shared = (coherence.sum(axis=2) - 1 - others / n) / 2
    # a coherence of n spectra with no other is exponential of mean 1 / n
    spread = np.sqrt(spread ** 2 + others / (2 * n) ** 2) / np.sqrt(len(w))
    excess = (level + shared).mean(axis=0)[known:]
    return shares_of(excess), [float(p) for p in norm.sf(excess / spread)]


def _modes(measured, excess):
    gap, found = measured.gap, []
    total = max(np.maximum(excess, 0.0).sum(), 1e-300)
    middles = (gap.edges_hz[1:] + gap.edges_hz[:-1]) / 2
    width = gap.edges_hz[1] - gap.edges_hz[0]
    for frequency, damping, name in measured.modes:
        reach = max(HALF_POWER_BANDS * 2 * damping * frequency, width / 2)
        near = np.flatnonzero(np.abs(middles - frequency) <= reach)
        found.append({'frequency_hz': frequency, 'name': name,
                      'share': max(excess[near].sum(), 0.0) / total,
                      'p_value': _chance(gap, near)})
    return tuple(sorted(found, key=lambda m: -m['share']))


def _amplitudes(segments, shares):
    """Return the share of quiet, middling and loud segments, by the rms of the record in them."""
    rms, gaps = np.array([s.rms for s in segments]), [s.gap for s in segments]
    return tuple({
        'low_m_s2': rms[i].min(), 'high_m_s2': rms[i].max(), 'share': shares[i].sum(),
        'p_value': float(norm.sf(sum(gaps[k].deviations for k in i) / np.sqrt(len(i))))}
        for i in np.array_split(np.argsort(rms), min(REGIMES, len(rms))))


def _mixed(measured, expected, probability):
    """Return the sum of both, each as a share of its own, by a probability."""
    both = [v / max(np.maximum(v, 0.0).sum(), 1e-300) for v in (measured, expected)]
    return (1 - probability) * both[0] + probability * both[1]


def _chance(gap, bands):
    """Return the p-value of what some bands have above their floor together."""
    spread = gap.floor_std * np.sqrt(len(gap.bands))
    return float(norm.sf(gap.bands[bands].sum() / spread / np.sqrt(max(len(bands), 1))))


def name_by_sides(shape, channels):
    """Name a mode by the signs of its shape on the two sides of both arrays; 'mode' elsewhere."""
    groups = {}
    for channel, value in zip(channels, shape):
        groups.setdefault(channel.split('_')[0], []).append(value)
    sides = [c.split('_')[-1] for c in channels]
    if len(groups) != 2 or sides != ['a', 'b', 'a', 'b']:     # edges of two arrays, as ours are
        return 'mode'
    first, second = groups.values()
    bending = abs(sum(first)) + abs(sum(second)) >= (
        abs(first[0] - first[1]) + abs(second[0] - second[1]))
    ends = (sum(first), sum(second)) if bending else (first[0] - first[1], second[0] - second[1])
    names = '/'.join(n.upper() for n in groups)
    word = 'bending' if bending else 'torsion'
    if max(map(abs, ends)) > 5 * min(map(abs, ends)):
        return f'{list(groups)[int(abs(ends[1]) > abs(ends[0]))].upper()} {word}'
    symmetry = 'symmetric' if ends[0] * ends[1] > 0 else 'antisymmetric'
    return f'{names} {symmetry} {word}'
