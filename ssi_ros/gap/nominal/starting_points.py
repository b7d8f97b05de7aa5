"""Where fits of effects begin: starting values and what scores say of them, for a model."""
from dataclasses import replace
from itertools import product

import numpy as np

from ssi_ros.effects import effect_class, places, with_laws
from ssi_ros.effects.sizes import at_size, brackets, change_of, LARGE, until_worse
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.thresholds import LIMITS as LEVELS
from ssi_ros.gap.selection.thresholds import SELECTION as LIMITS
from ssi_ros.quantity import in_range, quantities

OTHERS = 5              # starts of an effect beside its best
MOST_PAIRS = 4000       # pairs of templates that are looked through for the best
THINNED = 5             # places, of which one is tried at all sizes
SAME_GAIN = 1.0         # nats by which the gains of starts differ that are equally good
ONE_BASIN = 2.0         # factor of sizes from which a fit comes to the same end


def starting_points(classes, spacecraft):
    """Return every effect that has an expected spectrum at every place and starting value."""
    found = []
    for cls in with_laws(classes):
        if not cls.spectral:
            continue
        for place in places(cls, spacecraft):
            starts = cls.starts_on(spacecraft, place)
            every = (dict(zip(starts, v)) for v in product(*starts.values()))
            found += [cls(**place, **values) for values in every if in_range(cls, values)]
    return [e for e in found if not e.is_null]


def at_any_size(effects, likelihood, kinds):
    """Return starts over all sizes of the most likely kinds, of each a list."""
    found, best = {}, []
    for effect in effects:
        rest = tuple(getattr(effect, f.name) for f in effect.numbers() if f.name != effect.size)
        found.setdefault(effect.kind(), {}).setdefault(rest, effect)
    for starts in map(list, map(dict.values, found.values())):
        many, tried = _of_many_starts(starts[0]), []
        for start in starts[::THINNED if many else 1]:
            tried += [(value, e, start) for value, e in until_worse(
                brackets(start, abs(change_of(start)), LARGE[::2]), likelihood)]
        best.append((many, sorted(tried, key=lambda t: -t[0])))
    best = sorted((b for b in best if b[1]), key=lambda b: -b[1][0][0])[:kinds]
    # where a mass is, its likelihood says; how large a momentum is, hardly
    return [[e for _, e, _ in tried[:OTHERS]] if many else brackets(
        tried[0][2], abs(change_of(tried[0][2])), LARGE) for many, tried in best]


def of_lines(residual, names, spacecraft):
    """Return the effects that make the lines which a Residual has detected."""
    lines = {d.parameters['frequency_hz'] for d in residual.detections + residual.anomalies
             if 'frequency_hz' in d.parameters}
    return [e for name in names for at_hz in lines
            for e in effect_class(name).of_line(spacecraft, at_hz)]


def likely(every, null, settings):
    """
    Return the starts that Scores of the same templates speak for, the first ones first.

    Where the noise of the null fit is beyond a prior deviation, effects that it may have taken up
    are tried as well: around such a level no score speaks for them.
    """
    found = []
    for scores in every:
        best = promising(scores, settings.finalists)
        found += [e for e in best + elsewhere(scores, best)
                  if scores is every[0] or e.kind() not in [f.kind() for f in found]]
    raised = np.log(null.levels[-1]) > LEVELS.noise_std.value
    return found + [e for e in every[0].effects if raised and e.like_noise and e not in found]


def undetected(effects, residual):
    """Return the effects that a Residual has not detected there, which is the better start."""
    detected = [d.basis.kind() for d in residual.detections]
    return [e for e in effects if e.kind() not in detected]


def promising(scores, count):
    """Return the best start of each of the best effects, at the size that its score says."""
    gains, found = scores.gains(), {}
    for i in np.argsort(-gains):
        if gains[i] < LIMITS['promising'].value or len(found) == count:
            break
        found.setdefault(scores.effects[i].name, int(i))
    names = np.array([e.name for e in scores.effects])
    for name, best in found.items():
        # of starts that explain as much, that which is as large already: none is sure far away
        same = np.flatnonzero((names == name) & (gains > gains[best] - SAME_GAIN))
        found[name] = same[np.argmin(np.abs(np.log(np.abs(scores.size[same]))))]
    return [at_size(scores.effects[i], scores.size[i]) for i in found.values()]


def elsewhere(scores, likely):
    """Return other good starts of effects near the best one: a mass may sit in many basins."""
    # Each of many starts of the best effects is tried: a template in a wrong basin says little.
    gains, margin = scores.gains(), LIMITS['pruning_margin'].value
    best, found, tops = gains.max(), {}, {}
    for i in np.argsort(-gains):
        effect = scores.effects[i]
        if gains[i] < LIMITS['promising'].value:
            break
        top = tops.setdefault(effect.name, gains[i])
        first = next((e for e in likely if e.name == effect.name), None)
        rest = found.setdefault(effect.name, [])
        if first is None or len(rest) == OTHERS:
            continue
        others = [f.name for f in quantities(effect) if f.name != effect.size]
        many = _of_many_starts(effect)
        near = gains[i] >= best - max(margin, best / 2)
        basin = many and top >= best - margin and _same(
            effect, first, [f.name for f in effect.words()])
        start = at_size(effect, scores.size[i])
        if (near or basin) and not _same(start, first, many or others) and not any(
                _same(start, k, many or others) and (many or _near(start, k)) for k in rest):
            rest.append(start)
    return [e for rest in found.values() for e in rest]


def _same(one, other, names):
    return all(getattr(one, n) == getattr(other, n) for n in names)


def _of_many_starts(effect):
    """Return the quantities beside the size that have starts in many basins, such as a place."""
    return [f.name for f in quantities(effect)
            if f.name != effect.size and len(effect.starts.get(f.name, ())) > 2]


def _near(one, other):
    """Return whether two starts at one place have so nearly one size that a fit joins them."""
    if not one.size:
        return False
    first, second = (getattr(e, e.size) for e in (one, other))
    return first * second > 0.0 and ONE_BASIN > first / second > 1 / ONE_BASIN


def in_other_basins(effect, scores):
    """
    Return a fitted effect where Scores around it would have more of it, the first ones first.

    Half of a mass at the wrong place may stand for one that no template at its own place promised.
    """
    many = _of_many_starts(effect)
    best = [scores.effects[i] for i in np.argsort(-scores.gains())] if many else ()
    found = (replace(effect, **{n: getattr(e, n) for n in many})
             for e in best if e.kind() == effect.kind())
    return list(dict.fromkeys(found))[:OTHERS]


def replacements(scores, candidate):
    """Return candidates in which one effect is replaced by a nearly indistinguishable one."""
    found = {}
    for effect in candidate.effects:
        others = tuple(e for e in candidate.effects if e is not effect)
        own = [i for i, e in enumerate(scores.effects) if e.name == effect.name
               and _same(e, effect, [f.name for f in effect.words()])]
        alike = np.abs(scores.cosine[own]).max(axis=0, initial=0.0)
        for j in np.flatnonzero(alike > LIMITS['indistinguishable'].value):
            e = scores.effects[j]
            if e.answer not in candidate.names and not (e.nonlinear or e.law_of):
                found.setdefault((e.name, others), Candidate(
                    (*others, at_size(e, scores.size[j]))))
    return list(found.values())


def rivals(ranked, count):
    """Return the best fitted effect of each of the first kinds."""
    every = [e for r in ranked for e in r.fit.candidate.effects]
    first = {e.name: e for e in reversed(every)}
    return [first[name] for name in dict.fromkeys(e.name for e in every)][:count]


def promising_pairs(scores, count):
    """Return the pairs of different effects whose templates explain most together."""
    z, r = scores.z, scores.cosine
    both = (z[:, None] ** 2 + z ** 2 - 2 * r * np.outer(z, z)) / np.maximum(1 - r ** 2, 0.02) / 2
    names = np.array([e.name for e in scores.effects])
    both[names[:, None] == names] = 0.0
    found = {}
    for flat in np.argsort(-both, axis=None)[:MOST_PAIRS]:
        if len(found) == count:
            break
        i, j = np.unravel_index(flat, both.shape)
        inner = np.linalg.solve(np.array([[1, r[i, j]], [r[i, j], 1 + 1e-6]]), [z[i], z[j]])
        sizes = inner / scores.detection[[i, j]]
        effects = (scores.effects[i], scores.effects[j])
        if i > j or any(e.one_sided() and s <= 0 for e, s in zip(effects, sizes)):
            continue
        key = frozenset((names[i], names[j]))
        found.setdefault(key, tuple(at_size(e, s) for e, s in zip(effects, sizes)))
    return list(found.values())
