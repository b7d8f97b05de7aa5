"""Where the gap lies: shares of bands, sensors, modes, times and sites, eq. (111)."""
import numpy as np
from scipy.stats import norm

from ssi_ros.gap.meter import distance_of, floor_of_band, measure, whitened
from ssi_ros.model.system import natural_modes

HALF_POWER_BANDS = 3
WIDER = 6               # times the bands of the meter, for a piece alone
REGIMES = 3             # of amplitude that the pieces are sorted into


def locate(simulator, model, evidence, settings, told=None):
    """
    Return the shares of the gap by sensor, band, mode, time and amplitude, with p-values.

    Each list of shares adds up to 1 or less; a p-value is the chance of so much above the floor
    where the model is right. What a fitted effect changes has no noise: by its probability the
    shares of bands, modes and times are its own, (111a).

    Parameters
    ----------
    simulator : Simulator
        Model side.
    model : ndarray, shape (1, k, l, l)
        Nominal expected periodograms at the fitted levels.
    evidence : Evidence
        What was recorded.
    settings : DiagnosisSettings
        Bins of a band.
    told : tuple of (ndarray, float, tuple), optional
        Expected periodograms of the fitted effect, its probability, and when its single events
        were, with the weight of each, where it has such.

    Returns
    -------
    dict

    """
    gap = measure(model, evidence, settings.band_bins)
    system = simulator.setup(_none()).system
    # one piece alone: wider bands, or a band has hardly more spectra than channels
    wide = min(WIDER * settings.band_bins, model.shape[1] // 2)
    pieces = [measure(model, evidence.only([p]), wide) for p in evidence.pieces]
    coarse = np.array_split(np.arange(len(gap.bands)), min(12, len(gap.bands)))
    excess, times = gap.bands, _shares(_above(pieces))
    if told:
        fitted, probability, when = told
        change = whitened(model, fitted)
        # a mean over all of them would hide what comes and goes
        steady = distance_of(change.mean(axis=0)[None], settings.band_bins)[0]
        each = distance_of(change, wide).mean(axis=1)
        each = each[list(evidence.pieces)] if len(each) > 1 else np.ones(len(times))
        if len(when):
            span_s = evidence.frame.rows / evidence.frame.rate_hz
            each = np.histogram(when[0], np.arange(evidence.frame.pieces + 1) * span_s,
                                weights=when[1])[0][list(evidence.pieces)]
        excess = _mixed(gap.bands, steady, probability)
        times = _mixed(times, each, probability)
    shares, chances = _sensor_shares(model, gap, evidence, settings)
    # noise above and below the floor cancels in a wide band
    sums = _shares(np.array([excess[i].sum() for i in coarse]))
    return {
        'sensors': [{'name': n, 'share': s, 'p_value': p} for n, s, p in zip(
            system.channels, shares, chances)],
        'bands': [{'low_hz': gap.edges_hz[i[0]], 'high_hz': gap.edges_hz[i[-1] + 1],
                   'share': share, 'p_value': _chance(gap, i)}
                  for i, share in zip(coarse, sums)],
        'modes': _modes(system, gap, excess),
        'times': _times(pieces, times, evidence), 'amplitudes': _amplitudes(pieces, evidence)}


def _none():
    from ssi_ros.gap.candidate import Candidate
    return Candidate()


def _shares(excess):
    """Return what is above the floor, as shares of its sum."""
    above = np.maximum(excess, 0.0)
    return above / above.sum() if above.sum() > 0 else np.zeros(len(above))


def _sensor_shares(model, gap, evidence, settings):
    """
    Share of a channel: its own variance, u - log u - 1, and its coherence with the others.

    Whitened by S^-1/2, which treats all channels alike; a Cholesky factor moves what is wrong with
    one channel into those after it.
    """
    values, vectors = np.linalg.eigh(model.mean(axis=0))
    root = (vectors / np.sqrt(values)[:, None, :]) @ vectors.conj().swapaxes(-1, -2)
    white = root @ evidence.mean[0] @ root
    count, d = len(gap.bands), white.shape[-1]
    w = white[:count * settings.band_bins].reshape(count, settings.band_bins, d, d).mean(axis=1)
    n = len(evidence.pieces) * settings.band_bins / evidence.frame.crowding_of(settings.band_bins)
    own = np.einsum('bii->bi', w).real
    floor, spread = floor_of_band(n, 1)
    level = own - np.log(own) - 1 - floor
    coherence = np.abs(w) ** 2 / (own[:, :, None] * own[:, None, :])
    shared = (coherence.sum(axis=2) - 1 - (w.shape[1] - 1) / n) / 2
    # a coherence of n spectra with no other is exponential of mean 1 / n
    spread = np.sqrt(spread ** 2 + (w.shape[1] - 1) / (2 * n) ** 2) / np.sqrt(count)
    excess = (level + shared).mean(axis=0)
    return _shares(excess), [float(p) for p in norm.sf(excess / spread)]


def _mixed(measured, expected, probability):
    """Return the sum of both, each as a share of its own, by a probability."""
    both = [v / max(np.maximum(v, 0.0).sum(), 1e-300) for v in (measured, expected)]
    return (1 - probability) * both[0] + probability * both[1]


def _modes(system, gap, excess):
    modes = natural_modes(system)
    total = max(np.maximum(excess, 0.0).sum(), 1e-300)
    found, middles = [], (gap.edges_hz[1:] + gap.edges_hz[:-1]) / 2
    width = gap.edges_hz[1] - gap.edges_hz[0]
    for i, (f, xi) in enumerate(zip(modes.frequencies_hz, modes.damping_ratios)):
        reach = max(HALF_POWER_BANDS * 2 * xi * f, width / 2)
        found.append({'frequency_hz': f, 'name': _name(modes.shapes[:, i].real, system.channels),
                      'share': max(excess[np.abs(middles - f) <= reach].sum(), 0.0) / total,
                      'p_value': _chance(gap, np.flatnonzero(np.abs(middles - f) <= reach))})
    return sorted(found, key=lambda m: -m['share'])


def _name(shape, channels):
    """Name a mode by the signs of its shape on the two sides of both arrays."""
    groups = {}
    for channel, value in zip(channels, shape):
        groups.setdefault(channel.split('_')[0], []).append(value)
    if len(groups) != 2 or any(len(g) != 2 for g in groups.values()):
        return 'mode'
    first, second = groups.values()
    bending = abs(sum(first)) + abs(sum(second)) >= (
        abs(first[0] - first[1]) + abs(second[0] - second[1]))
    ends = (sum(first), sum(second)) if bending else (first[0] - first[1], second[0] - second[1])
    names = '/'.join(n.upper() for n in groups)
    if max(map(abs, ends)) > 5 * min(map(abs, ends)):
        alone = list(groups)[int(abs(ends[1]) > abs(ends[0]))].upper()
        return f'{alone} {"bending" if bending else "torsion"}'
    symmetry = 'symmetric' if ends[0] * ends[1] > 0 else 'antisymmetric'
    return f'{names} {symmetry} {"bending" if bending else "torsion"}'


def _times(pieces, shares, evidence):
    span = evidence.frame.rows / evidence.frame.rate_hz
    return [{'start_s': p * span, 'end_s': (p + 1) * span, 'share': s,
             'p_value': float(norm.sf(g.deviations))}
            for p, s, g in zip(evidence.pieces, shares, pieces)]


def _amplitudes(pieces, evidence):
    """Return the share of quiet, middling and loud pieces, by the rms of the record in them."""
    rows = evidence.frame.rows
    rms = np.sqrt(2 * np.einsum('akii->a', evidence.each).real / rows / evidence.each.shape[-1])
    order, shares = np.argsort(rms), _shares(_above(pieces))
    return [{'low_m_s2': rms[i].min(), 'high_m_s2': rms[i].max(), 'share': shares[i].sum(),
             'p_value': float(norm.sf(sum(pieces[k].deviations for k in i) / np.sqrt(len(i))))}
            for i in np.array_split(order, min(REGIMES, len(order)))]


def _above(pieces):
    return np.array([g.value - g.floor for g in pieces])


def _chance(gap, bands):
    """Return the p-value of what some bands have above their floor together."""
    spread = gap.floor_std * np.sqrt(len(gap.bands))
    return float(norm.sf(gap.bands[bands].sum() / spread / np.sqrt(max(len(bands), 1))))
