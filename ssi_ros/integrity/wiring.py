"""
What wiring and recorder do to channels, in their cross-spectra.

A wrong unit, swapped channels, reversed polarity, skew of the scan. The level of every bin is
free, so that only relations of channels count: the profile likelihood of the mean W of n spectra
of l channels is -n l log tr(S^-1 W). What the samples show without spectra is in `repeats`.
"""
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product
from math import factorial

import numpy as np
from scipy.special import digamma
from ssi_ros.hermitian import inverse_root, white
from ssi_ros.integrity.fault import Fault
from ssi_ros.integrity.thresholds import LIMITS
from ssi_ros.tails import chi2

LOG_G = np.log(9.80665)                 # of the unit g over m/s^2
GAINS = np.geomspace(1 / 20, 20, 121)   # tried for a channel, 5 % apart
FEW = 6                 # channels up to which all polarities and orders are tried
BAND_AVERAGES = 8       # spectra a channel behind the mean of a band
TRIED, STEPS = 101, 3   # delays of a pair, and steps from the best of them
SCATTER = 3.0           # standard deviations of a log ratio up to which it does not decide


@dataclass(frozen=True, eq=False)
class CrossSpectra:
    """Expected and recorded cross-spectra of l channels in k bins or bands."""

    channels: tuple             # names
    frequencies_hz: np.ndarray  # (k,), of the bins [Hz]
    expected: np.ndarray        # (k, l, l), at nominal levels: most faults spoil fitted ones
    fitted: np.ndarray          # (k, l, l), at the levels of the null fit, for delays
    recorded: np.ndarray        # (k, l, l), mean of the record, in the same unit
    averages: float             # independent spectra behind it; n1 n2 / (n1 + n2) of two records
    measured: bool = False  # whether the expected ones are of a recording: no level, but scatter


def faults_of_spectra(spectra):
    """Return faults: unit, swapped or reversed channels; where those are right, scan skew."""
    found = [_unit_of_all(spectra)]
    if len(spectra.channels) > 1:
        found.append(_arrangement(spectra))
    if len(spectra.channels) > 2 and found[-1] is None:
        # of two channels one that is late is an effect of the library
        found.append(_skew(spectra))
    return tuple(d for d in found if d is not None)


def _log_ratios(spectra):
    """Return the quantiles 0.1, 0.5, 0.9 of the log amplitudes over expected, shape (3, l)."""
    recorded, expected = (np.einsum('kii->ki', s).real
                          for s in (spectra.recorded, spectra.expected))
    return np.quantile(np.log(recorded / expected) / 2, [0.1, 0.5, 0.9], axis=0)


def _unit_of_all(spectra):
    """Detect that all channels, in loud and in quiet bins, are off by the factor of g."""
    logs = _log_ratios(spectra)
    turns = np.rint(logs / LOG_G)
    if spectra.measured or abs(turns[0, 0]) != 1 or (turns != turns[0, 0]).any():
        return None
    if np.ptp(logs) > LIMITS.unit_spread.value:
        return None                 # a colour of the excitation is quiet at high frequencies
    factor = float(np.exp(np.mean(logs[1])))
    return _unit('All channels are', {'factor': factor}, factor, 0.0)


def _unit(subject, sizes, factor, p_value):
    meaning = 'in g and not in m/s^2' if factor < 1 else 'converted from g, but was in m/s^2'
    return Fault('unit', sizes, f'{subject} {meaning}: {factor:.3g} times as large as expected.',
                 p_value)


def _arrangement(spectra):
    """Detect swapped channels, reversed polarity, or one channel of a wrong unit."""
    names, recorded, count = spectra.channels, spectra.recorded, len(spectra.channels)
    inverse = np.linalg.inv(spectra.expected).conj()
    swaps = [{i: j, j: i} for i, j in combinations(range(count), 2)]
    orders = [[swap.get(i, i) for i in range(count)] for swap in [{}, *swaps]]
    signs = np.array([(1, *p) for p in product((1, -1), repeat=count - 1)]
                     if count <= FEW else [np.ones(count), *(1 - 2 * np.eye(count))])
    pairs = (signs[:, :, None] * signs[:, None, :]).reshape(len(signs), -1).T
    each = np.array([-np.log((inverse * recorded[:, o][:, :, o]).real.reshape(
        len(recorded), -1) @ pairs) for o in orders]) * count * spectra.averages
    logs = each.sum(axis=1)
    gains = _gain_likelihoods(spectra, inverse) - logs[0, 0]
    logs -= logs[0, 0]
    highest = max(logs.max(), gains.max())
    p_value = float(min(1.0, (logs.size + count) * np.exp(-highest)))
    if p_value > LIMITS.least_p.value:
        return None
    if highest > logs.max():
        channel, at = np.unravel_index(np.argmax(gains), gains.shape)
        # another factor is a gain, which is an effect of the library
        is_unit = abs(abs(np.log(GAINS[at])) - LOG_G) <= LIMITS.unit_error.value
        return _unit(f'Channel {names[channel]} is', {names[channel]: float(GAINS[at])},
                     GAINS[at], p_value) if is_unit else None
    best = np.unravel_index(np.argmax(logs), logs.shape)
    order, sign = orders[best[0]], signs[best[1]]
    before, after = (_distance(spectra, w) for w in (
        recorded, np.outer(sign, sign) * recorded[:, order][:, :, order]))
    if after > max(LIMITS.unexplained.value * before, LIMITS.other_levels.value):
        return None                 # a large change of the structure, of which this is the nearest
    # a symmetric structure cannot distinguish all of them; measured spectra hide that by scatter
    margin = LIMITS.tied.value
    if spectra.measured:
        apart = each - each[best[0], :, best[1]][:, None]
        margin = np.maximum(margin, SCATTER * apart.std(axis=1) * np.sqrt(len(recorded)))
    tied = dict(_described(names, orders[o], signs[s]) for o, s in zip(*np.nonzero(
        logs > highest - margin)))
    channels = dict.fromkeys((n for group in tied.values() for n in group), 1.0)
    text = '; or '.join(tied)
    return Fault('swapped channels' if best[0] else 'reversed polarity', channels,
                 f'{text[0].upper() + text[1:]}.', p_value)


def _gain_likelihoods(spectra, inverse):
    """Return the profile likelihood of a wrong gain of each channel, for all GAINS (l, g)."""
    terms, count = (inverse * spectra.recorded).real, len(spectra.channels)
    own = np.einsum('kii->ki', terms)[..., None]
    cross = 2 * terms.sum(axis=2)[..., None] - 2 * own
    traces = terms.sum(axis=(1, 2))[:, None, None] - cross - own + cross / GAINS + own / GAINS ** 2
    logs = -spectra.averages * (count * np.log(traces) + 2 * np.log(GAINS)).sum(axis=0)
    if not spectra.measured:
        # of two channels one that is too large is like the other too small, but for the level
        level = (_log_ratios(spectra)[1].sum() - np.log(GAINS)) / count
        logs -= (level / np.log(2)) ** 2 / 2
    return logs


def _distance(spectra, recorded):
    """Return D above its floor where the level of every band is free, mean over the bands."""
    count = len(spectra.channels)
    bins = int(np.ceil(count * BAND_AVERAGES / spectra.averages))
    each = white(inverse_root(spectra.expected), recorded)[:len(recorded) // bins * bins]
    each = each.reshape(-1, bins, count, count).mean(axis=1)
    freedom, levels = spectra.averages * bins, np.einsum('bii->b', each).real / count
    distance = (count * np.log(levels) - np.linalg.slogdet(each)[1]).mean()
    # of Wishart matrices of so many averages, and of their traces
    floor = (count * (digamma(count * freedom) - np.log(count))
             - digamma(freedom - np.arange(count)).sum())
    return distance - floor


def _described(names, order, sign):
    """Return an arrangement in words, and the names of the channels that it is of."""
    moved = [names[i] for i, o in enumerate(order) if i != o]
    words = [f'channels {moved[0]} and {moved[1]} are swapped'] if moved else []
    # the common sign of all cannot be known: fewer are reversed than are not
    sign = sign if sign.sum() >= 0 else -sign
    turned, right = ([names[o] for o, s in zip(order, sign) if s == k] for k in (-1, 1))
    if turned:
        words.append(f'the polarity of {", ".join(turned)} is reversed against {", ".join(right)}')
    return ' and '.join(words), moved + turned


def _skew(spectra):
    """Detect that channels are sampled one after another, by the slope of their phases."""
    names, count = spectra.channels, len(spectra.channels)
    lags, known, pairs = _lags(spectra)
    information = (pairs.T * known) @ pairs
    pull = pairs.T @ (known * lags)
    delays = np.linalg.pinv(information, hermitian=True) @ pull
    # the order of the columns is the likeliest, others have to be better than that
    orders = [np.arange(count), np.argsort(delays)]
    orders += permutations(range(count)) if count <= FEW else ()
    ramps = np.argsort(orders, axis=1) - (count - 1) / 2
    sizes = np.einsum('pi,ij,pj->p', ramps, information, ramps) + 1e-300
    gains = (ramps @ pull) ** 2 / sizes / 2
    tied = gains > gains.max() - LIMITS.tied.value
    best = 0 if tied[0] else int(np.argmax(gains))
    gain, joint = gains[best], delays @ pull / 2
    single = np.max(pull ** 2 / (np.diag(information) + 1e-300)) / 2
    p_value = float(min(1.0, factorial(count) / 2 * chi2.sf(2 * gain, 1)))
    if (p_value > LIMITS.least_p.value or gain < single + LIMITS.tied.value
            or joint - gain > LIMITS.uneven.value * joint + LIMITS.tied.value):
        return None
    step_s = float(ramps[best] @ pull / sizes[best])
    of_fit = replace(spectra, expected=spectra.fitted)
    turn = np.exp(2j * np.pi * step_s * np.outer(spectra.frequencies_hz, ramps[best]))
    before, after = (_distance(of_fit, w) for w in (
        spectra.recorded, turn[:, :, None] * spectra.recorded * turn[:, None, :].conj()))
    if after > max(LIMITS.unexplained.value * before, LIMITS.other_levels.value) or (
            after > (1 - LIMITS.least_share.value) * before):
        return None                 # another change, whose phases are near a slope
    order = ', '.join(names[i] for i in orders[best][::1 if step_s > 0 else -1])
    # every order is there in both directions
    word = 'in the order' if tied[0] or tied.sum() <= 3 else 'perhaps in the order'
    return Fault('scan skew', {'skew_s': abs(step_s)}, 'Channels are sampled '
                 f'{1e3 * abs(step_s):.3g} ms after each other, {word} {order}.', p_value)


def _lags(spectra):
    """Return lags [s] of all pairs of channels (p,), their information and the pairs (p, l)."""
    count, turns = len(spectra.channels), 2 * np.pi * spectra.frequencies_hz[:, None]
    first, second = np.triu_indices(count, 1)
    cross, powers = spectra.fitted[:, first, second], np.einsum('kii->ki', spectra.fitted).real
    phase = spectra.recorded[:, first, second] * cross.conj()
    coherence = np.abs(cross) ** 2 / (powers[:, first] * powers[:, second])
    # phases of all pairs of l channels hold l / 2 times as much as there is to know
    weights = 4 * spectra.averages / count * coherence / (1 - coherence + 1e-9)
    phase = weights * phase / np.maximum(np.abs(phase), 1e-300)
    # a scan is over before the next one begins
    reach_s = 0.5 / spectra.frequencies_hz[-1]
    tried = np.linspace(-reach_s, reach_s, TRIED)
    lags = tried[np.argmax((np.exp(1j * turns * tried).T @ phase).real, axis=0)]
    most = (turns ** 2 * weights).sum(axis=0)
    for _ in range(STEPS):
        turned = phase * np.exp(1j * turns * lags)
        lags = np.clip(lags - (turns * turned.imag).sum(axis=0) / most, -reach_s, reach_s)
    known = np.maximum((turns ** 2 * turned.real).sum(axis=0), 0.0)
    # phases that are no straight lines are those of other modes
    known *= known.sum() >= LIMITS.one_slope.value * most.sum()
    return lags, known, np.eye(count)[first] - np.eye(count)[second]
