"""From the tests of the nominal to ranked candidates: single effects, distant sizes, pairs."""
from dataclasses import replace

from ssi_ros.gap.candidate import is_approximate
from ssi_ros.gap.selection.evidence import law_variance, log_posterior, Ranked
from ssi_ros.gap.selection.thresholds import SELECTION as LIMITS

KEPT = 6                # candidates that are fitted to the end, at most
RIVALS = 3              # and at least, however bad: what a wrong effect leaves is reported
PAIRS_TO_FIT = 4        # of each source
PLACES = 2              # of the same effects, at most


class Search:
    """Fits candidates on demand and keeps them in order; `found` is the null fit's residual."""

    def __init__(self, comparison, found, settings, progress):
        self.comparison, self.found, self.settings = comparison, found, settings
        self.progress = progress

    def singles(self):
        """Return the single effects that the tests speak for, fitted, best first."""
        comparison, null = self.comparison, self.comparison.null
        ranked = self.fitted(comparison.candidates(self.found), null, self.found.detections)
        if not ranked:
            return ranked
        done = {r.fit.candidate.kinds for r in ranked}
        nested = [c for c in comparison.refinements(ranked) if c.kinds not in done]
        return self.sorted(ranked + self.fitted(nested, ranked[0].fit, self.found.detections))

    def explaining(self, ranked):
        """
        Return the candidates in the order that their own residuals give, and what the best leaves.

        Sizes far from every start are tried where the residual is large, and candidates whose
        expected spectrum is approximate are corrected by the records that they simulate.
        """
        comparison = self.comparison
        residual = comparison.residual(ranked[0].fit)
        far = residual.gap.deviations > LIMITS['far'].value
        more = comparison.anywhere(residual) or (comparison.distant(ranked) if far else ())
        if more := self.fitted(more, comparison.null, self.found.detections):
            ranked = self.sorted(ranked + more)
            residual = comparison.residual(ranked[0].fit)
        ranked, residual = self.with_equivalents(ranked, residual)
        if residual.spectral_p_value < LIMITS['residual_p'].value:
            ranked = self.sorted(comparison.corrected(ranked))
            residual = comparison.residual(ranked[0].fit)
        return ranked, residual

    def with_equivalents(self, ranked, residual):
        """Return candidates with those that the best one stands for, and what the best leaves."""
        comparison = self.comparison
        if residual.p_value >= LIMITS['residual_p'].value:
            return ranked, residual
        alike = self.fitted(comparison.equivalents(ranked, residual), comparison.null,
                            self.found.detections)
        ranked = self.sorted(ranked + alike)
        return ranked, comparison.residual(ranked[0].fit) if alike else residual

    def wants_another(self, best, residual):
        """Return whether what the best candidate leaves calls for a second effect."""
        # an approximate form leaves something; an exact one is asked at the usual level
        limit = 'residual_p' if is_approximate(best.fit.candidate) else 'second_effect_p'
        return residual.p_value < LIMITS[limit].value

    def with_pairs(self, ranked, residual):
        """Return the candidates with pairs of effects among them, and what the best leaves."""
        comparison, single = self.comparison, ranked[0]
        # what the best effect explains alone is no merit of a second one
        kept = residual.detections + tuple(
            d for d in self.found.detections
            if d.effect in single.names or comparison.below_the_band(d))
        couples = comparison.pairs(self.found, residual, ranked)
        found = self.fitted(couples, single.fit, kept)
        if found:
            # a clock is as good as another stiffness beside anything
            known = {frozenset(r.names) for r in found}
            replaced = [c for c in comparison.indistinguishable(self.found, found[0].fit.candidate)
                        if frozenset(c.names) not in known]
            found = self.sorted(found + self.fitted(replaced, single.fit, kept))
        both = [self.weighed(replace(r, correction=single.correction)
                             if set(single.names) <= set(r.names) else r, single)
                for r in found]
        # what an approximate form leaves, of its own records as well, any second one takes some of
        margin = max(LIMITS['approximate_pair'].value, single.correction) * is_approximate(
            single.fit.candidate)
        both = [r for r in both if self.order(single) - self.order(r) > margin or not margin]
        ranked = sorted(ranked + both, key=self.order)
        if ranked[0] is not single:
            residual = comparison.residual(ranked[0].fit)
        return ranked, residual

    def weighed(self, pair, single):
        """Return a pair whose second effect counts beside a first one of no exact law, (113g)."""
        explained = single.log_evidence - self.comparison.null.log_likelihood
        variance = law_variance(explained, len(self.comparison.effects))
        more = max(pair.log_evidence - single.log_evidence, 0.0)
        return replace(pair, correction=pair.correction - (1 - 1 / variance) * more)

    def fitted(self, candidates, start, detections):
        """Fit all candidates a little, the best ones to the end; best first."""
        first, ways = [], []
        for i, candidate in enumerate(candidates):
            self.progress(i / len(candidates))
            if any(candidate.is_passed(*way) for way in ways):
                continue
            fit = self.comparison.fit(candidate, start, thorough=False)
            if fit is not None:
                ways.append((candidate, fit.candidate))
                first.append(self.ranked(fit, detections))
        first, done = self.sorted(first), []
        for ranked in first[:KEPT]:
            behind = first[0].log_evidence - ranked.log_evidence
            if len(done) >= RIVALS and behind > LIMITS['pruning_margin'].value:
                break
            # what is 30 deviations behind is shown, and needs no more than it has
            gain = first[0].fit.log_likelihood - self.comparison.null.log_likelihood
            if behind < max(LIMITS['far'].value ** 2 / 2, LIMITS['law_error'].value * gain):
                fit = self.comparison.fit(ranked.fit.candidate, ranked.fit)
                ranked = fit and self.ranked(fit, detections)
            done += [ranked] * bool(ranked)
        return self.sorted(done)

    def ranked(self, fit, detections):
        """Return a fit with the detections and the prior that speak for it."""
        return Ranked(fit, self.comparison.bonus(fit, detections),
                      self.comparison.log_prior_ratio(fit))

    def order(self, ranked):
        """Return the key by which candidates are sorted, best first."""
        return -log_posterior(ranked, self.settings, len(self.comparison.effects))

    def sorted(self, ranked):  # noqa: A003
        """Return the best candidate of each key, and at places hardly less likely, best first."""
        found = {}
        for r in sorted(ranked, key=self.order):
            kept = found.setdefault(r.fit.candidate.key, [])
            at = [k.fit.candidate.kinds for k in kept]
            near = not kept or self.order(r) - self.order(kept[0]) < LIMITS['other_mode'].value
            if near and r.fit.candidate.kinds in at:
                i = at.index(r.fit.candidate.kinds)
                kept[i] = replace(kept[i], others=(*kept[i].others, r))
            elif near and len(kept) < PLACES:
                kept.append(r)
        return sorted((r for kept in found.values() for r in kept), key=self.order)
