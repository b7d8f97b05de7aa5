"""Move a model onto healthy recordings, with what that leaves unknown."""
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ssi_ros.effects import applicable
from ssi_ros.gap.check import match
from ssi_ros.gap.inference.goodness_of_fit import measure
from ssi_ros.gap.inference.whittle import BLAS
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.selection.thresholds import SELECTION
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.imputation import completed
from ssi_ros.gap.spectra.segmentation import frame_of
from ssi_ros.integrity.missing import missing_of
from ssi_ros.model.channels import of_channels, with_channels
from ssi_ros.model.errors import Calibration, declared, of_recording
from ssi_ros.model.spacecraft import Spacecraft
from ssi_ros.model.uncertainty import EXACT
from ssi_ros.quantity import p_equation
from ssi_ros.updating.fit import ErrorFit, fit_errors
from ssi_ros.updating.input_colour import with_colour, words
from ssi_ros.updating.scatter import between_recordings

BEFORE, TEMPLATES = 0.1, 0.6    # shares of a check: the model as it was, what its tests need


@dataclass(frozen=True, eq=False)
class Check:
    """How well a model explains one healthy recording."""

    before: float           # gap statistic above its floor, of the model as it was [nats a band]
    after: float            # and of the calibrated model
    deviations: float       # of the latter, in standard deviations of the floor
    p_value: float          # of all tests of the recording against the calibrated model
    detected: tuple         # sentences: what the calibrated model does not explain


class Moved(NamedTuple):
    """One number of a model that was calibrated, in the units of `Calibration.values`."""

    name: str
    value: float            # by which it moved
    declared: float         # standard deviation before,
    remains: float          # and after, scatter included
    scatter: float          # from recording to recording, beyond chance


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A model moved onto healthy recordings."""

    spacecraft: object      # Spacecraft, with the calibration
    fit: ErrorFit           # of all recordings together
    scatter: np.ndarray     # (m,), deviation of errors from recording to recording, beyond chance
    checks: tuple           # a Check of every recording
    notes: tuple = ()       # channels that were left out, in sentences
    missing: tuple = ()     # a Missing of every recording

    @property
    def moved(self):
        """Return a Moved for every number of the model, the largest in deviations first."""
        calibration = self.spacecraft.calibration
        every = dict(zip(calibration.names, np.sqrt(np.diag(np.array(calibration.covariance)))))
        rows = map(Moved, self.fit.names, self.fit.values, self.fit.stds,
                   (every[name] for name in self.fit.names), self.scatter)
        own = of_recording(self.fit.names)
        return sorted((m for m, free in zip(rows, own) if not free),
                      key=lambda m: -abs(m.value / m.declared))

    @property
    def explains(self):
        """Whether the calibrated model explains every healthy recording."""
        return not any(c.detected for c in self.checks)


def calibrate(spacecraft, recordings, settings=DiagnosisSettings(), *, names=(), present=(),
              inputs=(), progress=lambda share: None):
    """
    Move a model onto healthy recordings.

    Parameters
    ----------
    spacecraft : Spacecraft
        The model, with its declared uncertainty.
    recordings : sequence of Samples
        One or more; levels of the inputs are free in each.
    settings : DiagnosisSettings
        Segments and band.
    names : sequence of str, optional
        Of the recordings, to be kept with the calibration.
    present : tuple of Effect
        Effects that the model has.
    inputs : sequence of Samples, optional
        Recorded inputs of every recording, in its rows and named as those of the model.
    progress : callable
        Called with the share done.

    Returns
    -------
    Calibrated

    Raises
    ------
    ValueError
        If nothing is declared uncertain, or a recording or its input does not fit the model.

    """
    errors, stds = declared(spacecraft)
    settings = getattr(spacecraft, 'cut', lambda usual: usual)(settings)
    if not errors:
        raise ValueError(
            'uncertainty: all numbers of the model are declared exact, so nothing can be '
            'calibrated; give ' + (
                'frequency, damping, participation, shape, hub_inertia, gain or sensor_place_m'
                if spacecraft.arrays else 'uncertainty_frequency, _damping, _participation, '
                '_shape or _gain') + ' a deviation above 0')
    whole_model = replace(spacecraft, calibration=Calibration())
    bare, matched, notes = _in_common(
        whole_model, recordings if inputs else [r.before_moves for r in recordings])
    present = of_channels(present, [s.name for s in bare.sensors])
    with BLAS.limit(limits=1):
        whole = [_whole(bare, samples, settings, present) for samples in matched]
        errors, stds = declared(bare)
        found = fit_errors(bare, whole, errors, stds, settings, present=present,
                           progress=lambda share: progress((0.2 if inputs else 0.6) * share))
        gaps = any(np.isnan(m.values).any() for m in matched)
        if gaps:
            whole, found = _filled_anew(bare, matched, found, settings, present)
        if isinstance(bare, Spacecraft) and not inputs:
            white, (bare, found) = bare, with_colour(bare, whole, found, settings, present=present)
            if gaps and bare is not white:
                whole, found = _filled_anew(bare, matched, found, settings, present)
        side, beside, recorded = bare, whole, (None,) * len(whole)
        if inputs:
            # the channels alone say where the modes are; a prediction by a model that is many
            # line widths off would say little
            at = replace(bare, calibration=Calibration(errors, found.values))
            side, beside, recorded = _beside(at, whole, inputs, settings, present)
            found = fit_errors(side, beside, errors, stds, settings, present=present,
                               before=found, recorded=recorded,
                               progress=lambda share: progress(0.2 + 0.4 * share))
        scatter = _scatter(side, beside, found, settings, (present, recorded))
        notes += _words_of_forces(found)
        own, found = [found.of(i).values for i in range(len(whole))], _of_any_recording(found)
        # the next recording differs from the mean, and the mean of so few from that of all
        apart = scatter ** 2 * (1 + 1 / len(whole))
        calibrated = replace(bare, calibration=Calibration(
            errors, found.values, found.covariance + np.diag(apart), tuple(map(str, names))))
        checks = []
        for i, samples in enumerate(whole):
            values = np.where(of_recording(errors), own[i], found.values)
            there = replace(calibrated, calibration=replace(
                calibrated.calibration, values=values))
            checks.append(_check(bare, there, samples, settings,
                                 (present, inputs[i] if inputs else None), _part(
                                     progress, 0.6 + 0.4 * i / len(whole), 0.4 / len(whole))))
    unexplained = tuple(dict.fromkeys(d for c in checks for d in c.detected))
    calibration = replace(_of_all_channels(whole_model, calibrated.calibration),
                          unexplained=unexplained)
    if isinstance(bare, Spacecraft):
        whole_model, notes = replace(whole_model, excitation=bare.excitation), notes + words(bare)
    return Calibrated(replace(whole_model, calibration=calibration), found, scatter,
                      tuple(checks), notes, tuple(
                          missing_of(r, [s.name for s in spacecraft.sensors])
                          for r in recordings))


def _in_common(spacecraft, recordings):
    """Return the model and Samples with the channels that serve in every recording, and notes."""
    notes, channels = (), None
    for recording in recordings:
        one, _, said = match(spacecraft, recording)
        own = [s.name for s in one.sensors]
        channels = [c for c in channels or own if c in own]
        notes += said
    if not channels:
        raise ValueError('no channel serves in all recordings; calibrate on those alone that '
                         'have channels in common')
    bare = with_channels(spacecraft, channels)
    matched = [match(bare, r) for r in recordings]
    if any(model is not bare for model, *_ in matched):
        raise ValueError('gaps of the recordings leave no channels in common; calibrate on fewer '
                         'of them')
    return bare, [samples for _, samples, _ in matched], tuple(dict.fromkeys(notes))


def _of_all_channels(spacecraft, calibration):
    """Return a calibration with the errors of the channels that it lacks, as they are declared."""
    names, stds = declared(spacecraft)
    if names == calibration.names:
        return calibration
    at = [names.index(n) for n in calibration.names]
    values, covariance = np.zeros(len(names)), np.diag(stds ** 2)
    values[at], covariance[np.ix_(at, at)] = calibration.values, calibration.covariance
    return replace(calibration, names=names, values=values, covariance=covariance)


def _whole(spacecraft, samples, settings, present):
    """Return a recording without bias, its short gaps filled by the model."""
    simulator = Simulator(spacecraft, frame_of(samples, settings), samples.duration_s, present,
                          late=samples.staggered)
    clipped = np.full(samples.values.shape, np.nan)
    return completed(simulator, samples, clipped, settings)[1]


def _filled_anew(spacecraft, recordings, found, settings, present):
    """Return recordings filled by a model as it was fitted to them, and its ErrorFit there."""
    # what was filled by a model that is wrong is no motion of this structure, and may look like
    # noise or like a colour of the excitation
    at = replace(spacecraft, calibration=Calibration(found.names, found.values))
    whole = [_whole(at, samples, settings, present) for samples in recordings]
    return whole, fit_errors(spacecraft, whole, found.names, found.stds, settings,
                             present=present, before=found)


def _beside(spacecraft, recordings, inputs, settings, present):
    """Return the model without what was recorded, Samples beside the inputs, RecordedInputs."""
    sides, beside = [], []
    for samples, own in zip(recordings, inputs, strict=True):
        _, side, record, _ = ModelNominal(spacecraft, present, own).ready(samples, settings)
        wrong = [f.text for f in record.faults if f.kind == 'input']
        if wrong:
            raise ValueError(f'{wrong[0]} Nothing is calibrated on it; mend the input or the '
                             'model, or leave --input out')
        sides.append(side)
        beside.append(record.samples)
    return sides[0].spacecraft, beside, tuple(s.recorded for s in sides)


def _words_of_forces(found):
    """Return a sentence on how much the forces on the modes differ, if there are any."""
    own = of_recording(found.names)
    logs = np.append(found.values[own], np.ravel(found.others))
    return (f'the forces on the modes differ by {100 * np.sqrt(np.mean(logs ** 2)):.0f} % (rms) '
            'from one level; every recording has its own',) if own.any() else ()


def _of_any_recording(found):
    """Return an ErrorFit without what the next recording has on its own: that is unknown."""
    own = of_recording(found.names)
    covariance = np.where(own[:, None] | own, np.diag(found.stds ** 2), found.covariance)
    return replace(found, values=np.where(own, 0.0, found.values), covariance=covariance)


def _scatter(spacecraft, recordings, found, settings, beside):
    """Return by how much errors differ from recording to recording beyond chance, (m,)."""
    present, recorded = beside
    if len(recordings) < 2:
        return np.zeros(len(found.names))
    each = [fit_errors(spacecraft, [r], found.names, found.stds, settings, present=present,
                       before=found.of(i), recorded=(inputs,))
            for i, (r, inputs) in enumerate(zip(recordings, recorded))]
    spread = np.var([f.values for f in each], axis=0, ddof=1)
    chance = np.mean([np.diag(f.covariance) for f in each], axis=0)
    return np.where(of_recording(found.names), 0.0,
                    between_recordings(found.names, spread, chance, len(recordings)))


def _part(progress, begin, length):
    """Return a callable that takes the share done of a part of the whole."""
    return lambda share: progress(begin + length * share)


def _check(model, calibrated, samples, settings, beside, progress):
    """Return how well a calibrated model, with the forces of a recording, explains it."""
    def compared(spacecraft, share_of_it=lambda share: None):
        return ModelNominal(spacecraft, *beside).compare(
            samples, settings, applicable(spacecraft), share_of_it)
    exact = compared(replace(model, uncertainty=EXACT))
    before = measure(exact.null.state.model, exact.record.spectra, settings.band_bins)
    progress(BEFORE)
    # templates of a model that is new are most of it
    comparison = compared(calibrated, _part(progress, BEFORE, TEMPLATES - BEFORE))
    after = comparison.residual(comparison.null)
    progress(1.0)
    detected = ()
    if after.p_value < SELECTION['residual_p'].value:
        detected = tuple(d.text for d in after.detections + after.anomalies
                         if d.p_value < SELECTION['residual_p'].value) or (
            'the calibrated model does not explain its healthy recording '
            f'({p_equation(after.p_value)})',)
    return Check(before.value - before.floor, after.gap.value - after.gap.floor,
                 after.gap.deviations, after.p_value, detected)
