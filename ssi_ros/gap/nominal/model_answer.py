"""What a diagnosis against a model says of a candidate: its quantities, and what looks alike."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects import effect_class
from ssi_ros.effects.base import is_log
from ssi_ros.gap.comparison import Fit, LEAST_CHANCE, Residual, ScoreTest
from ssi_ros.gap.detectors.thresholds import LIMITS as DETECTION
from ssi_ros.gap.diagnosis import Value
from ssi_ros.open_set.families import FAMILIES, joined

Z90 = 1.645             # standard deviations to both sides of a 90 % interval
SCORE_SHARE = 0.5       # of the alarm budget,
OPEN_SHARE = 0.22       # and of the open-set test; all other tests share the rest alike
STATISTICS = 3          # the gap, over all frequencies and in the worst stretch, and errors


def alike(scores, names, limit):
    """Return the effects whose templates cannot be distinguished from those of some names."""
    all_names, found = np.array([e.answer for e in scores.effects]), list(names)
    rows = np.flatnonzero(all_names == names[0]) if len(names) == 1 else []
    if len(rows):
        # the template that explains most stands for the effect
        row = rows[np.argmax(np.abs(scores.z[rows]))]
        found += list(all_names[np.abs(scores.cosine[row]) > limit])
    return tuple(dict.fromkeys(map(str, found)))


def built(ranked, detections):
    """Return the effects of a candidate as a simulator has to be given them."""
    return tuple(_of_detection(e, detections)
                 for e in (ranked.estimate or ranked.fit).candidate.effects)


def parameters(ranked, detections):
    """Return the quantities of a candidate with their intervals, by `effect.quantity`."""
    candidate = (ranked.estimate or ranked.fit).candidate
    spread = ranked.estimate.spread if ranked.estimate else 1.0
    stds = spread * np.sqrt(np.maximum(np.diag(ranked.fit.covariance), 0.0))
    detected, found = {d.effect: d.stds for d in detections}, {}
    moved = list(candidate.numbers())
    for i, e in enumerate(built(ranked, detections)):
        for f in e.numbers():
            at = [k for k, (j, g) in enumerate(moved) if j == i and g.name == f.name]
            value, log = getattr(e, f.name), is_log(f) and e.spectral
            if at and e is candidate.effects[i]:
                std = stds[at[0]] * (value if log else 1.0)
            else:
                std = detected.get(e.name, {}).get(f.name, float('nan'))
            # 90 % to both sides, of the logarithm where a fit moves that
            low, high = (value * np.exp(s * Z90 * std / value) if log else value + s * Z90 * std
                         for s in (-1, 1))
            found[f'{e.answer}.{f.name}'] = Value(
                value, float(std), float(max(low, f.metadata['low'])),
                float(min(high, f.metadata['high'])), f.metadata['unit'])
    for other in (parameters(r, detections) for r in ranked.others):
        if other.keys() == found.keys():        # not of another law
            found = {k: replace(v, low90=min(v.low90, other[k].low90),
                                high90=max(v.high90, other[k].high90)) for k, v in found.items()}
    return found


def _of_detection(effect, detections):
    """Return an effect as its detection has it, where that shows what the fitted band does not."""
    for d in detections:
        # what drives an input may have been corrected since, see `transfer_doubt`
        driven = effect.driven_hz()
        if d.effect == effect.name and (effect.spectral or driven and (
                driven == d.basis.driven_hz())):
            if all(d.parameters[f.name] == getattr(effect, f.name) for f in effect.words()):
                return d.basis
    return effect


def beyond_spectrum(effect, detection, shown):
    """
    Return what a detection adds to the log likelihood that the spectrum shows of its effect.

    A line has been searched at many frequencies. Its detection has paid for them, while no fit
    moves its numbers: so its odds count, not what the spectrum shows at the best of all places.
    """
    odds = detection.log_odds
    if detection.p_value < LEAST_CHANCE:    # the odds are larger
        odds = max(odds, shown - np.log(detection.trials))
    return max(odds - shown, 0.0) if effect.spectral else odds - shown


def fit_of(found, side):
    """Return the record that all nominals share of a fit on a Side, or None."""
    return None if found is None else Fit(
        found.candidate, np.array(found.candidate.point()), found.covariance,
        found.likelihood + side.log_density, found.levels, found)


def score_test_of(scores, scatter=1.0, signed=False):
    """Return the ScoreTest that all nominals share; `scatter`, (t,), and sign of the scores."""
    found = replace(scores, z=scores.z / scatter)
    return ScoreTest(
        found.effects, tuple((e.answer,) for e in found.effects), found.z,
        np.array([e.one_sided() for e in found.effects]), found.gains(),
        found.p_value(signed), scores)


def refuted(test, false_alarm):
    """Return whether the scores alone say that there is a gap, whatever other tests say."""
    return test.p_value <= SCORE_SHARE * false_alarm


def joined_tests(test, gap, p_values, detections, odd, trials):
    """Join all tests: the scores have most of the alarm budget, the others share the rest."""
    others = (1 - SCORE_SHARE - OPEN_SHARE) / (trials + STATISTICS)
    unknown = joined([d.p_value for d in odd if d.basis in FAMILIES])

    def together(found):
        rest = min([*p_values] + [d.p_value for d in found if d.basis not in FAMILIES])
        return float(min(1.0, test.p_value / SCORE_SHARE, unknown / OPEN_SHARE, rest / others))
    shown = tuple(d for d in odd if d.p_value <= DETECTION.p_value.value)
    return Residual(test, detections, shown, gap, together(detections + odd),
                    together(tuple(d for d in detections
                                   if effect_class(d.effect).in_mean_spectrum) + odd))
