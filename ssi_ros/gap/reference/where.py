"""Where two recordings differ: shares of channels, bands, modes and times, eq. (165)."""
import numpy as np

from ssi_ros.gap.reference.distance import divergence
from ssi_ros.gap.reference.nominal import reach_hz

MOST_BANDS = 12
MOST_TIMES = 24


def locate(nominal, base, one, two):
    """
    Return the shares of the gap; each list adds up to 1 or less.

    Parameters
    ----------
    nominal : Nominal
        The reference.
    base : Fitted
        Level and noise alone.
    one, two : Spectra
        Reference and record.

    Returns
    -------
    dict
        As `where` of the JSON, without `site`.

    """
    cut, width = nominal.cut, len(nominal.channels)
    n_one, n_two = base.prediction.freedom(one.freedom), two.freedom
    excess = nominal.trust * divergence(base.prediction.mean, two.mean, n_one, n_two)
    bands = _shares(excess - width ** 2 / 2 * (1 / n_one + 1 / n_two))
    low, high = cut.middles_hz - cut.width_hz / 2, cut.middles_hz + cut.width_hz / 2
    parts = np.array_split(np.arange(cut.bands), min(MOST_BANDS, cut.bands))
    modes = []
    for i, f in enumerate(nominal.modes.frequencies_hz):
        reach = reach_hz(f, nominal.modes.damping_ratios[i], cut) / 4
        near = np.abs(cut.middles_hz - f) < max(reach, cut.width_hz)
        modes.append({'frequency_hz': f, 'name': name_of(nominal.modes.shapes[:, i],
                                                         nominal.channels),
                      'share': bands[near].sum()})
    total = sum(m['share'] for m in modes)
    modes = [{**m, 'share': m['share'] / max(total, 1.0)} for m in modes]
    return {
        'sensors': [{'name': c, 'share': s} for c, s in zip(
            nominal.channels, channel_shares(nominal, base.prediction, one, two))],
        'bands': [{'low_hz': low[p[0]], 'high_hz': high[p[-1]], 'share': bands[p].sum()}
                  for p in parts],
        'modes': sorted(modes, key=lambda m: -m['share']),
        'times': _times(nominal, base, one, two)}


def name_of(shape, channels):
    """Name a mode by the channels that move most, and which of them move against the first."""
    size = np.abs(shape) / np.abs(shape).max()
    turned = np.real(shape / shape[np.argmax(np.abs(shape))])
    words = [('-' if turned[i] < 0 else '') + channels[i]
             for i in np.argsort(-size) if size[i] > 0.3]
    return 'mode of ' + ', '.join(words[:4])


def channel_shares(nominal, prediction, one, two):
    """
    Return the share of each channel: what the gap loses where that channel is left out.

    Returns
    -------
    ndarray, shape (l,)

    """
    width = len(nominal.channels)
    if width == 1:
        return np.ones(1)
    n_one, n_two = prediction.freedom(one.freedom), two.freedom

    def above(kept):
        grid = np.ix_(np.arange(nominal.cut.bands), kept, kept)
        bands = divergence(prediction.mean[grid], two.mean[grid], n_one, n_two)
        bands -= len(kept) ** 2 / 2 * (1 / n_one + 1 / n_two)
        return np.mean(nominal.trust * bands)
    everything = above(list(range(width)))
    return _shares(np.array([everything - above([k for k in range(width) if k != c])
                             for c in range(width)]))


def structural_shares(nominal, weights):
    """Return the share of each channel in modes that changed, by shapes: weights (m,)."""
    power = np.abs(nominal.modes.shapes) ** 2
    return _shares((power / power.sum(axis=0)) @ np.asarray(weights))


def _shares(excess):
    above = np.maximum(excess, 0.0)
    return above / above.sum() if above.sum() > 0 else np.full(len(above), 1 / len(above))


def _times(nominal, base, one, two):
    parts = np.array_split(np.arange(len(two)), min(MOST_TIMES, len(two)))
    length = two.cut.rows / two.cut.rate_hz
    n, width = two.cut.freedom(1.0), len(nominal.channels)
    found = []
    for part in parts:
        some = two.only(part)
        size = n * some.weights.sum()
        floor = width ** 2 / 2 / size
        # too few spectra for a determinant: the trace of the difference alone
        inverse = np.linalg.inv(base.prediction.mean)
        away = inverse @ some.mean - np.eye(width)
        bands = np.einsum('bij,bji->b', away, away).real / 2
        found.append(max(np.mean(nominal.trust * (bands - floor)), 0.0))
    shares = _shares(np.array(found))
    return [{'start_s': two.times_s[p[0]] - two.weights[p[0]] * length / 2,
             'end_s': two.times_s[p[-1]] + two.weights[p[-1]] * length / 2, 'share': s}
            for p, s in zip(parts, shares)]
