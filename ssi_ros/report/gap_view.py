"""All that a page draws of a gap: curves before and after, maps, modes in user units."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import inject
from ssi_ros.gap.check import match
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.expected_periodogram import expected
from ssi_ros.gap.spectra.segmentation import frame_of, make_frame
from ssi_ros.model.channels import of_channels
from ssi_ros.report.before_after import identify_whole, match_modes, pair, rms
from ssi_ros.report.curves import Curves, curves, record_periodograms

SMOOTH = 9              # bins of a running mean of a spectrum, for ratios of two records


@dataclass(frozen=True, eq=False)
class GapView:
    """
    A record beside the nominal model and beside the model with the leading effect.

    Attributes
    ----------
    channels : tuple of str
        Names.
    frame : Frame
        How the record was cut.
    record : ndarray, shape (k, l, l)
        Mean periodogram of the record.
    before, after : Curves
        Nominal model, and the model with the effect; the latter None without one.
    window : WindowModes
        Identified in the whole record.
    pairs_before, pairs_after : list of Pair or None
        What each identified mode is in the two models.
    rms : tuple of ndarray, shape (l,), [m/s^2]
        Recorded, model, model with the effect, in the bins used.
    nominal : str
        What the record is compared with: 'model' or 'reference'.
    blur : float
        How much wider the scatter is because the nominal is itself a record, 1 for a model.
    better : str
        What `after` is of.

    """

    channels: tuple
    frame: object
    record: np.ndarray
    before: Curves
    after: Curves
    window: object
    pairs_before: list
    pairs_after: list
    rms: tuple
    nominal: str = 'model'
    blur: float = 1.0
    better: str = 'model with the effect'


def gap_view(spacecraft, samples, built=(), *, settings=DiagnosisSettings(), present=()):
    """
    Compute what a page draws of a gap.

    Parameters
    ----------
    spacecraft : Spacecraft
        The nominal model.
    samples : Samples
        The record.
    built : tuple of Effect
        The leading effects at their fitted values; empty for none.
    settings : DiagnosisSettings
        Segments and band, as the diagnosis used them.
    present : tuple of Effect
        Effects that the nominal model already has.

    Returns
    -------
    GapView

    Raises
    ------
    ValueError
        If record and model do not fit each other, or the record is too short.

    """
    spacecraft, samples, _ = match(spacecraft, samples)
    present = of_channels(present, samples.channels)
    frame = frame_of(samples, settings)
    record = record_periodograms(samples, frame)[0].mean(axis=0)
    setups = [inject(spacecraft, present, samples.duration_s)]
    if built:
        setups.append(inject(spacecraft, present + tuple(built), samples.duration_s))
    models = [curves(expected(s, frame), samples, frame) for s in setups]
    window = identify_whole(samples)
    pairs = [pair(window.modes, s.system) for s in setups]
    return GapView(
        samples.channels, frame, record, models[0], models[1] if built else None, window,
        pairs[0], pairs[1] if built else None,
        tuple(rms(p, frame) for p in (record, *(m.expected for m in models))))


def reference_view(reference, samples, settings=DiagnosisSettings()):
    """
    Compute what a page draws of a gap to another recording of the same structure.

    The level of the reference is scaled to that of the record, one factor for all. Ratios are of
    spectra smoothed over SMOOTH bins, so that a chance minimum of the reference is no gap.

    Parameters
    ----------
    reference, samples : Samples
        Of the same channels, in the same order, at the same rate.
    settings : DiagnosisSettings
        Segments and band; the shorter record decides the segments.

    Returns
    -------
    GapView

    Raises
    ------
    ValueError
        If channels or rates differ, or a record is too short.

    """
    if samples.channels != reference.channels or samples.rate_hz != reference.rate_hz:
        raise ValueError(f'the record has {samples.channels} at {samples.rate_hz:g} Hz, the '
                         f'reference {reference.channels} at {reference.rate_hz:g} Hz; bring '
                         'them to the same channels and rate first')
    shorter = min(samples, reference, key=lambda s: len(s.values))
    rows = make_frame(len(shorter.values), samples.rate_hz, settings).rows
    settings = replace(settings, segment_s=rows / samples.rate_hz)
    frames = [make_frame(len(s.values), s.rate_hz, settings) for s in (samples, reference)]
    (each, _), (nominal, _) = (record_periodograms(s, f) for s, f in zip(
        (samples, reference), frames))
    record, nominal = each.mean(axis=0), nominal.mean(axis=0)
    power = [np.einsum('kii->ki', p).real for p in (record, nominal)]
    # the median does not follow a line or a shifted resonance
    level = float(np.median(power[0] / np.maximum(power[1], 1e-300)))
    below = np.maximum(_smooth(level * power[1]), 1e-300)
    own = _smooth(power[0]) / below
    segments = np.stack([_smooth(np.einsum('kii->ki', p).real) for p in each])
    curve = Curves(level * nominal, {'level': level}, (segments / below).mean(axis=2), own)
    windows = [identify_whole(s) for s in (samples, reference)]
    return GapView(
        samples.channels, frames[0], record, curve, None, windows[0],
        match_modes(windows[0].modes, windows[1].modes), None,
        tuple(rms(p, frames[0]) for p in (record, curve.expected)), 'reference',
        float(np.sqrt(1 + frames[0].segments / frames[1].segments)))


def _smooth(power):
    """Return powers (k, l) as running means over SMOOTH bins, shorter at the ends."""
    weights = np.ones(SMOOTH)
    counts = np.convolve(np.ones(len(power)), weights, 'same')
    return np.stack([np.convolve(p, weights, 'same') / counts for p in power.T], axis=1)
