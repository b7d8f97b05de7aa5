"""The nominal that an earlier recording gives, set beside a record: modes without geometry."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import effect_class, ModalPattern
from ssi_ros.effects.base import Site
from ssi_ros.effects.registry import showing
from ssi_ros.gap.check import TooLittleData
from ssi_ros.gap.comparison import Comparison, Detection, Fit, GapStatistic, Residual
from ssi_ros.gap.detectors.data_faults import faults_beside_recording
from ssi_ros.gap.inference.goodness_of_fit import compare
from ssi_ros.gap.nominal.forms.candidate import ModalCandidate
from ssi_ros.gap.nominal.modal.candidates import (
    candidates_of, mixed, parameters_of, SHIFTED, singles)
from ssi_ros.gap.nominal.modal.fit import fit, LITTLE, ratio, STEPS
from ssi_ros.gap.nominal.modal.localisation import localised
from ssi_ros.gap.nominal.modal.nonlinear_joint import joint, level_law
from ssi_ros.gap.nominal.modal.prediction import Averages, predict
from ssi_ros.gap.nominal.modal.starting_values import distance
from ssi_ros.gap.nominal.recordings import prepare
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.integrity.fault import as_reason
from ssi_ros.records import Samples
from ssi_ros.regimes.local_difference import local_difference
from ssi_ros.regimes.odd_channels import left_beside
from ssi_ros.tails import norm

FIRST_STEPS = 4         # of a fit, before the best are chosen
REFIT_STEPS = 3         # of a fit to a fold
FOLDS = 2               # interleaved halves of the groups of segments
PARTNERS = 4            # candidates that are tried beside the best one
SHARED_TESTS = 3        # gap, scores and frequencies of modes
UNMOVED = 1e6           # log odds against what moves no mode
MOVING = Site.STRUCTURE, Site.TIMING    # of effects that move frequencies


@dataclass(frozen=True, eq=False)
class RecordedNominal:
    """An earlier recording of the same structure as what is expected."""

    reference: Samples

    @property
    def channels(self):
        """Return the names of the channels that a record should have."""
        return self.reference.channels

    def compare(self, samples, settings, effects, progress=lambda share: None):
        """
        Set the recording beside a record; see `ModelNominal.compare`.

        At least one channel is in common, and the rates are in a ratio of small whole numbers.
        `settings` are not used: bands and segments follow from the recordings.

        Returns
        -------
        RecordedComparison

        """
        recordings = prepare(self.reference, samples, effects)
        progress(0.3)
        regime = recordings.regime
        faults = faults_beside_recording(self.reference, samples, recordings)
        if regime.refusal and not regime.site and not faults:
            raise TooLittleData(regime.refusal, recordings.notes)
        return RecordedComparison(recordings, faults)


class RecordedComparison(Comparison):
    """Two recordings as the protocol `Comparison` has them."""

    kind = 'reference'

    def __init__(self, recordings, faults=()):
        self.recordings, self.effects = recordings, recordings.effects
        self.notes = recordings.notes + tuple(f.text for f in faults) + recordings.regime.texts
        self.mismatch = as_reason(faults) or recordings.regime.refusal
        at = Site.TIMING if any(f.kind == 'scan skew' for f in faults) else Site.SENSOR
        self.site = at.value if as_reason(faults) else recordings.regime.site
        base = recordings.null
        self.null = Fit(ModalCandidate(), np.zeros(0), np.zeros((0, 0)), 0.0, base.x, base)
        self.gap = self.goodness_of_fit(self.null)
        self._joint = None

    def residual(self, fit):
        """Run all tests of the record against the null, or measure what another fit leaves."""
        recordings = self.recordings
        found, tests = recordings.detections
        shift = recordings.shift
        if (moved := shift if self.gap.deviations < LIMITS.far.value else recordings.moved).text:
            found += (Detection(showing(SHIFTED[0])[0], {}, moved.p_value, moved.text),)
        if fit is not self.null:
            rest = [d for d in (*found, *filter(None, self.joint[:1]))
                    if d.effect not in fit.candidate.names]
            odd = self._odd(fit)
            # halves show less than all groups do, which few numbers hardly fit by chance
            gap = max(self._held_out(fit), self.goodness_of_fit(fit), key=lambda g: g.deviations)
            # an event is where it is: nothing else that is steady makes it
            p_value = float(min([norm.sf(gap.deviations), self._unmoved(fit),
                                 *[d.p_value for d in rest if len(d.times)]]))
            joined = min([p_value, *[d.p_value for d in odd]])
            return Residual(None, tuple(rest), odd, gap, joined, p_value)
        test = recordings.score_test
        p_values = [test.p_value, norm.sf(self.gap.deviations), shift.p_value]
        p_values += [d.p_value for d in recordings.detections[0] if not d.weak]
        odd = self._odd(fit)
        joined, p_value = (float(min(1.0, (SHARED_TESTS + tests) * min(p))) for p in (
            [*p_values, *[d.p_value for d in odd]], p_values))
        return Residual(test, found, odd, self.gap, joined, p_value)

    def _odd(self, fit):
        """Return Detections of what a fit, or nothing at all, leaves that no effect makes."""
        found = left_beside(self.recordings, fit.candidate.names, self.gap.deviations)
        far = self.gap.deviations > LIMITS.far.value
        shift = self.recordings.moved
        if fit.candidate.names and self._unmoved(fit, LIMITS.clear_shift) < 1.0:
            found += (Detection('', {}, shift.p_value, f'{shift.text[0].upper()}{shift.text[1:]}.',
                                site=Site.STRUCTURE.value),)
        if far and fit.candidate.names:     # forms of modes are no more than near
            return found
        local = local_difference(self.recordings, fit.state.prediction, _record_without(
            self.recordings.two, fit.candidate.forms))
        return found + (local,) * bool(local and local.p_value < LIMITS.certain_shift.value)

    def _unmoved(self, fit, limit=LIMITS.certain_shift):
        """Return the chance of modes elsewhere that a fit leaves, 1 if it moves any."""
        # a line or noise near a mode draws its estimate by little; excitation and sensors by none
        shift = self.recordings.moved
        moving = any(effect_class(n).site in MOVING for n in fit.candidate.names)
        return 1.0 if moving or shift.p_value > limit.value else shift.p_value

    def elsewhere(self, fit):
        """Return the structure, where modes moved for certain and a fit moves none."""
        return Site.STRUCTURE.value if self._unmoved(fit) < 1.0 else None

    def _held_out(self, fit):
        """Return the gap on segments that the fit did not use, mean of the folds."""
        gaps = [self.goodness_of_fit(self.fit(fit.candidate, fit, fold), fold)
                for fold in range(FOLDS)]
        value, floor, std = np.mean([(g.value, g.floor, g.floor_std) for g in gaps], axis=0)
        return GapStatistic(float(value), float(floor), float(std / np.sqrt(FOLDS)))

    @property
    def joint(self):
        """Return the detection of a nonlinear joint, or None, and the log odds of its bursts."""
        if self._joint is None:
            self._joint = joint(self.recordings)
        return self._joint

    def candidates(self, residual):
        """Return the single effects that detections, scores, distances and modes speak for."""
        found = singles(self.recordings, self.joint, self.gap.deviations > LIMITS.far.value)
        times = {d.effect for d in self.recordings.detections[0] if len(d.times)}
        return tuple(c for c in found
                     if all(self.recordings.regime.allows(n, n in times) for n in c.names))

    def all_candidates(self):
        """Return every modal form as a candidate."""
        return tuple(ModalCandidate((f,)) for f in self.recordings.score_test.forms)

    def refinements(self, ranked):
        """Return shapes that turn, where one channel explains a gap, or some of it."""
        fit, of = ranked[0].fit, {f.pattern for f in ranked[0].fit.candidate.forms}
        if self.gap.deviations > LIMITS.far.value or not (
                ModalPattern.CHANNEL_SHAPE in of or ModalPattern.CHANNEL_FILTER in of
                and self.goodness_of_fit(fit).deviations > LIMITS.inside.value):
            return ()
        return candidates_of(self.recordings, mixed(self.recordings))

    def pairs(self, found, residual, ranked):
        """Return the best effect with each of the next, where its form can be blamed."""
        first = ranked[0].fit.candidate
        if first.approximation > LIMITS.modal_form.value:
            return ()
        return tuple(
            ModalCandidate((first.forms[0], r.fit.candidate.forms[0]))
            for r in ranked[1:1 + PARTNERS]
            if r.names != ranked[0].names
            and r.log_evidence - r.bonus + r.fit.candidate.bonus > 0.0)

    def fit(self, candidate, start=None, fold=None, thorough=True):
        """Fit a candidate to all groups, or to every second one; None if it cannot exist."""
        if fold is not None:
            return self._refit(candidate, start, fold)
        recordings, forms = self.recordings, candidate.forms
        one, two = recordings.one, _record_without(recordings.two, forms)
        same = start is not None and start.candidate.key == candidate.key
        # of forces whose levels are free, a distance says less than slopes beside them
        far = recordings.nominal.levels is None and self.gap.deviations > LIMITS.far.value and (
            sum(len(f.numbers) for f in forms) == 1)
        x = start.state.x if same else self._start(forms, two, LITTLE * far)
        found = fit(recordings.nominal, Averages(two.mean, one.freedom, two.freedom), forms, x,
                    STEPS if thorough else FIRST_STEPS, recordings.null.x, far)
        return self._fit(candidate, found) if np.isfinite(found.likelihood) else None

    def _refit(self, candidate, start, fold):
        """Fit a candidate to every second group, from where it is best for all of them."""
        recordings, forms, here = self.recordings, candidate.forms, start.state
        one, two = (_every_second(s, fold)
                    for s in (recordings.one, _record_without(recordings.two, forms)))
        nominal = recordings.nominal.with_spectrum(one.mean)
        record = Averages(two.mean, one.freedom, two.freedom)
        found = fit(nominal, record, forms, here.x, REFIT_STEPS)
        before = predict(nominal, forms, here.x).turned(here.turn)
        # slopes may lead away from there, if a change is large
        if self.gap.deviations > LIMITS.far.value and not (before.possible and ratio(
                before, record, nominal.trust) < ratio(found.prediction, record, nominal.trust)):
            found = here
        # the prediction of all groups stands in where that of others cannot be
        return self._fit(candidate, replace(found, prediction=here.prediction))

    def _start(self, forms, two, noise):
        """Return level, noise and coordinates at which a fit begins."""
        recordings, numbers = self.recordings, [x for f in forms for x in f.start]
        if not any(f.begin is not None or not f.numbers for f in forms):
            return np.append(recordings.null.x, numbers)
        # noise that stood in for an effect shall not stand in its way
        one = recordings.one
        level = distance(recordings.nominal, forms, numbers, two.mean, one.freedom, two.freedom)[1]
        return np.append([level, noise], numbers)

    def _fit(self, candidate, found):
        likelihood = found.far if self.gap.deviations > LIMITS.gross.value else found.likelihood
        law = self.recordings.nominal.law
        return Fit(candidate, found.x[2:], law * found.covariance[2:, 2:], likelihood / law,
                   found.x[:2], found)

    def goodness_of_fit(self, fit, fold=None):
        """Measure the gap of all groups, or of those outside a fold that the fit used."""
        recordings = self.recordings
        one, two = recordings.one, _record_without(recordings.two, fit.candidate.forms)
        prediction, (floor, spread) = fit.state.prediction, recordings.floor_factors
        if fold is not None:
            one, two = (_every_second(s, 1 - fold) for s in (one, two))
            there = predict(recordings.nominal.with_spectrum(one.mean), fit.candidate.forms,
                            fit.state.x).turned(fit.state.turn)
            prediction, floor = (there if there.possible else prediction), 1.0
        gap = compare(one, two, prediction, recordings.nominal.trust)
        return GapStatistic(gap.value, floor * gap.floor, spread * gap.floor_std)

    def bonus(self, fit, detections):
        """Return the log odds of the detections that the forms come from."""
        # what moves no mode is not the nearest where modes moved, unless all else is explained
        behind = self._unmoved(fit, LIMITS.clear_shift) < 1.0 and (
            self.goodness_of_fit(fit).deviations > LIMITS.inside.value)
        return fit.candidate.bonus - UNMOVED * behind

    def log_prior_ratio(self, fit):
        """Return the log of posterior over prior volume of a fit."""
        return fit.candidate.log_prior_ratio(fit.estimate, fit.covariance)

    def localise(self, fit=None, probability=0.0):
        """Return where the gap lies; a fit of all modes says which of them, if it is probable."""
        return localised(self.recordings, self.gap, fit if probability > 0.5 else None)

    def alike(self, found, ranked):
        """Return the effects whose forms are one without geometry."""
        candidate, others = ranked.fit.candidate, ()
        if self.recordings.regime.structural and self.recordings.clear_level:
            # a structure that is another at another level may be one that depends on it
            others = tuple(n for n in showing(level_law(self.recordings)) if n in self.effects)
        return tuple(dict.fromkeys((*candidate.names, *candidate.equivalents, *others)))

    def parameters(self, ranked, detections=()):
        """Return the coordinates of the forms with their intervals, and what was read off."""
        return parameters_of(ranked.fit)


def _record_without(two, forms):
    """Return the spectra of the record without the levels and cells that forms account for."""
    for form in forms:
        two = two if form.levels is None else two.levelled(form.levels)
        two = two if form.masked is None else two.without(form.masked)
    return two


def _every_second(spectra, first):
    return spectra.only(np.arange(first, len(spectra), 2))
