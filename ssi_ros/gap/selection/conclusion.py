"""From validated candidates to an answer: outcome, probabilities, classes, what to do next."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import effect_class
from ssi_ros.effects.base import Site
from ssi_ros.effects.likeness import OWN_ERROR, separate_by
from ssi_ros.gap.check import PARTIAL
from ssi_ros.gap.comparison import Comparison, Location, Residual
from ssi_ros.gap.diagnosis import Diagnosis, Explanation
from ssi_ros.gap.selection.cross_validation import reduction
from ssi_ros.gap.selection.evidence import beside_law, hidden_odds, posterior, Ranked, undetected
from ssi_ros.gap.selection.thresholds import SELECTION as LIMITS
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.open_set.families import FAMILIES
from ssi_ros.open_set.force_between import FAMILIES as OF_FORCES
from ssi_ros.quantity import p_equation
from ssi_ros.tails import norm

NOWHERE = (float('nan'),) * 3
CHANGE = 'unmodelled change'     # basis of its Detection
TRACES = 'The gap is large: lines, chirps and changes beside it may be traces of it.'
NO_VERDICT = {'effects': (), 'class': (), 'probability': 0.0}


@dataclass(frozen=True, eq=False)
class Case:
    """All that a conclusion is drawn from."""

    comparison: Comparison      # nominal and record
    settings: DiagnosisSettings     # prior probabilities and temperature
    found: Residual             # tests of the nominal without effects
    location: Location          # where the gap lies
    ranked: tuple = ()          # validated candidates, best first
    null: Ranked = None         # the nominal without effects, validated
    residual: Residual = None   # what the best candidate leaves
    controls: tuple = ()        # what is no explanation, validated like one

    @property
    def gap(self):
        """Return the gap of the nominal as the answer has it."""
        return {'before': self.found.gap.value, 'floor': self.found.gap.floor,
                'floor_std': self.found.gap.floor_std, 'p_value': self.found.p_value}

    @property
    def texts(self):
        """Return what detectors found, in sentences."""
        if self.residual is None or not self.ranked:
            shown = self.found.detections + self.found.anomalies
        else:
            # a mode that moved is like a line beside it: what its effect explains is not repeated
            names = self.ranked[0].names
            shown = tuple(d for d in self.found.detections if d.effect in names)
            shown += self.residual.detections + self.residual.anomalies
        # the open-set test also returns what is probable
        said = tuple(d.text for d in shown if d.text and _corrected(d) <= LIMITS['shown'].value)
        left = (self.residual or self.found).gap.deviations
        far = said and left > LIMITS['far'].value
        return self.comparison.notes + said + (TRACES,) * bool(far)

    @property
    def gain(self):
        """Return the log likelihood that the best candidate gains."""
        return self.ranked[0].fit.log_likelihood - self.null.fit.log_likelihood

    @property
    def oddest(self):
        """Return the clearest Detection of what no effect makes, beside the best, or None."""
        odd = min(self.residual.anomalies, key=_corrected, default=None)
        return odd if odd and _corrected(odd) <= LIMITS['shown'].value else None


def no_gap(case):
    """Return the answer where the record is what the nominal expects."""
    probability, small = undetected(case.found.score_test, case.comparison.effects, case.settings)
    none = _pseudo('none', probability, case.found.gap.value, NOWHERE, True)
    others = [_pseudo(n, p, float('nan'), NOWHERE, True)
              for n, p in sorted(small.items(), key=lambda item: -item[1])]
    rest = max(0.0, 1.0 - probability - sum(small.values()))
    others.append(_pseudo('unknown', rest, float('nan'), NOWHERE, True))
    partial = [n for n in case.comparison.notes if n.endswith(PARTIAL)]
    compared = 'the channels that were compared are' if partial else 'the record is'
    return Diagnosis(
        'WITHIN_FLOOR', '; '.join([
            f'{compared} what the {case.comparison.kind} expects ('
            f'{p_equation(case.gap["p_value"])})', 'smaller effects stay possible', *partial]),
        case.gap,
        replace(case.location, site=dict.fromkeys((s.value for s in Site), 0.0)),
        (none, *others), {**NO_VERDICT, 'probability': probability}, (), case.texts)


def not_comparable(case, reason):
    """Return the answer where the level alone says that record and nominal do not fit."""
    # what detectors find in such data follows from the same cause
    unknown = _pseudo('unknown', 1 - LIMITS['doubt'].value, case.gap['before'], NOWHERE, False)
    return replace(_unexplained(case, reason, unknown), signs=case.comparison.notes)


def too_little(reason, notes=()):
    """Return the answer where the record is too short."""
    nothing = float('nan')
    nowhere = Location((), (), (), (), None, dict.fromkeys((s.value for s in Site), 0.0))
    return Diagnosis('TOO_LITTLE_DATA', reason, dict.fromkeys(
        ('before', 'floor', 'floor_std', 'p_value'), nothing), nowhere,
        (_pseudo('unknown', 1.0, nothing, NOWHERE, False),), NO_VERDICT, (), notes)


def conclude(case):
    """Return the Diagnosis where there is a gap."""
    effects = len(case.comparison.effects)
    if not case.ranked:
        *_, unknown = posterior((), case.null, 1.0, case.found.p_value, effects, case.settings)
        return _unexplained(case, 'none of the effects considered explains any of the gap',
                            _pseudo('unknown', unknown, case.null.value, (0.0,) * 3, False))
    best, residual = case.ranked[0], case.residual
    # the least of as many families; it says no more against none than all tests do, (113c)
    anomaly = max(case.found.p_value, min([1.0, *map(_corrected, residual.anomalies)]))
    rest = _left(best, residual)
    if not is_inside(best, residual):
        # what a candidate leaves on segments that it was not fitted to counts too
        rest = min(rest, float(norm.sf(best.deviations)), LIMITS['residual_p'].value)
    shares, none, unknown = posterior(case.ranked, case.null, rest, anomaly, effects,
                                      case.settings)
    order = np.argsort(-shares, kind='stable')
    ranked, shares = [case.ranked[i] for i in order], shares[order]
    found = [_explanation(case, r, p) for r, p in zip(ranked, shares)]
    tied, verdict = _class_of(case, found, ranked, shares)
    # what is less probable than that nothing is wrong is not said
    quiet = none > min(LIMITS['decides'].value, max(verdict['probability'], unknown))
    if quiet:
        verdict = {**NO_VERDICT, 'probability': none}
    outcome, reason = _outcome(case, best, found[0], tied, (
        quiet, unknown > verdict['probability'], shares.sum()))
    if outcome == 'UNEXPLAINED':
        # that it is none of these, not the nearest of them
        verdict = {**NO_VERDICT, 'probability': unknown}
    verdict['hidden'] = float(hidden_odds(case.settings) * shares.sum())
    others = tuple(_pseudo(name, share, case.null.value, (0.0,) * 3, False)
                   for name, share in (('unknown', unknown), ('none', none)))
    rest = case.oddest, float(unknown)
    where = replace(case.location, site=_sites(case, ranked, shares, rest),
                    sensors=_sensors(case.location.sensors, ranked, shares, rest))
    return Diagnosis(
        outcome, reason, case.gap, where, tuple(found) + others, verdict,
        separate_by(verdict['class'] and verdict['class'] + _elsewhere(tied)), case.texts,
        tuple({'effects': c.names or ('none',), 'closed': reduction(case.null, c)[0]}
              for c in case.controls))


def is_inside(ranked, residual):
    """Return whether what a candidate leaves is inside the floor."""
    return ranked.inside and _left(ranked, residual) >= LIMITS['residual_p'].value


def _left(ranked, residual):
    """Return the p-value of what a candidate leaves; forces are no matter of a law of spectra."""
    return min([beside_law(residual.p_value, ranked.by_law)] + [
        max(a.p_value, residual.p_value) for a in residual.anomalies if a.basis in OF_FORCES])


def _outcome(case, best, top, tied, shares):
    """Return the outcome and the sentence that says why."""
    quiet, unknown, known = shares
    words = ' + '.join(top.effects)
    share = np.clip(top.closed, 0.0, 1.0)       # what exceeds all of it is noise
    removed = '' if np.isnan(share) else f'removes {100 * share:.0f} % of the gap and '
    removed += ('leaves nothing above its floor'
                if best.deviations <= LIMITS['residual_deviations'].value else
                f'leaves {best.deviations:.1f} standard deviations above its floor')
    if quiet:
        return 'WITHIN_FLOOR', (
            f'no effect explains the record better than chance does ('
            f'{p_equation(case.gap["p_value"])}); the nearest is {words}')
    if unknown or not is_inside(best, case.residual):
        if odd := case.oddest:
            shown = odd.text.removesuffix('.')
            return 'UNEXPLAINED', (f'{shown}, which no effect that was fitted makes; '
                                   f'beside that the nearest, {words}, {removed}')
        more = ', but something that no effect makes is more probable' * bool(unknown)
        return 'UNEXPLAINED', f'the nearest effect, {words}, {removed}{more}'
    equal = list(dict.fromkeys(' + '.join(e.effects) for e in tied))
    if top.probability < LIMITS['no_tie'].value * max(known, 1e-300) and len(equal) > 1:
        return 'TIED', f'{" and ".join(equal)} fit equally well; {words} {removed}'
    if case.comparison.own_error(best):
        return 'TIED', f'{words} and an error of the model within its declared uncertainty ' \
            f'look the same; {words} {removed}'
    if best.fit.candidate.equivalents:
        alike = (*top.effects, *best.fit.candidate.equivalents)
        return 'TIED', f'{", ".join(dict.fromkeys(alike))} cannot be distinguished here; ' \
            f'the change {removed}'
    return 'EXPLAINED', f'{words} {removed}'


def _class_of(case, found, ranked, shares):
    """Return the explanations that tie with the first, and the verdict with its class."""
    top, known = found[0], max(shares.sum(), 1e-300)
    tied = [e for e in found if len(e.effects) == len(top.effects)
            and (e.effects == top.effects
                 or e.probability > LIMITS['tied_share'].value * known)]
    # a form that is hardly less likely has its class too: all are approximate
    near = [r for r, p in zip(ranked, shares) if len(r.names) == len(top.effects)
            and p > LIMITS['near_form'].value * known]
    own = (OWN_ERROR,) * case.comparison.own_error(ranked[0])
    alike = dict.fromkeys(top.alike + own + tuple(n for e in tied for n in e.effects)
                          + tuple(n for r in near for n in r.fit.candidate.equivalents))
    return tied, {'effects': top.effects, 'class': tuple(alike),
                  'probability': float(sum(e.probability for e in tied))}


def _elsewhere(tied):
    """Return the effects of the best explanation once for every other place they may be at."""
    least = LIMITS['tied_share'].value * tied[0].probability
    return tuple(n for e in tied[1:] if e.effects == tied[0].effects and e.probability > least
                 for n in e.effects)


def _corrected(detection):
    """Return the p-value of a detection; the least of as many families is less by chance."""
    return detection.p_value * (len(FAMILIES) if detection.basis in FAMILIES else 1)


def _explanation(case, ranked, probability):
    share, low, high = reduction(case.null, ranked)
    detections = case.comparison.detected_beside(ranked, case.found.detections)
    return Explanation(
        ranked.names, float(probability), case.comparison.alike(case.found, ranked),
        case.comparison.parameters(ranked, detections), ranked.value, share, low, high,
        ranked.inside, case.comparison.built(ranked, detections))


def _pseudo(name, probability, gap, closed, inside):
    """Return the row of `none`, of `unknown`, or of an effect below the detection limit."""
    return Explanation((name,), probability, (name,), {}, gap, *closed, inside)


def _unexplained(case, reason, unknown):
    known = case.comparison.site
    sites = {s.value: float(s.value == known) for s in Site} if known else _sites(case, (), ())
    return Diagnosis('UNEXPLAINED', reason, case.gap, replace(case.location, site=sites),
                     (unknown,), NO_VERDICT | {'probability': unknown.probability}, (), case.texts)


def _sensors(sensors, ranked, shares, rest):
    """Return shares of the sensors: what names a channel speaks for it."""
    named = dict.fromkeys((s['name'] for s in sensors), 0.0)
    for r, p in zip(ranked, shares):
        for channel in r.fit.candidate.channels:
            if channel in named:
                named[channel] += float(p) / len(r.names)
    odd, unknown = rest
    if odd and odd.parameters.get('channel') in named:
        named[odd.parameters['channel']] += unknown
    rest = max(0.0, 1.0 - sum(named.values()))
    return tuple({**s, 'share': named[s['name']] + rest * s['share']} for s in sensors)


def _sites(case, ranked, shares, rest=(None, 0.0)):
    """Return the share of every site: by the candidates, the nearest if none, or by scores."""
    sites = dict.fromkeys((s.value for s in Site), 0.0)
    if len(shares) and np.sum(shares) < 1e-9:
        shares = np.eye(len(shares))[0]
    for r, p in zip(ranked, shares):
        if elsewhere := case.comparison.elsewhere(r.fit):
            sites[elsewhere] += float(p)
            continue
        # effects of one form are equally probable
        names = r.names + r.fit.candidate.equivalents * (len(r.names) == 1)
        for name in names:
            sites[effect_class(name).site.value] += float(p) / len(names)
    if sum(sites.values()) < 1e-9:
        for owners, z in zip(case.found.score_test.owners, case.found.score_test.z):
            site = effect_class(owners[0]).site.value
            sites[site] = max(sites[site], float(z) ** 2)
    odd, unknown = rest
    total = max(sum(sites.values()), 1e-300)
    if odd and odd.site:
        # what the shape of a residual says counts as it does beside what the nearest explains
        of_odd = 1.0 if odd.basis != CHANGE else (
            odd.log_odds / (odd.log_odds + max(case.gain, 0.0)))
        sites = {s: v * (1 + (1 - of_odd) * unknown / total) for s, v in sites.items()}
        sites[odd.site] += of_odd * unknown
    total = max(sum(sites.values()), 1e-300)
    return {s: v / total for s, v in sites.items()}
