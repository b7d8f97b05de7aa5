"""Where the gap lies: shares of bands, sensors, modes, times and sites, eq. (111)."""
import numpy as np

from ssi_ros.gap.meter import floor_of_band, measure
from ssi_ros.model.system import natural_modes

HALF_POWER_BANDS = 3


def locate(simulator, model, evidence, settings):
    """
    Return the shares of the gap by sensor, band, mode and time; each list adds up to 1 or less.

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

    Returns
    -------
    dict

    """
    gap = measure(model, evidence, settings.band_bins)
    system = simulator.setup(_none()).system
    bands = _shares(gap.bands)
    coarse = np.array_split(np.arange(len(bands)), min(12, len(bands)))
    return {
        'sensors': [{'name': n, 'share': s} for n, s in zip(
            system.channels, _sensor_shares(model, gap, evidence, settings))],
        'bands': [{'low_hz': gap.edges_hz[i[0]], 'high_hz': gap.edges_hz[i[-1] + 1],
                   'share': bands[i].sum()} for i in coarse],
        'modes': _modes(system, gap, bands),
        'times': _times(model, evidence, settings)}


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
    level = own - np.log(own) - 1 - floor_of_band(n, 1)[0]
    coherence = np.abs(w) ** 2 / (own[:, :, None] * own[:, None, :])
    shared = (coherence.sum(axis=2) - 1 - (w.shape[1] - 1) / n) / 2
    return _shares((level + shared).mean(axis=0))


def _modes(system, gap, bands):
    modes = natural_modes(system)
    found, middles = [], (gap.edges_hz[1:] + gap.edges_hz[:-1]) / 2
    width = gap.edges_hz[1] - gap.edges_hz[0]
    for i, (f, xi) in enumerate(zip(modes.frequencies_hz, modes.damping_ratios)):
        reach = max(HALF_POWER_BANDS * 2 * xi * f, width / 2)
        found.append({'frequency_hz': f, 'name': _name(modes.shapes[:, i].real, system.channels),
                      'share': bands[np.abs(middles - f) <= reach].sum()})
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


def _times(model, evidence, settings):
    frame = evidence.frame
    excess = []
    for piece in evidence.pieces:
        gap = measure(model, evidence.only([piece]), settings.band_bins)
        excess.append(gap.value - gap.floor)
    span = frame.rows / frame.rate_hz
    return [{'start_s': p * span, 'end_s': (p + 1) * span, 'share': s}
            for p, s in zip(evidence.pieces, _shares(np.array(excess)))]
