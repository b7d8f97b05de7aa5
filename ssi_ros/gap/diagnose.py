"""Diagnose the gap between a model and a record: is there one, where, why, what is left."""
from functools import lru_cache

import numpy as np
from scipy.stats import norm

from ssi_ros.effects import effect_class, library
from ssi_ros.effects.base import is_log, Site
from ssi_ros.gap.candidate import Candidate, from_coordinate, starting_points
from ssi_ros.gap.check import match
from ssi_ros.gap.diagnosis import Diagnosis, Explanation, Value
from ssi_ros.gap.fit import fit, Simulator
from ssi_ros.gap.likelihood import Evidence
from ssi_ros.gap.meter import measure
from ssi_ros.gap.rank import closed, posterior, try_held_out
from ssi_ros.gap.scores import line_search, make_templates, score
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra import make_frame, spectra
from ssi_ros.gap.symptoms import jolts, symptoms
from ssi_ros.gap.where import locate

SURE = 50.0             # log odds of a sign that cannot be chance
LEFT_OVER = 3e-3        # p-value of what is left, below which a candidate does not explain
CLOSE = 3.0             # held-out log odds within which two candidates are tied
FIRST_STEPS = 4         # of a fit, before the best TRIED are chosen
TRIED = 3               # fits that go on to the end, and to held-out pieces
MOST_PAIRS = 4          # second effects that are fitted beside the best one
TRIALS = 4              # tests for a gap: scores, lines, jolts, meter


def diagnose(spacecraft, samples, settings=DiagnosisSettings(), *, effects=None, pairs=True,
             present=(), progress=None):
    """
    Diagnose the gap between a simulator and a recording.

    Parameters
    ----------
    spacecraft : Spacecraft
        The nominal model.
    samples : Samples
        The record, on an even grid, NaN where a sample is missing.
    settings : DiagnosisSettings
        See there.
    effects : sequence of str, optional
        Names of the effects to consider; all by default.
    pairs : bool
        Whether to look for two effects where one does not suffice.
    present : tuple of Effect
        Effects that the simulator already has, as a corrected configuration does.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Diagnosis

    Raises
    ------
    ValueError
        If record and model do not fit each other, or an effect is not known.

    """
    tell = progress or (lambda share: None)
    names = tuple(effect_class(n).name for n in effects) if effects else tuple(library())
    samples = match(spacecraft, samples)
    try:
        frame = make_frame(len(samples.values), samples.rate_hz, settings,
                           ~np.isnan(samples.values).any(axis=1))
    except ValueError as error:
        return _too_little(str(error))
    duration_s = len(samples.values) / samples.rate_hz
    simulator = Simulator(spacecraft, frame, duration_s, present)
    evidence = Evidence(frame, spectra(samples, frame), tuple(range(frame.pieces)))
    nominal = fit(simulator, evidence)
    templates = _templates(spacecraft, len(samples.values), settings, names, present, tell)
    scores = score(templates, nominal.model, evidence)
    line = line_search(simulator, nominal.model, evidence)
    there = {e.name for e in present}
    signs = [s for s in symptoms(samples) if s.effect.name in names and s.effect.name not in there]
    jolt = jolts(simulator, nominal, evidence) if 'impulsive_events' in names else None
    if jolt is not None:
        signs.append(jolt)
    meter = measure(nominal.model, evidence, settings.band_bins)
    tests = [scores.p_value(), line[2], norm.sf(meter.deviations)] + [s.p_value for s in signs]
    p_value = min(1.0, TRIALS * min(tests))
    gap = {'before': meter.value, 'floor': meter.floor, 'floor_std': meter.floor_std,
           'p_value': p_value}
    where = locate(simulator, nominal.model, evidence, settings)
    texts = tuple(s.text for s in signs)
    if p_value > settings.false_alarm:
        where['site'] = dict.fromkeys((s.value for s in Site), 0.0)
        none = Explanation(('none',), 1.0, ('none',), {}, meter.value, *[float('nan')] * 3, True)
        return Diagnosis('WITHIN_FLOOR', f'the record is what the model says (p = {p_value:.2g})',
                         gap, where, (none,), {'effects': (), 'class': (), 'probability': 1.0},
                         (), texts)
    starts = _finalists(scores, settings.finalists)
    if line[2] < 0.01 and 'harmonic_disturbance' in names:
        cls = effect_class('harmonic_disturbance')
        starts = [cls(frequency_hz=line[0], torque_n_m=max(line[1], 1e-6))] + [
            e for e in starts if e.name != cls.name]
    bonuses = {s.effect.name: min(SURE, -np.log(max(s.p_value, 1e-300))) for s in signs}
    starts = [s.effect for s in signs] + starts
    before = try_held_out(simulator, evidence, nominal, settings)
    ranked = _try_all(simulator, evidence, [Candidate((e,)) for e in starts], nominal, settings,
                      bonuses, lambda share: tell(0.4 + 0.4 * share))
    left = _left_over(templates, ranked[0], evidence) if ranked else 0.0
    if ranked and pairs and (left < LEFT_OVER or ranked[0].deviations > 3.0):
        second = score(templates, ranked[0].fit.model, evidence)
        more = [ranked[0].fit.candidate.with_one_more(e)
                for e in _finalists(second, MOST_PAIRS) if e.name not in ranked[0].names]
        more += [ranked[0].fit.candidate.with_one_more(s.effect) for s in signs
                 if s.effect.name not in ranked[0].names]
        couples = _try_all(simulator, evidence, more, ranked[0].fit, settings, bonuses,
                           lambda share: tell(0.8 + 0.2 * share))
        single = ranked[0].held_out + ranked[0].bonus
        ranked = sorted(ranked + [c for c in couples if c.held_out + c.bonus > single + CLOSE],
                        key=_worth)
        left = _left_over(templates, ranked[0], evidence)
    tell(1.0)
    return _conclude(ranked, before, left, gap, where, scores, settings, texts)


def _templates(spacecraft, rows, settings, names, present, tell):
    return _cached_templates(spacecraft, rows, settings, names, tuple(present),
                             _Quiet(lambda share: tell(0.4 * share)))


class _Quiet:
    """A callback that does not tell one call from another, for the cache."""

    def __init__(self, call):
        self.call = call

    def __eq__(self, other):
        return isinstance(other, _Quiet)

    def __hash__(self):
        return 0


@lru_cache(maxsize=4)
def _cached_templates(spacecraft, rows, settings, names, present, quiet):
    frame = make_frame(rows, spacecraft.rate_hz, settings)
    simulator = Simulator(spacecraft, frame, rows / spacecraft.rate_hz, present)
    plain = simulator.expected(Candidate())
    effects = starting_points([effect_class(n) for n in names], spacecraft)
    return make_templates(simulator, plain.at(np.ones(len(plain.names))), plain.shares, effects,
                          quiet.call)


def _finalists(scores, count):
    """Return the best start of each of the best effects, and the second best place of the best."""
    found = {}
    for i in np.argsort(-np.abs(scores.z)):
        found.setdefault(scores.effects[i].name, scores.effects[i])
        if len(found) == count:
            break
    return list(found.values())


def _try_all(simulator, evidence, candidates, start, settings, bonuses, tell):
    """Fit all candidates a little, the best ones to the end; try those on held-out pieces."""
    fits = []
    for i, candidate in enumerate(candidates):
        tell(i / len(candidates))
        fitted = fit(simulator, evidence, candidate, start.levels, FIRST_STEPS)
        if fitted is not None:
            bonus = sum(bonuses.get(n, 0.0) for n in candidate.names)
            fits.append((fitted.likelihood + bonus, i, fitted, bonus))
    ranked = []
    for _, _, fitted, bonus in sorted(fits, reverse=True)[:TRIED]:
        fitted = fit(simulator, evidence, fitted.candidate, fitted.levels)
        if fitted is not None:
            ranked.append(try_held_out(simulator, evidence, fitted, settings, bonus))
    return sorted(ranked, key=_worth)


def _worth(ranked):
    return -(ranked.held_out + ranked.bonus)


def _left_over(templates, ranked, evidence):
    """Return the p-value of the largest score that a fitted candidate leaves."""
    scores = score(templates, ranked.fit.model, evidence)
    return scores.p_value()


def _conclude(ranked, before, left, gap, where, scores, settings, texts):
    if not ranked:
        unknown = Explanation(('unknown',), 1.0, ('unknown',), {}, before.value, 0.0, 0.0, 0.0,
                              False)
        where['site'] = _sites(scores, (), ())
        return Diagnosis('UNEXPLAINED', 'no effect of those asked for can be computed here', gap,
                         where, (unknown,), {'effects': (), 'class': (), 'probability': 0.0}, (),
                         texts)
    best = ranked[0]
    inside = best.deviations <= 3.0 and left >= LEFT_OVER
    # log odds of "something else": none where nothing is left, growing with what is left
    worse = max(-np.log(max(left, 1e-300)), best.deviations ** 2 / 2 * (best.deviations > 0))
    shares, none, unknown = posterior(ranked, before, worse - (-np.log(LEFT_OVER)) - CLOSE)
    explanations = tuple(_explanation(r, p, before, scores, settings)
                         for r, p in zip(ranked, shares))
    others = (Explanation(('unknown',), unknown, ('unknown',), {}, before.value, 0.0, 0.0, 0.0,
                          False),
              Explanation(('none',), none, ('none',), {}, before.value, 0.0, 0.0, 0.0, False))
    top = explanations[0]
    tied = [e for e, r in zip(explanations, ranked)
            if _worth(r) - _worth(best) < CLOSE and len(e.effects) == len(top.effects)]
    alike = tuple(dict.fromkeys(n for e in tied for n in e.effects))
    probability = float(sum(e.probability for e in tied))
    where['site'] = _sites(scores, ranked, shares)
    verdict = {'effects': top.effects, 'class': tuple(dict.fromkeys(top.alike + alike)),
               'probability': probability}
    if not inside:
        share = f'{100 * top.closed:.0f} %' if np.isfinite(top.closed) else 'an unknown share'
        outcome = 'UNEXPLAINED'
        reason = (f'nearest is {" + ".join(top.effects)}, which explains {share} of the gap; '
                  f'{best.deviations:.1f} sd are left')
    elif len({e.effects for e in tied}) > 1:
        outcome, reason = 'TIED', f'{" and ".join(alike)} fit equally well'
    else:
        outcome = 'EXPLAINED'
        reason = f'{" + ".join(top.effects)} leaves {best.deviations:.1f} sd of the gap'
    separate = _separate_by(verdict['class'])
    return Diagnosis(outcome, reason, gap, where, explanations + others, verdict, separate, texts)


def _explanation(ranked, probability, before, scores, settings):
    candidate = ranked.fit.candidate
    stds = np.sqrt(np.maximum(np.diag(ranked.fit.covariance), 0.0))
    parameters = {}
    moved = list(candidate.numbers())
    for i, e in enumerate(candidate.effects):
        for f in e.numbers():
            value = getattr(e, f.name)
            at = [k for k, (j, g) in enumerate(moved) if j == i and g.name == f.name]
            std = stds[at[0]] if at else float('nan')
            x = candidate.point()[at[0]] if at else value
            low, high = ((from_coordinate(f, x - 1.645 * std), from_coordinate(f, x + 1.645 * std))
                         if at else (float('nan'), float('nan')))
            spread = std * abs(value) if at and is_log(f) else std
            parameters[f'{e.name}.{f.name}'] = Value(value, float(spread), float(low),
                                                     float(high), f.metadata['unit'])
    share, low, high = closed(before, ranked)
    return Explanation(ranked.names, float(probability),
                       _alike(scores, ranked.names, settings.tie_cosine), parameters,
                       ranked.value, share, low, high, bool(ranked.deviations <= 3.0),
                       candidate.effects)


def _alike(scores, names, limit):
    """Return the effects whose templates cannot be told from those of the names."""
    all_names = np.array([e.name for e in scores.effects])
    found = list(names)
    for name in names:
        rows = np.flatnonzero(all_names == name)
        if len(rows) and len(names) == 1:
            # the template that explains most stands for the effect
            row = rows[np.argmax(np.abs(scores.z[rows]))]
            found += list(all_names[np.abs(scores.cosine[row]) > limit])
    return tuple(dict.fromkeys(map(str, found)))


def _sites(scores, ranked, shares):
    """Return the share of every site: by the candidates' probabilities."""
    sites = dict.fromkeys((s.value for s in Site), 0.0)
    for r, p in zip(ranked, shares):
        for e in r.fit.candidate.effects:
            sites[e.site.value] += float(p) / len(r.names)
    total = sum(sites.values())
    if total < 1e-9:
        for e, z in zip(scores.effects, scores.z):
            sites[e.site.value] = max(sites[e.site.value], float(z) ** 2)
        total = sum(sites.values())
    return {s: v / total for s, v in sites.items()}


def _separate_by(names):
    """Return what would part the effects of a class."""
    if len(names) < 2:
        return ()
    sites = {effect_class(n).site for n in names}
    words = []
    if Site.TIMING in sites:
        words.append('time stamps of an independent clock')
    if Site.EXCITATION in sites:
        words.append('another excitation, such as a slew or a known torque')
    if Site.SENSOR in sites:
        words.append('a sensor moved to another place, or two sensors swapped')
    if sites == {Site.STRUCTURE}:
        words.append('a longer record, or another level of excitation')
    return tuple(words)


def _too_little(reason):
    nothing = float('nan')
    unknown = Explanation(('unknown',), 1.0, ('unknown',), {}, nothing, nothing, nothing, nothing,
                          False)
    return Diagnosis('TOO_LITTLE_DATA', reason,
                     {'before': nothing, 'floor': nothing, 'floor_std': nothing,
                      'p_value': nothing},
                     {'site': dict.fromkeys((s.value for s in Site), 0.0), 'sensors': [],
                      'bands': [], 'modes': [], 'times': []},
                     (unknown,), {'effects': (), 'class': (), 'probability': 0.0}, ())
