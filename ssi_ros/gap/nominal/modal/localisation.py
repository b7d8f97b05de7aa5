"""Where two recordings differ: what it is computed from, and what a structural fit says of it."""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.comparison import GapStatistic
from ssi_ros.gap.inference.goodness_of_fit import divergence, floor_of_band
from ssi_ros.gap.selection.localisation import locate, Measured, Segment, shares_of
from ssi_ros.hermitian import inverse_root, white, whitened_alike

WIDER = 6               # bands joined for a group, which has hardly more spectra than channels


def localised(recordings, gap, fit=None):
    """Return where `gap`, a GapStatistic, lies; modes where a fit of each by itself has them."""
    found = locate(measured(recordings, gap))
    if fit is None:
        return found
    for form, at in zip(fit.candidate.forms, fit.candidate.slices):
        if form.each_mode:
            return _at_modes(found, recordings.nominal, fit, at)
    return replace(found, sensors=())


def measured(recordings, gap):
    """Return what the gap of two recordings is localised by, a `Measured`, eq. (165)."""
    nominal, null, two = recordings.nominal, recordings.null.prediction, recordings.two
    n_one, modes, width = null.freedom(recordings.one.freedom), nominal.modes, len(
        nominal.channels)
    floor = recordings.floor_factors[0] * floor_of_band(two.freedom, width, n_one)[0]
    excess = nominal.trust * divergence(null.mean, two.mean, n_one, two.freedom) - floor
    apart = np.eye(width)
    # a band of less weight scatters more: so much nearer to none
    shrunk = apart + np.sqrt(nominal.trust)[:, None, None] * (
        whitened_alike(null.mean, two.mean) - apart)
    averages = np.median(1 / (1 / n_one + 1 / two.freedom)) / recordings.floor_factors[0]
    names = [name_of(shape, nominal.channels) for shape in modes.shapes.T]
    return Measured(
        nominal.channels, _in_all_bands(gap, excess, nominal.cut), shrunk, averages,
        tuple(zip(modes.frequencies_hz, modes.damping_ratios, names)),
        _segments(recordings, n_one))


def _in_all_bands(gap, excess, cut):
    """Return a gap with its bands, those between them that were left out having none."""
    at = np.array(cut.chosen) - cut.chosen[0]
    bands = np.zeros(at[-1] + 1)
    bands[at] = excess
    return GapStatistic(gap.value, gap.floor, gap.floor_std * len(at) / len(bands), bands,
                        cut.ends_hz[0] + cut.width_hz * np.arange(len(bands) + 1))


def _segments(recordings, n_one):
    """Return the gaps of the groups of the record, each Segment with bands joined."""
    null, two, (factor, spread) = (recordings.null.prediction.mean, recordings.two,
                                   recordings.floor_factors)
    share, half_s = (n_one / (n_one + two.freedom))[:, None, None], (
        two.weights * two.cut.rows / two.cut.rate_hz / 2)
    lower = inverse_root(share * null + (1 - share) * two.mean)
    wide, width = min(WIDER, len(n_one)), null.shape[-1]
    count = len(n_one) // wide

    def joined(values):
        return values[:count * wide].reshape(count, wide, *values.shape[1:]).mean(axis=1)
    usual, trust, n_one = joined(white(lower, null)), joined(recordings.nominal.trust), (
        wide * joined(n_one))
    found = []
    for k, (group, middle_s) in enumerate(zip(two.groups, two.times_s + recordings.delay_s)):
        n = wide * two.cut.freedom(two.weights[k])
        bands = trust * divergence(usual, joined(white(lower, group)), n_one, n)
        floor, std = floor_of_band(n, width, n_one)
        rms = np.sqrt(np.einsum('bii->', group).real * two.cut.width_hz / width)
        found.append(Segment(middle_s - half_s[k], middle_s + half_s[k], rms, GapStatistic(
            bands.mean(), factor * floor.mean(), spread * np.sqrt(np.sum(std ** 2)) / count)))
    return tuple(found)


def name_of(shape, channels):
    """Name a mode by the channels that move most, and which of them move against the first."""
    size = np.abs(shape) / np.abs(shape).max()
    turned = np.real(shape / shape[np.argmax(np.abs(shape))])
    words = [('-' if turned[i] < 0 else '') + channels[i]
             for i in np.argsort(-size) if size[i] > 0.3]
    return 'mode of ' + ', '.join(words[:4])


def _at_modes(location, nominal, fit, at):
    """Return a location whose modes and sensors are where a fit has changed the structure."""
    modes = nominal.modes
    z = fit.estimate[at] / np.sqrt(np.maximum(np.diag(fit.covariance)[at], 1e-300))
    shares = shares_of(np.square(z).reshape(-1, len(modes)).sum(axis=0))
    power = np.abs(modes.shapes) ** 2
    sensors = shares_of((power / power.sum(axis=0)) @ shares)
    by_frequency = dict(zip(modes.frequencies_hz, shares))
    return replace(
        location, sensors=tuple({**s, 'share': v} for s, v in zip(location.sensors, sensors)),
        modes=tuple(sorted(({**m, 'share': by_frequency[m['frequency_hz']]}
                            for m in location.modes), key=lambda m: -m['share'])))
