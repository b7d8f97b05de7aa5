"""What the localisation of a gap to a model is computed from."""
import numpy as np

from ssi_ros.gap.inference.goodness_of_fit import distance_of, measure, whitened
from ssi_ros.gap.selection.localisation import Change, Measured, name_by_sides, Segment
from ssi_ros.hermitian import whitened_alike
from ssi_ros.model.system import natural_modes

WIDER = 6               # times the bands of the statistic, for a segment alone


def measured(system, model, spectra, bins):
    """Return what a gap to expected periodograms (a, k, l, l) is localised by, a `Measured`."""
    gap, frame, d = measure(model, spectra, bins), spectra.frame, model.shape[-1]
    span_s, wide = frame.span_s, _wide(model, bins)
    rms = np.sqrt(2 * spectra.powers / frame.rows / d)
    segments = tuple(
        Segment(begin, begin + span_s, r, measure(model, spectra.only([p]), wide))
        for p, begin, r in zip(spectra.segments, frame.begins_s.tolist(), rms))
    white, count = whitened_alike(model.mean(axis=0), spectra.mean[0]), len(gap.bands)
    white = white[:count * bins].reshape(count, bins, d, d).mean(axis=1)
    modes = natural_modes(system)
    return Measured(
        system.channels, gap, white, len(spectra.segments) * bins / frame.inflation_of(bins),
        tuple((f, xi, name_by_sides(s.real, system.channels)) for f, xi, s in zip(
            modes.frequencies_hz, modes.damping_ratios, modes.shapes.T)), segments)


def change(models, spectra, bins, events, probability):
    """Return what separates two expected periodograms (a, k, l, l), free of noise, a `Change`."""
    # `events` are instants of single events of the effect [s] and their probabilities
    moved, kept = whitened(*models), list(spectra.segments)
    parts = spectra.frame.parts_of(kept)
    # a mean over all of them would hide what comes and goes
    steady = distance_of(moved.mean(axis=0)[None], bins)[0]
    each = distance_of(moved, _wide(models[0], bins)).mean(axis=1)
    each = each[parts] if len(each) > 1 else np.ones(len(kept))
    if len(events):
        begins_s, span_s = spectra.frame.begins_s[kept, None], spectra.frame.span_s
        inside = (begins_s <= events[0]) & (events[0] < begins_s + span_s)
        each = inside @ events[1]
    return Change(steady, each, probability)


def _wide(model, bins):
    """Return the bins of a band for one segment, which has hardly more spectra than channels."""
    return min(WIDER * bins, model.shape[1] // 2)
