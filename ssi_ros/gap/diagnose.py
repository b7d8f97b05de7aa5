"""Diagnose the gap between a model and a record: is there one, where, why, what is left."""
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np
from scipy.stats import norm

from ssi_ros.effects import effect_class, library
from ssi_ros.gap.cache import load_templates, save_templates, templates_key
from ssi_ros.gap.candidate import Candidate, starting_points
from ssi_ros.gap.check import longest_part, match
from ssi_ros.gap.conclude import (
    conclude, INSIDE, LEFT_OVER, no_gap, texts, too_little, wrong_level)
from ssi_ros.gap.fit import fit, level_gap, Simulator
from ssi_ros.gap.holes import completed, without_rails
from ssi_ros.gap.indirect import made_by
from ssi_ros.gap.meter import measure
from ssi_ros.gap.rank import Ranked, try_held_out, unseen, worth
from ssi_ros.gap.resimulate import floor_by_simulation
from ssi_ros.gap.scores import make_templates, score
from ssi_ros.gap.search import BEHIND, Search
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.slow import relief, slow_signs
from ssi_ros.gap.spectra import make_frame
from ssi_ros.gap.strange import make_strange, strange_scores, strange_sign
from ssi_ros.gap.symptoms import symptoms
from ssi_ros.gap.tolerance import tolerances
from ssi_ros.gap.torque import odd_signs, reconstruct, torque_signs
from ssi_ros.gap.where import locate
from threadpoolctl import ThreadpoolController

BLAS = ThreadpoolController()   # more threads only slow these small matrices down
SCORES_SHARE = 0.65     # of the false alarms allowed, that the scores may make
SIGN_SHARE = 0.05       # and meter (twice), lines, sweeps, pulses, swings, slow noise each
TRIED = 4               # candidates that are measured on held-out pieces
DOUBT = 0.05            # p-value of what is left, below which a second effect is looked for
MOST_CREDIT = 1.5       # share of what two of its records lose that a candidate may be credited
FAR = 30.0              # deviations left, above which the size may be far from any start


@dataclass(frozen=True, eq=False)
class _Left:
    """What a candidate leaves: scores, signs, p-values, how far, what its own records do."""

    scores: object
    signs: tuple
    odd: tuple
    p_value: float          # of all tests
    spectral: float         # but for a swing of the level, which is in no spectrum
    far: bool
    floor: object = None


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
    with BLAS.limit(limits=1):
        return _diagnose(spacecraft, samples, settings, names, pairs, tuple(present), tell)


def _diagnose(spacecraft, samples, settings, names, pairs, present, tell):
    samples = match(spacecraft, samples)
    of_samples = symptoms(samples)
    samples, rails = without_rails(samples, [s.effect for s in of_samples])
    try:
        frame = make_frame(len(samples.values), samples.rate_hz, settings,
                           ~np.isnan(samples.values).any(axis=1))
    except ValueError as error:
        return too_little(str(error))
    duration_s = len(samples.values) / samples.rate_hz
    simulator = Simulator(spacecraft, frame, duration_s, present)
    simulator, samples, evidence, levels = completed(simulator, samples, rails, settings)
    there = {e.name for e in present}
    wanted = tuple(n for n in names if n not in there)
    templates = _templates(spacecraft, len(samples.values), settings, names, present, tell)
    wrong = level_gap(levels)
    tolerance = tolerances(simulator, Candidate(), levels, settings)
    nominal = fit(simulator, evidence, levels=levels, tolerance=tolerance)
    scores = score(templates, nominal, evidence, tolerance)
    strangers = _strangers(spacecraft, len(samples.values), settings, present)
    part = longest_part(samples)
    # a sweep is one over the whole record
    sought = tuple(n for n in wanted if n != 'wheel_speed_sweep' or part is samples)
    # a missing row is a hole, which looks like a spike on all channels
    whole = not np.isnan(part.values).any()

    def look(fitted, names):
        torque = reconstruct(simulator, fitted, part, settings)
        signs = (tuple(s for s in of_samples if s.effect.name in names)
                 + torque_signs(torque, names)
                 + slow_signs(simulator, fitted, part, settings, names))
        return (signs, odd_signs(torque, samples.channels) if whole else (),
                measure(fitted.model, evidence, settings.band_bins))

    signs, odd, meter = look(nominal, sought)
    odd += strange_sign(strange_scores(strangers, nominal, evidence, tolerance))
    gap = {'before': meter.value, 'floor': meter.floor, 'floor_std': meter.floor_std,
           'p_value': _together(scores.p_value(), _whole_and_local(meter), signs + odd)}
    where = locate(simulator, nominal.model, evidence, settings)
    tell(0.4)
    if wrong and not of_samples:
        # its level is not that of the model, and neither rails nor holes have made it so
        return wrong_level(wrong, gap, where, scores, texts(signs + odd))
    if gap['p_value'] > settings.false_alarm:
        small = unseen(scores.z, [(e.name,) for e in scores.effects],
                       [e.one_sided() for e in scores.effects], names)
        return no_gap('model', gap, where, texts(signs + odd), *small)
    search = Search(simulator, evidence, settings, nominal, tolerance, names,
                    lambda share: tell(0.4 + 0.3 * share),
                    lambda fitted: relief(simulator, fitted, part, settings, signs))
    ranked = search.singles(scores, signs)

    @cache
    def made(fitted):
        return made_by(simulator, fitted, tolerance, settings.band_bins)

    @cache
    def floor_of(fitted, more=(), odd=False):
        return floor_by_simulation(simulator, fitted, made(fitted), templates, strangers,
                                   tolerance, settings, more, odd)

    @cache
    def left_by(best):
        rest = score(templates, best.fit, evidence, tolerance)
        more, odd, meter = look(best.fit, tuple(n for n in sought if n not in best.names))
        strange = strange_scores(strangers, best.fit, evidence, tolerance)
        seen = odd + strange_sign(strange)
        left = _left(rest, more, seen, _whole_and_local(meter), meter.deviations > FAR)
        if left.p_value < DOUBT:
            # perhaps only the expected spectrum of the candidate is not exact
            floor = floor_of(best.fit, more, bool(odd))
            rest, of_meter, more, odd = floor.against(rest, strange, meter, more, odd)
            left = _left(rest, more, odd, of_meter, left.far, floor)
        return left

    left, shown = 0.0, signs + odd
    if ranked:
        rest = left_by(ranked[0])
        if rest.far:
            ranked = search.wider(ranked, signs)
            rest = left_by(ranked[0])
        if rest.spectral < LEFT_OVER:
            ranked, rest = _credited(ranked, left_by, made, nominal, len(names), floor_of)
        if pairs and rest.p_value < DOUBT:
            single = ranked[0]
            search.tell = lambda share: tell(0.7 + 0.2 * share)
            both = [replace(r, credit=single.credit) if set(single.names) <= set(r.names) else r
                    for r in search.pairs(scores, rest.scores, ranked, signs, rest.signs)]
            ranked = sorted(ranked + both, key=lambda r: -worth(r, len(names)))
            if ranked[0] is not single:
                rest = left_by(ranked[0])
        left = rest.p_value
        told = made(ranked[0].fit)
        if rest.floor:
            told = replace(told, spread=told.spread * rest.floor.wider)
        ranked[0] = replace(ranked[0], made=told, floor=rest.floor)
        # a mode that moved looks like a line beside it: what went with the effect is not told
        shown = tuple(s for s in signs if s.effect.name in ranked[0].names) + rest.signs + rest.odd
    tell(0.9)
    before = try_held_out(simulator, evidence, Ranked(nominal), settings, tolerance)
    ranked = [try_held_out(simulator, evidence, r, settings, tolerance) for r in ranked[:TRIED]]
    if ranked and not ranked[0].floor and ranked[0].deviations > INSIDE:
        # halves of a record whose level swings leave more than the theory of a steady one says
        ranked[0] = replace(ranked[0], floor=floor_of(ranked[0].fit))
    controls = [before] + [try_held_out(simulator, evidence, r, settings, tolerance)
                           for r in search.at_random(templates, ranked)]
    tell(1.0)
    strange = min((s.p_value for s in odd), default=1.0)
    found = conclude(ranked, before, left, strange, gap, where, scores, signs, texts(shown),
                     settings, len(names), controls)
    if found.outcome not in ('EXPLAINED', 'TIED'):
        return found
    best = next(r for r in ranked if r.names == found.verdict['effects'])
    later_s = (part.start_ns - samples.start_ns) * 1e-9
    when = next(((s.when[0] + later_s * (s not in of_samples), s.when[1]) for s in signs
                 if len(s.when) and s.effect.name in best.names), ())
    again = locate(simulator, nominal.model, evidence, settings,
                   (best.fit.model, found.verdict['probability'], when))
    return replace(found, where={**found.where, **{
        k: again[k] for k in ('bands', 'modes', 'times')}})


def _left(scores, signs, odd, of_meter, far, floor=None):
    p_value = scores.p_value()
    return _Left(scores, signs, odd, _together(p_value, of_meter, signs + odd),
                 _together(p_value, of_meter, tuple(s for s in signs if not s.look) + odd),
                 far, floor)


def _credited(ranked, left_by, made, nominal, effects, floor_of):
    """
    Credit candidates with what their expected spectra, not exact, lose on their own records.

    Return them in the new order, and what the best one leaves. The best so far explains nothing:
    another hinge law may do so whose linear equivalent is worse.
    """
    best = ranked[0]
    hopeful = (best.fit.likelihood + nominal.likelihood) / 2
    found, others = {}, []
    for r in ranked:
        if r is not best and (
                r.fit.likelihood <= hopeful or not r.fit.candidate.nonlinear
                or r.evidence + MOST_CREDIT * made(r.fit).lost < max(
                    f.evidence for f in found) - BEHIND):
            others.append(r)
            continue
        rest = left_by(r)
        credit = 0.0
        if rest.floor and r.fit.candidate.nonlinear:
            # the same random numbers cost an exact spectrum, of a kin at best, as much by chance
            exact = [k.floor.lost for f, k in found.items()
                     if k.floor and not f.fit.candidate.nonlinear]
            credit = max(rest.floor.lost - (exact[0] if exact else floor_of(nominal).lost), 0.0)
        found[replace(r, credit=credit)] = rest
    order = sorted([*found, *others], key=lambda r: -worth(r, effects))
    return order, found[order[0]]


def _whole_and_local(meter):
    """Return the p-values of the meter, over all frequencies and in the worst stretch of them."""
    return float(norm.sf(meter.deviations)), meter.local_p_value()


def _together(p_value, of_meter, signs):
    """Return the p-value of all tests for a gap together."""
    others = [*of_meter] + [s.p_value for s in signs]
    return float(min(1.0, p_value / SCORES_SHARE, min(others) / SIGN_SHARE))


def _templates(spacecraft, rows, settings, names, present, tell):
    return _cached_templates(spacecraft, rows, settings, names, tuple(present),
                             _Quiet(lambda share: tell(0.3 * share)))


class _Quiet:
    """A callback that does not tell one call from another, for the cache."""

    def __init__(self, call):
        self.call = call

    def __eq__(self, other):
        return isinstance(other, _Quiet)

    def __hash__(self):
        return 0


@lru_cache(maxsize=4)
def _strangers(spacecraft, rows, settings, present):
    frame = make_frame(rows, spacecraft.rate_hz, settings)
    return make_strange(Simulator(spacecraft, frame, rows / spacecraft.rate_hz, present))


@lru_cache(maxsize=4)
def _cached_templates(spacecraft, rows, settings, names, present, quiet):
    frame = make_frame(rows, spacecraft.rate_hz, settings)
    simulator = Simulator(spacecraft, frame, rows / spacecraft.rate_hz, present)
    effects = starting_points([effect_class(n) for n in names], spacecraft)
    key = templates_key(spacecraft, rows, settings.segment_s, settings.least_segments,
                        settings.low_hz, settings.high_share, present, names=names)
    found = load_templates(key, effects)
    if found is None:
        found = make_templates(simulator, effects, quiet.call)
        save_templates(key, found, effects)
    return found
