"""From ranked forms to the answer: outcome, class, sites, what would part what is tied."""
import numpy as np

from ssi_ros.effects import effect_class, Site
from ssi_ros.gap.diagnosis import Diagnosis, Explanation, Value
from ssi_ros.gap.reference.extra import has_each_mode, NONLINEAR
from ssi_ros.gap.reference.rank import closed, posterior
from ssi_ros.gap.reference.where import name_of, structural_shares

CLOSE = 5.0             # held-out log odds within which two candidates are tied
MORE = 2.0              # held-out log odds over the level alone that a candidate must have
BOUND = 1.645           # standard deviations of a 90 % interval


def conclude(nominal, ranked, before, gap, where, texts, base, dependence):
    """
    Return the diagnosis.

    Parameters
    ----------
    nominal : Nominal
        The reference.
    ranked : sequence of Ranked
        Candidates, best first.
    before : Ranked
        Level and noise alone.
    gap, where, texts
        What is told of the gap.
    base : Fitted
        Level and noise alone.
    dependence : Dependence
        Of the record.

    Returns
    -------
    Diagnosis

    """
    if not ranked:
        unknown = Explanation(('unknown',), 1.0, ('unknown',), {}, before.value,
                              *[float('nan')] * 3, False)
        where['site'] = dict.fromkeys((s.value for s in Site), 0.0)
        return Diagnosis('UNEXPLAINED', 'no effect of those asked for has a modal form here', gap,
                         where, (unknown,), {'effects': (), 'class': (), 'probability': 0.0}, (),
                         texts)
    best = ranked[0]
    shares, none, unknown = posterior(ranked, before, gap['p_value'])
    explained = tuple(_explanation(r, p, before) for r, p in zip(ranked, shares))
    nothing = (before.value, 0.0, 0.0, 0.0, False)
    others = (Explanation(('unknown',), unknown, ('unknown',), {}, *nothing),
              Explanation(('none',), none, ('none',), {}, *nothing))
    top = explained[0]
    tied = [e for e, r in zip(explained, ranked)
            if best.worth - r.worth < CLOSE and len(e.effects) == len(top.effects)]
    alike = tuple(dict.fromkeys(n for e in tied for n in e.alike))
    probability = float(sum(e.probability for e in tied))
    where['site'] = _sites(ranked, shares)
    if where['site']['structure'] > 0.5:
        _at_modes(nominal, best.fitted, where)
    told = best.worth > before.worth + MORE
    inside = told and (best.deviations <= 3.0 or top.closed >= 1 - best.tolerance)
    verdict = {'effects': top.effects, 'class': alike, 'probability': probability}
    different = {e.effects for e in tied}
    words = ' + '.join(top.effects)
    share = '' if np.isnan(top.closed) else f'closes {100 * top.closed:.0f} % of the gap and '
    meanings = '; '.join(f.meaning for f in best.fitted.forms if f.meaning)
    meanings = f' ({meanings})' if meanings else ''
    if not told:
        outcome = 'UNEXPLAINED'
        reason = 'no effect foretells the unseen groups better than the level alone'
        verdict = {'effects': (), 'class': (), 'probability': 0.0}
    elif not inside:
        outcome = 'UNEXPLAINED'
        reason = (f'nearest is {words}{meanings}, which {share}leaves '
                  f'{best.deviations:.1f} sd')
    elif len(different) > 1 or len(alike) > len(top.effects):
        outcome = 'TIED'
        reason = f'{", ".join(alike)} have one form here; {words}{meanings} {share}leaves ' \
                 f'{best.deviations:.1f} sd'
    else:
        outcome = 'EXPLAINED'
        reason = f'{words}{meanings} {share}leaves {best.deviations:.1f} sd of the gap'
    return Diagnosis(outcome, reason, gap, where, explained + others, verdict,
                     _separate_by(alike), texts)


def _explanation(ranked, probability, before):
    parameters = {}
    for k, form in enumerate(ranked.fitted.forms):
        at = ranked.fitted.coordinates(k)
        stds = np.sqrt(np.maximum(np.diag(ranked.fitted.covariance)[at], 0.0))
        for number, x, std in zip(form.numbers, ranked.fitted.x[at], stds):
            reach = np.clip([x - BOUND * std, x + BOUND * std], number.low, number.high)
            low, high = sorted(float(number.value(v)) for v in reach)
            parameters[f'{form.effect}.{number.name}'] = Value(
                float(number.value(x)), (high - low) / (2 * BOUND), low, high, number.unit)
        for name, (value, unit) in form.constants.items():
            parameters[f'{form.effect}.{name}'] = Value(value, *[float('nan')] * 3, unit)
        # a channel has no number; it is told in the name of the parameter's owner
        for key, word in form.place.items():
            if key in ('channel', 'source'):
                parameters.setdefault(f'{form.effect}.{key}.{word}',
                                      Value(1.0, *[float('nan')] * 3, '1'))
    alike = tuple(dict.fromkeys(n for f in ranked.fitted.forms for n in (f.effect, *f.also)))
    share, low, high = closed(before, ranked)
    return Explanation(ranked.names, float(probability), alike, parameters, ranked.value, share,
                       low, high, bool(ranked.deviations <= 3.0))


def _at_modes(nominal, fitted, where):
    """Put modes and channels of a structural change where the fit has it, not the mean gap."""
    modes, count = nominal.modes, len(nominal.modes)
    for k, form in enumerate(fitted.forms):
        if has_each_mode(form, count):
            at = fitted.coordinates(k)
            z = fitted.x[at] / np.sqrt(np.maximum(np.diag(fitted.covariance)[at], 1e-300))
            weights = np.square(z).reshape(-1, count).sum(axis=0)
            shares = weights / weights.sum()
            names = [name_of(shape, nominal.channels) for shape in modes.shapes.T]
            where['modes'] = sorted(
                ({'frequency_hz': f, 'name': n, 'share': s}
                 for f, n, s in zip(modes.frequencies_hz, names, shares)),
                key=lambda m: -m['share'])
            where['sensors'] = [{'name': c, 'share': s} for c, s in zip(
                nominal.channels, structural_shares(nominal, shares))]


def _sites(ranked, shares):
    sites = dict.fromkeys((s.value for s in Site), 0.0)
    for r, p in zip(ranked, shares):
        for name in r.names:
            sites[effect_class(name).site.value] += float(p) / len(r.names)
    total = sum(sites.values())
    return {s: v / total if total > 0.0 else 0.0 for s, v in sites.items()}


def _separate_by(names):
    """Return what would part the effects of a class."""
    if len(names) < 2:
        return ()
    sites = {effect_class(n).site for n in names}
    words = []
    if Site.TIMING in sites:
        words.append('time stamps of an independent clock')
    if Site.EXCITATION in sites and len(sites) > 1:
        words.append('another excitation')
    if Site.SENSOR in sites:
        words.append('two sensors swapped')
    if set(names) & set(NONLINEAR):
        words.append('a recording at another level of excitation, and free decays from it')
    elif Site.STRUCTURE in sites:
        words.append('a model with the geometry (--model)')
    return tuple(words)
