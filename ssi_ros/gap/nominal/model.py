"""The nominal that a spacecraft model gives, set beside a record."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import library
from ssi_ros.gap.check import match, TooLittleData
from ssi_ros.gap.detectors import detect_in_samples
from ssi_ros.gap.nominal.model_comparison import ModelComparison
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.gap.spectra.imputation import completed, without_clipped
from ssi_ros.gap.spectra.segmentation import frame_of
from ssi_ros.inputs.adapted import adapted_beside
from ssi_ros.inputs.beside import acting, beside_inputs, faults_of_inputs
from ssi_ros.integrity.repeats import faults_of_samples
from ssi_ros.model.channels import of_channels
from ssi_ros.model.spacecraft import Spacecraft
from ssi_ros.records import Samples
from ssi_ros.updating.adapted_comparison import AdaptedComparison
from ssi_ros.updating.calibrated_comparison import CalibratedComparison
from ssi_ros.updating.prior import known_by_recordings
from ssi_ros.updating.refilled import adapted_and_filled, as_the_best_has_it, of_clipped
from ssi_ros.updating.settled import best_of, explains, is_better, search_of, settled, suffices


@dataclass(frozen=True)
class ModelNominal:
    """A model as what is expected; the simulator has the effects `present` already."""

    spacecraft: Spacecraft
    present: tuple = ()
    inputs: Samples = None      # recorded ones, by their names in the model, in rows of the record

    @property
    def channels(self):
        """Return the names of the channels that a record should have."""
        return tuple(s.name for s in self.spacecraft.sensors)

    def compare(self, samples, settings, effects, progress):
        """
        Set the model beside a record.

        Parameters
        ----------
        samples : Samples
            The record.
        settings : DiagnosisSettings
            Segments, band, uncertainty.
        effects : tuple of str
            Names to consider.
        progress : callable
            Called with the share done.

        Returns
        -------
        ModelComparison

        Raises
        ------
        TooLittleData
            If the record is too short.
        ValueError
            If record and model do not fit each other.

        """
        settings = getattr(self.spacecraft, 'cut', lambda usual: usual)(settings)
        spacecraft, simulator, record, levels = self.ready(samples, settings)
        effects, calibration = acting(effects, simulator), spacecraft.calibration
        record = replace(record, sought=tuple(
            n for n in effects if n not in {e.name for e in self.present}))
        prior = known_by_recordings(calibration) if calibration.covariance else None

        def beside(side, prior):
            there = record if side is simulator else of_clipped(record, side, levels, settings)
            kind = CalibratedComparison if prior else ModelComparison
            return kind(side, there, settings, effects, levels, progress, prior)

        as_it_is = beside(simulator, prior)
        if refilled := (prior or spacecraft.uncertainty.exact) and as_the_best_has_it(as_it_is):
            record = refilled
            as_it_is = beside(simulator, prior)
        if prior:
            return settled(as_it_is, beside)
        return as_it_is if spacecraft.uncertainty.exact else self._as_declared(as_it_is, progress)

    def _as_declared(self, as_it_is, progress):
        """Return the comparison with a model that errs by what it declares, moved if need be."""
        doubt = as_it_is.doubtful       # errors of a model turn phases, and raise levels
        if explains(as_it_is) and not doubt:
            return as_it_is
        # what is as far as this is wrong itself, more probably than one effect is so large
        wrong = doubt or as_it_is.goodness_of_fit(as_it_is.null).lost > LIMITS.wrong_model.value
        best, done = (None, False) if wrong else best_of(as_it_is, pairs=False)
        if done:
            return as_it_is
        simulator, record, settings = as_it_is.simulator, as_it_is.record, as_it_is.settings
        if self.inputs is None:
            adapted, record = adapted_and_filled(simulator, record, settings, progress)
        else:
            adapted, record = adapted_beside(
                simulator.spacecraft, simulator, record, settings, progress)
        moved = AdaptedComparison(simulator, adapted, record, settings, as_it_is.effects, progress)
        if doubt or explains(moved):
            return moved
        there = next(iter(search_of(moved).singles()), None)
        if not (there and suffices(moved, there.fit, wrong)):
            best, done = best_of(as_it_is)
        return as_it_is if done or is_better(as_it_is, best, there, moved) else moved

    def ready(self, samples, settings):
        """Return the model of the channels there are, its side, a Record and its levels."""
        # a prediction by inputs is that of the instants of the rows
        spacecraft, samples, notes = match(
            self.spacecraft, samples.before_moves if self.inputs is None else samples)
        present = of_channels(self.present, samples.channels)
        faults = faults_of_samples(samples)
        detections = detect_in_samples(samples.before_moves, tuple(library()))
        samples, clipped = without_clipped(samples, [d.basis for d in detections])
        try:
            frame = frame_of(samples, settings)
        except ValueError as error:
            raise TooLittleData(str(error), notes) from None
        simulator = Simulator(spacecraft, frame, samples.duration_s, present,
                              late=samples.staggered)
        if self.inputs is not None:
            simulator, samples, clipped = beside_inputs(simulator, samples, clipped, self.inputs)
            faults += faults_of_inputs(simulator, samples)
        raw = samples, clipped
        simulator, samples, recorded, levels = completed(simulator, *raw, settings)
        filled = np.isnan(samples.values).sum() < np.isnan(raw[0].values).sum()
        return spacecraft, simulator, Record(
            samples, recorded, detections, (), faults, notes + _used(samples, simulator.frame),
            raw if filled else ()), levels


def _used(samples, frame):
    """Return what of a record is used, in a sentence, where long gaps are not."""
    if not np.isnan(samples.values).any():
        return ()
    share = frame.segments * frame.rows / len(samples.values)
    return (f'{frame.segments} segments of {frame.span_s:.3g} s between the gaps are used, '
            f'{100 * share:.0f} % of the record',)


@dataclass(frozen=True, eq=False)
class Record:
    """A record made ready: samples without gaps, their spectra, what the samples alone show."""

    samples: object
    spectra: object
    detections: tuple
    sought: tuple           # effects that detectors search: those that are not in the model
    faults: tuple = ()      # `Fault`s of the recorder
    notes: tuple = ()       # what was left out of it, in sentences
    raw: tuple = ()         # where some were filled, the Samples before, and clipped values

    @property
    def missing(self):
        """Rows (n,) of which a sample was not recorded."""
        return np.isnan((self.raw[0] if self.raw else self.samples).values).any(axis=1)

    @property
    def unfilled(self):
        """Return the samples with NaN for what was filled, not what was clipped."""
        if not self.raw or not np.isnan(self.raw[1]).all():
            return self.samples
        lost = np.isnan(self.raw[0].values)
        return replace(self.samples, values=np.where(lost, np.nan, self.samples.values))
