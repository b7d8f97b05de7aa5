"""From ranked candidates to an answer: outcome, probabilities, classes, what to do next."""
import numpy as np

from ssi_ros.effects import effect_class
from ssi_ros.effects.base import is_log, Site
from ssi_ros.gap.candidate import from_coordinate
from ssi_ros.gap.diagnosis import Diagnosis, Explanation, Value
from ssi_ros.gap.rank import closed, posterior

LEFT_OVER = 3e-3        # p-value of what is left, below which a candidate does not explain
INSIDE = 3.0            # standard deviations of the held-out gap that count as its floor
SURE = 0.8              # probability of one effect above which no tie is spoken of
DOUBTFUL = 0.5          # probability of no effect, or of an unknown one, that decides
UNLIKELY = 0.1          # probability of the best effect, below which an unknown one may decide
# Of an effect that belongs to a tie: a law whose size does not show has a fifth of the odds of the
# best, which it shares with its kin.
TIED = 0.05
NOWHERE = (float('nan'),) * 3


def no_gap(other, gap, where, words, probability, small):
    """
    Return the answer where the record is what the other side says.

    Parameters
    ----------
    other : str
        'model' or 'reference'.
    gap, where, words
        As in the answer.
    probability : float
        That no effect is there.
    small : dict of str to float
        Probabilities of effects that may be there unseen.

    """
    where = {**where, 'site': dict.fromkeys((s.value for s in Site), 0.0)}
    none = Explanation(('none',), probability, ('none',), {}, gap['before'], *NOWHERE, True)
    others = [Explanation((n,), p, (n,), {}, float('nan'), *NOWHERE, True)
              for n, p in sorted(small.items(), key=lambda item: -item[1])]
    rest = max(0.0, 1.0 - probability - sum(small.values()))
    others.append(Explanation(('unknown',), rest, ('unknown',), {}, float('nan'), *NOWHERE, True))
    return Diagnosis('WITHIN_FLOOR', f'the record is what the {other} says (p = '
                     f'{gap["p_value"]:.2g}), but for effects too small to be seen in it', gap,
                     where, (none, *others),
                     {'effects': (), 'class': (), 'probability': probability}, (), words)


def wrong_level(reason, gap, where, scores, words):
    """Return the answer where the level alone says that record and model do not fit."""
    unknown = Explanation(('unknown',), 1.0, ('unknown',), {}, gap['before'], *NOWHERE, False)
    return Diagnosis('UNEXPLAINED', reason, gap, {**where, 'site': _sites(scores, (), ())},
                     (unknown,), {'effects': (), 'class': (), 'probability': 0.0}, (),
                     words)


def too_little(reason):
    """Return the answer where the record is too short."""
    nothing = float('nan')
    unknown = Explanation(('unknown',), 1.0, ('unknown',), {}, nothing, *NOWHERE, False)
    return Diagnosis('TOO_LITTLE_DATA', reason, dict.fromkeys(
        ('before', 'floor', 'floor_std', 'p_value'), nothing),
        {'site': dict.fromkeys((s.value for s in Site), 0.0), 'sensors': [], 'bands': [],
         'modes': [], 'times': [], 'amplitudes': []},
        (unknown,), {'effects': (), 'class': (), 'probability': 0.0}, ())


def conclude(ranked, before, left, strange, gap, where, scores, signs, words, settings, effects,
             controls=()):
    """
    Return the answer where there is a gap.

    Parameters
    ----------
    ranked : list of Ranked
        Candidates with held-out gaps, best first; may be empty.
    before : Ranked
        The nominal model.
    left : float
        p-value of what the best candidate leaves.
    strange : float
        p-value of what in the record no effect of the library makes.
    gap, where : dict
        As in the answer.
    scores : Scores
        Of the nominal model.
    signs : sequence of Symptom
        That were seen before any effect was fitted.
    words : tuple of str
        What signs say that the best candidate has in it or leaves.
    settings : DiagnosisSettings
        Ties and temperature.
    effects : int
        Effects that were considered.
    controls : sequence of Ranked
        What is no explanation, tried like one.

    Returns
    -------
    Diagnosis

    """
    if not ranked:
        unknown = Explanation(('unknown',), 1.0, ('unknown',), {}, before.value, 0.0, 0.0, 0.0,
                              False)
        return Diagnosis('UNEXPLAINED', 'no effect of those asked for speaks for the gap', gap,
                         {**where, 'site': _sites(scores, (), ())}, (unknown,),
                         {'effects': (), 'class': (), 'probability': 0.0}, (), words)
    best = ranked[0]
    inside = best.deviations <= INSIDE and left >= LEFT_OVER
    shares, none, unknown = posterior(ranked, before, left, strange, effects,
                                      settings.temperature)
    order = np.argsort(-shares, kind='stable')
    ranked, shares = [ranked[i] for i in order], shares[order]
    found = [_explanation(r, p, before, scores, signs, settings) for r, p in zip(ranked, shares)]
    top, known = found[0], max(shares.sum(), 1e-300)
    tied = [e for e in found if len(e.effects) == len(top.effects)
            and (e.effects == top.effects or e.probability > TIED * known)]
    alike = dict.fromkeys(top.alike + tuple(n for e in tied for n in e.effects))
    verdict = {'effects': top.effects, 'class': tuple(alike),
               'probability': float(sum(e.probability for e in tied))}
    if none > DOUBTFUL:
        outcome = 'WITHIN_FLOOR'
        reason = (f'p = {gap["p_value"]:.2g}, but no effect explains the record better than '
                  f'chance does; the nearest is {" + ".join(top.effects)}')
        verdict = {'effects': (), 'class': (), 'probability': none}
    elif not inside or (unknown > DOUBTFUL and top.probability < UNLIKELY):
        share = f'{100 * top.closed:.0f} %' if np.isfinite(top.closed) else 'an unknown share'
        outcome, reason = 'UNEXPLAINED', (
            f'nearest is {" + ".join(top.effects)}, which explains {share} of the gap; '
            f'{best.deviations:.1f} sd are left')
    elif top.probability < SURE * known and len(tied) > 1:
        outcome = 'TIED'
        reason = f'{" and ".join(" + ".join(e.effects) for e in tied)} fit equally well'
    else:
        outcome = 'EXPLAINED'
        reason = f'{" + ".join(top.effects)} leaves {best.deviations:.1f} sd of the gap'
    others = (Explanation(('unknown',), unknown, ('unknown',), {}, before.value, 0.0, 0.0, 0.0,
                          False),
              Explanation(('none',), none, ('none',), {}, before.value, 0.0, 0.0, 0.0, False))
    where = {**where, 'site': _sites(scores, ranked, shares),
             'sensors': _sensors(where['sensors'], ranked, shares)}
    return Diagnosis(outcome, reason, gap, where,
                     tuple(found) + others, verdict, separate_by(verdict['class']), words,
                     tuple({'effects': c.names or ('none',), 'closed': closed(before, c)[0]}
                           for c in controls))


def texts(signs):
    """Return what the signs say."""
    return tuple(s.text for s in signs)


def separate_by(names):
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


def _explanation(ranked, probability, before, scores, signs, settings):
    candidate = ranked.told.candidate
    stds = ranked.told.spread * np.sqrt(np.maximum(np.diag(ranked.fit.covariance), 0.0))
    told = {s.effect.name: s.stds for s in signs if hasattr(s, 'effect')}
    parameters = {}
    moved = list(candidate.numbers())
    effects = tuple(_signed(e, signs) for e in candidate.effects)
    for i, e in enumerate(effects):
        for f in e.numbers():
            value = getattr(e, f.name)
            at = [k for k, (j, g) in enumerate(moved) if j == i and g.name == f.name]
            if at and e is candidate.effects[i]:
                x, std = candidate.point()[at[0]], stds[at[0]]
                low, high = (from_coordinate(f, x + s * 1.645 * std) for s in (-1, 1))
                std = std * abs(value) if is_log(f) else std
            else:
                std = told.get(e.name, {}).get(f.name, float('nan'))
                low, high = value - 1.645 * std, value + 1.645 * std
                if e.spectral and is_log(f):
                    low, high = (value * np.exp(s * 1.645 * std / value) for s in (-1, 1))
            parameters[f'{e.name}.{f.name}'] = Value(value, float(std), float(low), float(high),
                                                     f.metadata['unit'])
    share, low, high = closed(before, ranked)
    return Explanation(ranked.names, float(probability),
                       alike(scores, ranked.names, settings.tie_cosine), parameters,
                       ranked.value, share, low, high, bool(ranked.deviations <= INSIDE),
                       effects)


def _signed(effect, signs):
    """Return an effect as its sign has it, where that sees what the fitted band does not."""
    for s in signs:
        seen = getattr(s, 'effect', None)
        if effect.spectral and seen is not None and seen.name == effect.name and all(
                getattr(seen, f.name) == getattr(effect, f.name) for f in effect.words()):
            return seen
    return effect


def alike(scores, names, limit):
    """Return the effects whose templates cannot be told from those of the names."""
    all_names = np.array([e.name for e in scores.effects])
    found = list(names)
    rows = np.flatnonzero(all_names == names[0]) if len(names) == 1 else []
    if len(rows):
        # the template that explains most stands for the effect
        row = rows[np.argmax(np.abs(scores.z[rows]))]
        found += list(all_names[np.abs(scores.cosine[row]) > limit])
    return tuple(dict.fromkeys(map(str, found)))


def _sensors(sensors, ranked, shares):
    """Return shares of the sensors: candidates that name a channel speak for it."""
    named = dict.fromkeys((s['name'] for s in sensors), 0.0)
    for r, p in zip(ranked, shares):
        for e in r.fit.candidate.effects:
            if getattr(e, 'channel', None) in named:
                named[e.channel] += float(p) / len(r.names)
    rest = max(0.0, 1.0 - sum(named.values()))
    return [{**s, 'share': named[s['name']] + rest * s['share']} for s in sensors]


def _sites(scores, ranked, shares):
    """Return the share of every site: by the candidates' probabilities, else by the scores."""
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
