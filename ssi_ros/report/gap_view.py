"""All that a page draws of a gap: curves before and after, maps, modes in user units."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.effects import inject
from ssi_ros.gap.check import match
from ssi_ros.gap.expected import expected
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra import make_frame
from ssi_ros.report.before_after import identify_whole, pair, rms
from ssi_ros.report.curves import Curves, curves, record_periodograms


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
        Pieces and band, as the diagnosis used them.
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
    samples = match(spacecraft, samples)
    there = ~np.isnan(samples.values).any(axis=1)
    frame = make_frame(len(samples.values), samples.rate_hz, settings, there)
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
