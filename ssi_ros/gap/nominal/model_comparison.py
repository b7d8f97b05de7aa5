"""A spacecraft model beside a record: tests, candidates and fits for the driver."""
from dataclasses import replace
from functools import cached_property
from operator import attrgetter

import numpy as np

from ssi_ros.bootstrap.correction import corrected
from ssi_ros.bootstrap.indirect_inference import indirect_estimate
from ssi_ros.bootstrap.parametric_bootstrap import bootstrap_floor, BootstrapTests, HALF_STEPS
from ssi_ros.bootstrap.score_scatter import scatter_of
from ssi_ros.effects import places
from ssi_ros.effects.equivalent_hinges import beside_linear, equivalent_hinges, extensions
from ssi_ros.events.blocks import explained_below_band, search
from ssi_ros.gap.candidate import Candidate, is_approximate, priors_of
from ssi_ros.gap.comparison import Comparison
from ssi_ros.gap.detectors import tests_of
from ssi_ros.gap.inference.goodness_of_fit import measure
from ssi_ros.gap.inference.model_fit import fit, fit_again, STEPS
from ssi_ros.gap.inference.score_test import directions, score
from ssi_ros.gap.inference.unmodelled.scores import detect_change, score_changes
from ssi_ros.gap.nominal import (
    model_answer as answer, model_location as location, starting_points as starts)
from ssi_ros.gap.nominal.distant import a_little_fitted, anywhere, distant
from ssi_ros.gap.selection.evidence import log_prior_ratio
from ssi_ros.gap.selection.localisation import locate
from ssi_ros.gap.selection.search import PAIRS_TO_FIT
from ssi_ros.gap.selection.thresholds import SELECTION as LIMITS
from ssi_ros.gap.spectra.imputation import filled
from ssi_ros.inputs.beside import remainder
from ssi_ros.levels.held_out import held_out
from ssi_ros.regimes.odd_channels import beside_model, left_beside_model
from ssi_ros.tails import norm
from ssi_ros.template_cache import effect_templates, unmodelled_templates
from ssi_ros.updating.comparable import comparable
from ssi_ros.updating.prior import stand
from ssi_ros.updating.systematic_errors import parameters

FIRST_STEPS = 6         # of a fit, before the best are chosen


class ModelComparison(Comparison):
    """A model beside a record; see `ssi_ros.gap.comparison.Comparison`."""

    kind, built = 'model', staticmethod(answer.built)
    corrected, parameters, distant, anywhere = corrected, parameters, distant, anywhere  # methods
    notes, mismatch, doubtful = (property(attrgetter(f'comparable.{name}')) for name in (
        'notes', 'mismatch', 'doubtful'))

    def __init__(self, simulator, record, settings, effects, levels, progress, prior=None):
        self.simulator, self.record, self.settings = simulator, record, settings
        self.effects, self.prior, self.progress = effects, prior, progress
        self.here = stand(simulator, prior, levels, settings)
        self._best, self._fits, self._made = -np.inf, {}, {}

    @cached_property
    def null(self):
        """Return the fit without effects."""
        return answer.fit_of(fit(self.simulator, self.record.spectra, levels=self.here.levels,
                                 uncertainty=self.here.uncertainty), self.here)

    @cached_property
    def comparable(self):
        """Return whether record and model can be compared, a Comparable."""
        return comparable(self.simulator, self.record, self.null.state, self.here.levels)

    @cached_property
    def templates(self):
        """Return the Templates of effects around the model."""
        return effect_templates(self.simulator.for_templates(self.here.levels), self.settings,
                                self.effects, self.progress)

    @cached_property
    def unmodelled(self):
        """Return those of changes that no effect makes."""
        return unmodelled_templates(self.simulator.for_templates(self.here.levels), self.settings)

    def fit(self, candidate, start=None, fold=None, thorough=True):
        """Fit a candidate; see `Comparison`."""
        key = candidate, start and start.candidate, fold, thorough
        if key not in self._fits:
            self._fits[key] = self._fit(candidate, start, fold, thorough)
        return self._fits[key]

    def side(self, fit):
        """Return the Side that a fit stands on."""
        return self.here

    def templates_of(self, fit):
        """Return the templates that scores around a fit are taken of."""
        return self.templates

    def _fit(self, candidate, start, fold, thorough):
        start = start or self.null
        side, levels, spectra = self.side(start), start.levels, self.record.spectra
        if fold is not None:
            simulator = side.simulator.with_motion_of(spectra, candidate, levels)
            return answer.fit_of(fit_again(simulator, spectra.halves[fold], start.state,
                                           HALF_STEPS, side.uncertainty), side)
        hopeless = self._best - LIMITS['hopeless'].value
        if thorough:
            # what is not known around a candidate decides between those that are probable
            near = start.log_likelihood > hopeless
            return answer.fit_of(fit(
                side.simulator, spectra, candidate, levels, STEPS,
                side.around(candidate, levels) if near else side.uncertainty), side)
        found = answer.fit_of(fit(side.simulator, spectra, candidate, levels, FIRST_STEPS,
                                  side.uncertainty, hopeless), side)
        self._best = max(self._best, found.state.likelihood if found else -np.inf)
        return found

    def goodness_of_fit(self, fit, fold=None):
        """Measure the gap, of all segments or of those that a fold left out."""
        spectra = self.record.spectra
        expected = self.side(fit).raised(fit.state.model, spectra)
        if fold is not None:
            expected, spectra = held_out(fit.state, spectra, fold)
        gap = measure(expected, spectra, self.settings.band_bins)
        return replace(gap, floor_std=gap.floor_std * self.scatter.gap)

    def detections(self, fit):
        """Return detections of effects that a fit does not hold, and anomalies."""
        names = tuple(n for n in self.record.sought if n not in fit.candidate.names)
        # what fills a gap without an effect looks like an event beside it
        record = self.record.samples if fit is self.null else self.record.unfilled
        found, odd = search(*self.whole(fit, record), self.settings, names, self.record.missing)
        found = tuple(d for d in self.record.detections if d.effect in names) + found
        every = self._once('odd', (self.record,), lambda: beside_model(self))
        return found, left_beside_model(odd, every, fit.candidate.names, found), tests_of(names)

    def whole(self, fit, samples):
        """Return a model side, a fit, and samples with their gaps filled, to search in time."""
        simulator = self.side(fit).simulator
        if simulator.recorded:
            simulator, samples = remainder(simulator, samples, fit.levels, fit.candidate)
        return simulator, fit.state, filled(simulator, samples, fit.levels, fit.candidate)

    def score_test(self, fit):
        """Score all effects at once around a fit."""
        # what is the opposite of an effect may be what is not known of the model
        return answer.score_test_of(self._scores(
            fit.state, self.side(fit), self.templates_of(fit)), self.scatter.scores,
            bool(self.prior))

    def _scores(self, state, side, of=None):
        here = self.directions if state.plain is self.null.state.plain else None
        return score(of or self.templates, state, self.record.spectra, side.uncertainty, here)

    @cached_property
    def directions(self):
        """Return the templates as the model without effects whitens them."""
        spectra, side = self.record.spectra, self.here
        return directions(self.templates, self.null.state, spectra, side.uncertainty)

    @cached_property
    def scatter(self):
        """Return the Scatter of all tests, larger than 1 where segments are correlated."""
        return scatter_of(self.simulator, self.null.state, self.record.spectra, BootstrapTests(
            self.templates, self.unmodelled, self.here.uncertainty, self.settings))

    def residual(self, fit, simulated=True):
        """Run all tests; if they fail, against what the fit leaves of records it simulates."""
        found, tests = self._once('tests', (fit,), lambda: self._tested(fit))
        far = found.gap.deviations > LIMITS['far'].value and not is_approximate(fit.candidate)
        if not simulated or far or fit is self.null or (
                found.p_value >= LIMITS['second_effect_p'].value):
            return found
        return self._once('floor', (fit,), lambda: self._against_floor(fit, *tests))

    def _once(self, what, of, make):
        """Return what is made of some objects, the same ones once only."""
        key = what, *map(id, of)
        if key not in self._made:       # kept with the objects: another may have an id anew
            self._made[key] = of, make()
        return self._made[key][1]

    def _tested(self, fit):
        """Return the Residual of all tests, and what of them a floor is asked for."""
        test, gap = self.score_test(fit), self.goodness_of_fit(fit)
        found, odd, trials = self.detections(fit)
        spectra, side = self.record.spectra, self.side(fit)
        changes = score_changes(self.unmodelled, fit.state, spectra, side.uncertainty)
        errors = side.chance_of_errors(fit.state, spectra.frame)
        p_values = float(norm.sf(gap.deviations)), gap.local_p_value(spread=self.scatter.bands)
        every = odd + detect_change(replace(changes, z=changes.z / self.scatter.changes))
        return answer.joined_tests(test, gap, (*p_values, errors), found, every, trials), (
            test, gap, errors, changes, found, odd, trials)

    def _against_floor(self, fit, test, gap, errors, *rest):
        """Return the Residual beside what the fit leaves of records that it simulates."""
        changes, found, odd, trials = rest
        floor = self.simulated_floor(fit, found, odd)
        scores, p_values, found, odd = floor.against(test.state, changes, gap, found, odd)
        test = answer.score_test_of(scores, signed=bool(self.prior))
        return replace(answer.joined_tests(
            test, gap, (*p_values, errors), found, odd, trials), floor=floor)

    def simulated_floor(self, fit, detections=(), odd=()):
        """Return what a fit leaves of records that it simulates, of a model where it stands."""
        side = self.side(fit)
        return bootstrap_floor(side.simulator, fit.state, self.indirect(fit), BootstrapTests(
            self.templates_of(fit), self.unmodelled, side.uncertainty.centred, self.settings,
            detections, odd))

    def indirect(self, fit):
        """Return the indirect-inference estimate of a fit."""
        side = self.side(fit)
        return self._once('estimate', (fit,), lambda: indirect_estimate(
            side.simulator, fit.state, side.uncertainty.centred, self.settings.band_bins))

    def estimate(self, fit, residual):
        """Return what a simulator has to be given, with its scatter."""
        found, ratio = self.indirect(fit), residual.floor.std_ratio if residual.floor else 1.0
        return replace(found, spread=found.spread * ratio)

    def candidates(self, residual):
        """Return the starts that scores and detections speak for."""
        found = [d.basis for d in residual.detections] + starts.of_lines(
            residual, self.effects, self.simulator.spacecraft)
        both = self._scores(self.null.state.without_errors, self.here), residual.score_test.state
        likely = starts.undetected(starts.likely(both, self.null, self.settings), residual)
        return tuple(Candidate((e,)) for e in beside_linear(
            likely + found, lambda e: self.fit(Candidate((e,)), self.null, thorough=False)))

    def all_candidates(self):
        """Return every start of every effect."""
        return tuple(map(Candidate, zip(self.templates.effects)))

    def refinements(self, ranked):
        """Return laws that contain the best one."""
        best = ranked[0].fit.candidate.effects[0]
        return tuple(map(Candidate, zip(extensions(best, self.effects))))

    def equivalents(self, ranked, residual):
        """Return laws whose equivalent linear hinge the best one is, and it at other places."""
        best, of = ranked[0].fit, self.side(ranked[0].fit).simulator.setup
        alike = equivalent_hinges(best.candidate.effects[0], self.effects, lambda e: of(
            Candidate((e,)), best.levels))
        moved = starts.in_other_basins(best.candidate.effects[0], residual.score_test.state)
        return tuple(c for each in (*alike, moved) for c in a_little_fitted(
            self, each, uncertainty=self.here.uncertainty)[:1])

    def pairs(self, found, residual, ranked):
        """Return the pairs that explain most together; far away no score promises any."""
        one, far = ranked[0].fit, found.gap.deviations > LIMITS['far'].value
        rest, none = (self._scores(f.state.without_errors, self.side(f)) for f in (one, self.null))
        more = [e for s in (residual.score_test.state, rest) for e in starts.promising(
            s, PAIRS_TO_FIT)] + [d.basis for d in residual.detections]
        pairs = [one.candidate.with_one_more(e) for e in more
                 if e.answer not in one.candidate.names]
        pairs += map(Candidate, starts.promising_pairs(none, 0 if far else PAIRS_TO_FIT))
        pairs += self.anywhere(residual, one)
        # a law of many numbers stands in for what is left of any effect that is not one itself
        law = any(e.law_of for e in one.candidate.effects)
        return tuple({c.kinds: c for c in reversed(pairs) if law or not any(
            e.law_of for e in c.effects)}.values())

    def indistinguishable(self, found, candidate):
        """Return candidates with one effect replaced by a nearly indistinguishable one."""
        return tuple(starts.replacements(found.score_test.state, candidate))

    def bonus(self, fit, detections):
        """Return the log odds of detections beyond what the spectrum has of them already."""
        total, seen = 0.0, {d.effect: d for d in detections}
        for e in fit.candidate.effects:
            if e.name in seen:
                alone = self.fit(Candidate((e,)), self.null, thorough=False)
                shown = alone.log_likelihood - self.null.log_likelihood if alone else 0.0
                total += answer.beyond_spectrum(e, seen[e.name], max(shown, 0.0))
        return total + self._once('below', (fit, *detections), lambda: explained_below_band(
            lambda: self.whole(fit, self.record.samples), fit.candidate.names, self.settings,
            detections))

    def log_prior_ratio(self, fit):
        """Return the log of posterior over prior volume of quantities and places."""
        counts = [max(1, sum(1 for _ in places(type(e), self.simulator.spacecraft)))
                  for e in fit.candidate.effects]
        return log_prior_ratio(priors_of(fit.candidate), fit.covariance) - np.log(counts).sum()

    def own_error(self, ranked):
        """Return whether the model's own error, as declared, is the same as the effects."""
        return not self.prior and all(
            e.deviations(self.simulator.spacecraft) <= LIMITS['own_error'].value
            for e in ranked.fit.candidate.effects)

    def alike(self, found, ranked):
        """Return the effects whose templates are those of a candidate."""
        return answer.alike(found.score_test.state, ranked.names, self.settings.tie_cosine)

    def localise(self, fit=None, probability=0.0):
        """Return where the gap lies; with a fit, what it changes counts by its probability."""
        here, spectra, bins = self.null.state.model, self.record.spectra, self.settings.band_bins
        measured = location.measured(self.simulator.setup(Candidate()).system, here, spectra, bins)
        if fit is None:
            return locate(measured)
        events = next((d.times for d in self.residual(self.null).detections
                       if len(d.times) and d.effect in fit.candidate.names), ())
        change = location.change((here, fit.state.model), spectra, bins, events, probability)
        return replace(locate(measured, change), sensors=())
