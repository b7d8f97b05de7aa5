"""Diagnose the gap between two recordings of one structure: is there one, where, why."""
from dataclasses import replace

import numpy as np
from scipy.stats import norm

from ssi_ros.effects import effect_class, library, Site
from ssi_ros.gap.conclude import no_gap
from ssi_ros.gap.diagnosis import Diagnosis, Explanation
from ssi_ros.gap.rank import unseen
from ssi_ros.gap.reference import signs as look
from ssi_ros.gap.reference.amplitude import amplitude_dependence
from ssi_ros.gap.reference.bracket import bracketed, distance, IMPOSSIBLE
from ssi_ros.gap.reference.conclude import conclude
from ssi_ros.gap.reference.coupled import mixed_modes
from ssi_ros.gap.reference.distance import data_floor, Distance, measure
from ssi_ros.gap.reference.extra import (
    has_each_mode, of_line, of_sign, stiffness_drift)
from ssi_ros.gap.reference.fit import cleared, fit, level_of
from ssi_ros.gap.reference.forms import all_forms
from ssi_ros.gap.reference.innovation import predictor
from ssi_ros.gap.reference.joint import joint, OTHER_LEVEL
from ssi_ros.gap.reference.misplaced import begun
from ssi_ros.gap.reference.nominal import identified, make_nominal, modes_of, moves
from ssi_ros.gap.reference.nutation import line_or_mode
from ssi_ros.gap.reference.pair import dithered, make_pair
from ssi_ros.gap.reference.period import period_of
from ssi_ros.gap.reference.periodic import (
    both_repeat, enough, in_phase, of_clock, of_swing, of_unrepeated_sweep, periodic_signs)
from ssi_ros.gap.reference.pieces import plan, silent_in_all, spectra_of
from ssi_ros.gap.reference.pulses import of_pulses, pulses
from ssi_ros.gap.reference.rank import closed, EXACT, MODAL, SURE, try_held_out, worth
from ssi_ros.gap.reference.repeats import same_signal
from ssi_ros.gap.reference.screen import screen
from ssi_ros.gap.reference.shifted import shifted_modes
from ssi_ros.gap.reference.sweep import of_sweep, sweep
from ssi_ros.gap.reference.wander import independent_share
from ssi_ros.gap.reference.where import locate
from ssi_ros.gap.settings import DiagnosisSettings
from threadpoolctl import ThreadpoolController

BLAS = ThreadpoolController()   # more threads only slow these small matrices down
TRIALS = 7              # tests: distance, scores, level, pulses, lines, sweeps, modes
EACH = 2                # places of one effect that are fitted
TRIED = 6               # fits that go on to held-out groups
LEVEL_SURE = 2.0        # standard deviations of a level that must be left of its difference
FIRST_STEPS = 4         # of a fit, before the best TRIED are chosen
FINALISTS = 12          # forms fitted after the scores
PADDING = 0.01          # of the power of a channel: what is below is noise, at another level
CLEAR = 100.0           # log odds of a sign beyond which its p-value is not believed
FAR = 6.0               # standard deviations of a gap, above which modes may be far away
GROSS = 30.0            # standard deviations of a gap, above which distances rank
MORE = 3.0              # standard deviations left, above which a second effect is looked for


def diagnose_reference(reference, record, settings=DiagnosisSettings(), *, effects=None,
                       pairs=True, progress=None):
    """
    Diagnose the gap between two recordings of the same structure.

    Parameters
    ----------
    reference, record : Samples
        At least one channel in common; any rates in a ratio of small whole numbers. NaN where a
        sample is missing.
    settings : DiagnosisSettings
        Only `false_alarm` is used: bands and segments follow from the recordings.
    effects : sequence of str, optional
        Names of the effects to consider; all by default.
    pairs : bool
        Whether to look for two effects where one does not suffice.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Diagnosis
        With sites and names as from a model; parameters are those of the modal forms.

    Raises
    ------
    ValueError
        If the recordings have no channel or rate in common, or an effect is not known.

    """
    names = tuple(effect_class(n).name for n in effects) if effects else tuple(library())
    with BLAS.limit(limits=1):
        return _diagnose(reference, record, settings, names, pairs,
                         progress or (lambda share: None))


def _diagnose(reference, record, settings, names, pairs, tell):
    clean = make_pair(reference, record)
    period = period_of(dithered(clean).reference)
    repeats = both_repeat(clean, period)
    whole, clean = clean, in_phase(clean, repeats)
    late_s = (len(whole.record) - len(clean.record)) / clean.rate_hz
    pair = dithered(clean)
    try:
        cut = plan(min(len(pair.reference), len(pair.record)), pair.rate_hz, len(pair.channels),
                   period)
    except ValueError as error:
        return _too_little(str(error), pair.notes)
    one, two = spectra_of(pair.reference, cut), spectra_of(pair.record, cut)
    tell(0.05)
    usual = one.mean
    level, unsure = level_of(one.mean, two.mean, one.freedom, two.freedom)
    searched, notes = cut, pair.notes
    if abs(level) > OTHER_LEVEL + LEVEL_SURE * unsure and not (
            quiet := silent_in_all(one.mean, two.mean)).all():
        one, two = (s.in_bands(~quiet).padded(PADDING) for s in (one, two))
        cut = one.cut
        notes += (f'the level differs by {10 * level / np.log(10):+.1f} dB; {quiet.sum()} of '
                  f'{len(quiet)} bands hold noise only, which does not grow with it, and were '
                  'left out',)
    nominal = make_nominal(pair.reference, pair.channels, cut, one.mean, one)
    if repeats is not None:
        nominal = nominal.trusted(independent_share(repeats[0], cut, same_signal(*repeats)))
    base = fit(nominal, two.mean, one.freedom, two.freedom)
    tell(0.1)
    found = screen(nominal, base, one, two, all_forms(nominal, names), enough(repeats))
    tell(0.25)
    gap, scatter = _gap(nominal, base, one, two)
    signs, levels = _signs(pair, reference, record, searched, usual, level, found, two, names)
    signs = _by_period(signs, repeats, float(np.exp(level)), names)
    after = identified(pair.record, pair.channels, cut.rate_hz)
    shifted = shifted_modes(nominal.identified, after, cut.width_hz)
    tests = [found.p_value, norm.sf(gap.deviations), shifted.p_value] + [
        s.p_value for s in signs if not s.faint]
    p_value = float(min(1.0, TRIALS * min(tests)))
    told = {'before': gap.value, 'floor': gap.floor, 'floor_std': gap.floor_std,
            'p_value': p_value}
    where = locate(nominal, base, one, two)
    texts = notes + tuple(s.text for s in (*signs, shifted) if s.text)
    if p_value > settings.false_alarm:
        texts = notes + tuple(s.text for s in signs if not s.faint)
        tell(1.0)
        owners = [found.forms[k] for k in found.owner]
        small = unseen(found.z, [(f.effect, *f.also) for f in owners], np.zeros(len(owners), bool),
                       names)
        return no_gap('reference', told, where, texts, *small)
    tell(0.3)
    dependence = amplitude_dependence(pair.record, cut.rate_hz, nominal.modes)
    if repeats is not None:
        modes = nominal.modes
        dependence = dependence.beside(
            amplitude_dependence(pair.reference, cut.rate_hz, modes),
            2 * modes.damping_ratios * modes.frequencies_hz * period / cut.rate_hz)
    joints, texts_joint = joint(nominal, base, one, two, pair, dependence, names)
    tell(0.4)
    signs, joints = _one_cause_of_bursts(signs, joints)
    bonuses = {s.effect: 0.0 if s.faint else EXACT if s.p_value <= look.NEVER
               else min(CLEAR, -np.log(s.p_value)) for s in signs}
    sure = level if abs(level) > LEVEL_SURE * unsure else 0.0
    forms = [f for s in signs if s.effect != 'stiffness_drift'
             for f in _of_sign(s, clean, repeats, late_s, cut, levels, sure, base, two)]
    for form in forms:
        bonuses[form.effect] += max(cleared(nominal, base, one, two, form), 0.0)
    drift = stiffness_drift(nominal) if 'stiffness_drift' in names else None
    if drift is not None:
        forms.append(drift)
        bonuses[drift.effect] = _drifting(found, two)
    forms += _finalists(found) + [j.form for j in joints]
    bonuses.update({j.form.effect: j.bonus for j in joints})
    before = try_held_out(nominal, one, two, base, scatter)
    gross = gap.deviations > GROSS
    there = modes_of(nominal, after)
    if gap.deviations > FAR:
        forms += _nearest(nominal, found.forms, one, two)
        forms += _farther(nominal, there, forms)
        forms += [begun(nominal, f, two.mean) for f in found.forms
                  if f.effect == 'sensor_misplacement']
    if shifted.text:
        forms += [f for f in found.forms if f.effect == 'stiffness_scale']
    forms = [shifted.tell(f) for f in forms]
    ranked = _try_all(nominal, one, two, [(f,) for f in forms], base, bonuses, (scatter, gross),
                      lambda share: tell(0.4 + 0.35 * share))
    mixed = mixed_modes(nominal, there) if 'stiffness_scale' in names else None
    if mixed is not None and gap.deviations <= FAR and any(
            'sensor_misplacement' in r.names for r in ranked[:1]):
        # shapes that turn show in the channels of one part, and shall not pass for one channel
        ranked += _try_all(nominal, one, two, [(shifted.tell(mixed),)], base, bonuses,
                           (scatter, gross), lambda share: None)
        ranked.sort(key=lambda r: -r.worth)
    if pairs and ranked and ranked[0].deviations > MORE and ranked[0].tolerance == MODAL and (
            not closed(before, ranked[0])[0] >= 1 - MODAL):
        first = ranked[0].fitted
        couples = [(first.forms[0], r.fitted.forms[0]) for r in ranked[1:5]
                   if r.names != ranked[0].names and r.worth > before.worth]
        ranked += [r for r in _try_all(nominal, one, two, couples, base, bonuses, (scatter, gross),
                                       lambda share: tell(0.75 + 0.25 * share))
                   if r.worth > ranked[0].worth + SURE / 2
                   and r.value - r.floor < ranked[0].value - ranked[0].floor]
        ranked.sort(key=lambda r: -r.worth)
    tell(1.0)
    return conclude(nominal, ranked, before, told, where, texts + texts_joint, base, dependence)


def _gap(nominal, base, one, two):
    """Return the gap over the wider of both floors, and how much wider the data's floor is."""
    theory = measure(one, two, base.prediction, nominal.trust)
    noise = base.x[1] * np.diag(nominal.floor)
    level = replace(one, groups=np.exp(base.x[0]) * one.groups + noise)
    floor, std = data_floor(level, two, nominal.trust)[:2]
    scatter = max(1.0, std / theory.floor_std)
    floor = max(floor, theory.floor)
    return Distance(theory.value, floor, scatter * theory.floor_std), scatter


def _signs(pair, reference, record, cut, usual, level, found, two, names):
    raw = [s.values[:, [s.channels.index(c) for c in pair.channels]]
           for s in (reference, record)]
    values = pair.reference, pair.record
    ways = [predictor(v) for v in values]
    left = [way.residual(v) for way, v in zip(ways, values)]
    paced = [way.paced(v, e) for way, v, e in zip(ways, values, left)]
    levels = _levels(left[1], two)
    signs = [look.losses(pair.missing), look.steps(*raw), look.rails(*raw, pair.channels),
             look.level_swings(*paced, cut.rate_hz), pulses(*paced, cut.rate_hz),
             sweep(*left, cut.rate_hz),
             line_or_mode(look.line(pair.reference, pair.record, cut, usual,
                                    float(np.exp(level))),
                          pair.reference, pair.record, cut.rate_hz)]
    track = _common_track(found)
    if track is not None:
        slope, p = look.trend(track, two.times_s)
        if p < 1e-3:
            signs.append(look.Sign('stiffness_drift', {}, {}, p, 'the frequencies move through '
                                   f'the record ({slope:+.2g} sd of a piece)'))
    return [s for s in signs if s is not None and s.effect in names], levels


def _one_cause_of_bursts(signs, joints):
    """Return signs and joints without the weaker of pulses and of a joint that strikes."""
    knocks = [min(CLEAR, -np.log(max(s.p_value, look.NEVER))) for s in signs
              if s.effect == 'impulsive_events']
    strikes = [j.bursts for j in joints if j.bursts > 0.0]
    if knocks and strikes:
        if max(strikes) > max(knocks):
            return [s for s in signs if s.effect != 'impulsive_events'], joints
        return signs, ()
    return signs, joints


def _by_period(signs, repeats, level, names):
    """Return all signs; what periods tell of an effect stands for what the samples tell of it."""
    periodic = periodic_signs(repeats, level, names)
    told = {s.effect for s in periodic}
    if enough(repeats):
        # a signal whose level differs in every window swings in itself, and what it has repeats
        told |= {'nonstationary_excitation', 'wheel_speed_sweep'}
    return [s for s in signs if s.effect not in told] + periodic


def _of_sign(sign, clean, repeats, late_s, cut, levels, level, base, two):
    """Return the forms of a sign."""
    if sign.effect == 'clock_rate':
        return [of_clock(sign, clean, cut)]
    if 'sizes' in sign.place:
        return [of_swing(sign, two, late_s)]
    if sign.effect == 'impulsive_events':
        return of_pulses(sign, predictor(clean.record), clean.record, base, two)
    if 'shape' in sign.place:
        return [of_line(sign, cut, clean.channels)]
    if sign.effect == 'wheel_speed_sweep':
        return [of_unrepeated_sweep(sign, repeats, cut) if enough(repeats)
                else of_sweep(sign, two, len(clean.record) / clean.rate_hz)]
    return [of_sign(sign, clean, cut, levels, level)]


def _common_track(found):
    """Return the scores of all stiffnesses alike in every group, or None without modes."""
    rows = [k for k, f in enumerate(found.forms) if f.effect == 'stiffness_scale' and not f.place]
    return found.tracks[found.owner == rows[0]][0] if rows else None


def _drifting(found, two):
    """Return the log odds that frequencies move through the record and did not just change."""
    track = _common_track(found)
    if track is None or len(track) < 4:
        return 0.0
    return float(np.clip(look.steady_or_drifting(track, two.times_s), -SURE, SURE))


def _levels(left, two):
    """Return the power of what the past does not predict in every group, over its mean."""
    power = (left ** 2).mean(axis=1)
    ends = np.rint(np.cumsum(two.weights) / two.weights.sum() * len(power)).astype(int)
    found = np.array([p.mean() for p in np.split(power, ends[:-1])])
    return found / (found @ two.weights / two.weights.sum())


def _finalists(found):
    """Return the forms of the largest gains, a few places of each effect."""
    chosen, count = [], {}
    for k in np.argsort(-found.gains):
        form = found.forms[k]
        if count.get(form.effect, 0) < EACH and len(chosen) < FINALISTS:
            count[form.effect] = count.get(form.effect, 0) + 1
            chosen.append(form)
    return chosen


def _nearest(nominal, forms, one, two):
    """Return the forms of one number that leave least, with the sizes at which they do."""
    tried = [bracketed(nominal, v, two.mean, one.freedom, two.freedom)
             for f in forms if len(f.numbers) == 1 for v in (f, *f.variants)]
    best = {}
    for form, left in sorted(tried, key=lambda t: t[1]):
        if left < IMPOSSIBLE:
            best.setdefault(form.effect, []).append((form, left))
    chosen = [t for some in best.values() for t in some[:EACH]]
    return [form for form, _ in sorted(chosen, key=lambda t: t[1])[:FINALISTS]]


def _farther(nominal, there, forms):
    """Return the forms that move modes, begun where the modes of the record are."""
    way = 2 * moves(nominal.modes, there)
    if not way.any():
        return []
    found = [replace(f, begin=[np.median(way[way != 0.0])]) for f in forms
             if f.effect == 'stiffness_scale' and len(f.numbers) == 1]
    mixed = mixed_modes(nominal, there)
    found += [mixed] if mixed is not None else []
    return found + [replace(f, begin=np.append(way, [n.start for n in f.numbers[len(way):]]))
                    for f in forms if has_each_mode(f, len(way)) and f.effect != 'damping_scale']


def _try_all(nominal, one, two, candidates, base, bonuses, floor, tell):
    """Fit all candidates a little, the best to the end; try those on held-out groups."""
    scatter, gross = floor
    fits = []
    for i, forms in enumerate(candidates):
        tell(0.7 * i / len(candidates))
        numbers = [x for f in forms for x in f.start]
        start = np.append(base.x, numbers)
        if any(f.begin is not None or not f.numbers for f in forms):
            # noise that stood in for an effect shall not stand in its way
            seen = _levelled(two, forms).mean
            start = np.append([distance(nominal, forms, numbers, seen, one.freedom,
                                        two.freedom)[1], 0.0], numbers)
        fitted = fit(nominal, _levelled(two, forms).mean, one.freedom, two.freedom, forms, start,
                     FIRST_STEPS, base.x)
        bonus = sum(bonuses.get(f.effect, 0.0) for f in forms)
        fits.append((worth(fitted, bonus, gross), i, fitted, bonus))
    best = {}
    for _, _, fitted, bonus in sorted(fits, key=lambda f: -f[0]):
        # one form may have begun at several values
        best.setdefault(tuple(f.kind for f in fitted.forms), (fitted, bonus))
    ranked = []
    for i, (fitted, bonus) in enumerate(list(best.values())[:TRIED]):
        tell(0.7 + 0.3 * i / TRIED)
        own = _levelled(two, fitted.forms)
        fitted = fit(nominal, own.mean, one.freedom, two.freedom, fitted.forms, fitted.x,
                     origin=base.x)
        ranked.append(try_held_out(nominal, one, own, fitted, scatter, bonus, gross))
    return sorted(ranked, key=lambda r: -r.worth)


def _levelled(two, forms):
    for form in forms:
        two = two if form.levels is None else two.levelled(form.levels)
        two = two if form.crossed is None else two.without(form.crossed)
    return two


def _too_little(reason, notes):
    nothing = float('nan')
    unknown = Explanation(('unknown',), 1.0, ('unknown',), {}, *[nothing] * 4, False)
    return Diagnosis('TOO_LITTLE_DATA', reason,
                     dict.fromkeys(('before', 'floor', 'floor_std', 'p_value'), nothing),
                     {'site': dict.fromkeys((s.value for s in Site), 0.0), 'sensors': [],
                      'bands': [], 'modes': [], 'times': []},
                     (unknown,), {'effects': (), 'class': (), 'probability': 0.0}, (), notes)
