"""A model that may be wrong, beside a record: every candidate at errors of its own."""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.comparison import Fit
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.score_test import make_templates
from ssi_ros.gap.nominal.model_answer import fit_of
from ssi_ros.updating.adapt import Adapted, beside
from ssi_ros.updating.calibrated_comparison import CalibratedComparison
from ssi_ros.updating.prior import stand
from ssi_ros.updating.settled import leaves_nothing

FIRST_STEPS = 8         # of a fit of a candidate and all errors, before the best are chosen
STEPS = 20              # of theirs, in a round
ROUNDS = 4              # at most
REFUTED = 100.0         # nats, to second order
LEAST_GAIN = 0.1        # nats, of one round
STILL_RISING = 10.0     # nats of one round, after which there is another one
LEVEL_STEPS = 4         # of the levels without what is detected again


class AdaptedComparison(CalibratedComparison):
    """
    A CalibratedComparison whose fits move the errors of the model together with the candidate.

    Errors that are fitted without an effect have taken up what it changes, often by more than a
    linear change describes. So each candidate is fitted with all errors beside, and stands on a
    side of its own. What cannot be differentiated at once (joints with laws, levels that vary) is
    fitted on the side of the fit that it begins at, the errors as linear directions.
    """

    def __init__(self, simulator, adapted: Adapted, record, settings, effects, progress):
        self.bare, self._templates, self._detections = simulator, {}, {}
        super().__init__(adapted.simulator, record, settings, effects, adapted.fit.levels[0],
                         progress, adapted.prior)
        self.occam, self._highest = adapted.fit.occam, -np.inf
        self.here = replace(self.here, adapted=adapted)

    def needs_errors(self, fit):
        """Return whether the record refutes that the errors beside a fit are zero."""
        found = self.side(fit).adapted.fit
        unit = found.values / found.stds
        return unit @ found.information @ unit / 2 > REFUTED

    def templates_of(self, fit):
        """Return the templates around the errors that a fit stands at."""
        side = self.side(fit)
        if side is self.here:
            return self.templates
        if id(side) not in self._templates:
            # what errors take back of an effect depends on where they are
            found = make_templates(side.simulator, self.templates.effects)
            self._templates[id(side)] = (
                found if found.effects == self.templates.effects else self.templates)
        return self._templates[id(side)]

    def _fit(self, candidate, start, fold, thorough):
        if fold is None and candidate.effects:
            if start and start.candidate == candidate and id(start.state) in self._sides:
                return self._finished(start) if thorough else start     # it is there already
            found = self._together(candidate, start or self.null, thorough)
            if found is not None:
                return found if thorough else self._risen(found, start or self.null)
        return super()._fit(candidate, start, fold, thorough)

    def _around(self, found, side):
        """Return a fit where it stands: what moves its errors is `_together`."""
        return self._standing(found, side)

    def _risen(self, found, before):
        """Return a first fit that a few steps more do not raise by much, unlike the last ones."""
        last = 0.0
        for _ in range(ROUNDS):
            gain = found.log_likelihood - before.log_likelihood
            behind = self._highest - found.log_likelihood
            # what rises ever more slowly, a geometric series, does not catch up
            if gain < STILL_RISING or gain < last and gain ** 2 / (last - gain) < behind:
                break
            last, before = gain, found
            found = self._together(found.candidate, found, False) or found
        self._highest = max(self._highest, found.log_likelihood)
        return found

    def _finished(self, found):
        """Return a fit that more steps do not raise: along a ridge they are short."""
        for _ in range(ROUNDS):
            more = self._together(found.candidate, found, True)
            if more is None:
                break
            gain, found = more.log_likelihood - found.log_likelihood, more
            if gain < LEAST_GAIN:
                break
        return self._detected_again(found)

    def _detected_again(self, found):
        """Return a fit whose detected effects are as they are beside its own errors."""
        # errors that were fitted without a line have taken up a third of it; what the samples
        # alone show, as clipping, is the same beside any errors
        names = {e.name for e in found.candidate.effects if not e.spectral} - {
            d.effect for d in self.record.detections}
        for _ in range(ROUNDS if names else 0):
            side = self.side(found)
            bare = fit(side.simulator, self.record.spectra, Candidate(), side.levels, LEVEL_STEPS,
                       side.uncertainty)
            if bare is None:
                break
            own = {d.effect: d for d in self.detections(
                self._standing(fit_of(bare, side), side))[0]}
            more = self._together(Candidate(tuple(
                own[e.name].basis if e.name in names & own.keys() else e
                for e in found.candidate.effects)), found, True)
            gain = more.log_likelihood - found.log_likelihood if more else 0.0
            if gain <= 0.0:
                break
            found = more
            self._detections[id(found.state)] = own
            if gain < LEAST_GAIN:
                break
        return found

    def corrected(self, ranked):
        """Leave out what linear errors make too likely, where another candidate leaves nothing."""
        # beyond their linear range errors raise a likelihood that no such model has
        own = [r for r in ranked if self.side(r.fit).candidate == r.fit.candidate]
        if own and own[0] is not ranked[0] and any(leaves_nothing(self, r.fit) for r in own):
            ranked = [r for r in ranked if r in own or leaves_nothing(self, r.fit)]
        return super().corrected(ranked)

    def detected_beside(self, ranked, detections):
        """Return detections as they are beside the errors of a candidate."""
        own = self._detections.get(id(ranked.fit.state), {})
        return super().detected_beside(ranked, tuple(own.get(d.effect, d) for d in detections))

    def found_on(self, fit):
        """Return the Side that the detections of a candidate were found beside."""
        return self.side(fit) if id(fit.state) in self._detections else self.here

    def _together(self, candidate, start, thorough) -> Fit:
        """Return the fit of a candidate and all errors, None where only linear errors will do."""
        adapted = beside(self.bare, self.record.samples, self.settings, self.side(start).adapted,
                         candidate, STEPS if thorough else FIRST_STEPS)
        if adapted is None:
            return None
        simulator, levels = adapted.simulator.but(compensation=None), adapted.fit.levels[0]
        side = stand(simulator, adapted.prior, levels, self.settings, adapted.fit.candidate,
                     occam=adapted.fit.occam - self.occam, adapted=adapted)
        # it is at its best: steps with linear errors would only lead away from it
        found = fit(simulator, self.record.spectra, adapted.fit.candidate, levels, 0,
                    side.uncertainty if thorough else side.heights)
        return found and self._standing(fit_of(replace(
            found, covariance=adapted.fit.of_candidate), side), side)
