"""From scores and signs to fitted candidates: single effects, large ones, pairs."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects import effect_class
from ssi_ros.gap.candidate import Candidate, places
from ssi_ros.gap.fit import fit
from ssi_ros.gap.rank import Ranked, worth
from ssi_ros.gap.tolerance import tolerances
from ssi_ros.quantity import quantities

FIRST_STEPS = 6         # of a fit, before the best are chosen
BEHIND = 12.0           # log likelihood behind the best at which a candidate is given up
PROMISING = 2.0         # gain of the log likelihood that a template must promise
KEPT = 5                # candidates that are fitted to the end, at most
RIVALS = 3              # and at least, however bad: what a wrong effect closes is told
LOOK_STEPS = 2          # of a fit at one of many sizes
HOPEFUL = 3             # sizes of an effect that are fitted further
OTHERS = 5              # starts of an effect beside its best
SIZES = (0.3, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0)    # starting values of a large size
PAIRS = 4               # pairs that are fitted
ALIKE = 0.97            # cosine of templates above which one effect is as good as the other


class Search:
    """
    The record, the model side and what is asked for; fits candidates on demand.

    `relief` returns the log likelihood of what a fit explains and the spectrum does not show.
    """

    def __init__(self, simulator, evidence, settings, nominal, tolerance, names, tell, relief):
        self.simulator, self.evidence, self.settings = simulator, evidence, settings
        self.nominal, self.tolerance, self.names = nominal, tolerance, names
        self.tell, self.relief = tell, relief

    def singles(self, scores, signs):
        """
        Fit the single effects that scores and signs speak for.

        Parameters
        ----------
        scores : Scores
            Of the nominal model.
        signs : sequence of Symptom
            Of the samples and of the torque.

        Returns
        -------
        list of Ranked, best first

        """
        starts = [s.effect for s in signs]
        seen = {s.name for s in starts}
        likely = promising(scores, self.settings.finalists)
        starts += [e for e in likely + elsewhere(scores, likely) if e.name not in seen]
        ranked = self._fit_all([Candidate((e,)) for e in starts], signs, self.nominal)
        if not ranked:
            return ranked
        kin = [Candidate((e,)) for e in relatives(ranked[0].fit.candidate.effects[0], self.names)]
        return self._sorted(ranked + self._fit_all(kin, signs, ranked[0].fit)) if kin else ranked

    def wider(self, known, signs):
        """Fit effects from sizes far away, for a gap that no small one explains."""
        starts = []
        for name in list(dict.fromkeys(n for r in known for n in r.names))[:RIVALS]:
            best = next(r for r in known if name in r.names)
            effect = best.fit.candidate.effects[best.names.index(name)]
            looks = [fit(self.simulator, self.evidence, Candidate((e,)), self.nominal.levels,
                         LOOK_STEPS, self.tolerance) for e in brackets(effect)]
            looks = sorted((f for f in looks if f is not None), key=lambda f: -f.likelihood)
            starts += [f.candidate for f in looks[:HOPEFUL]]
        more = self._fit_all(starts, signs, self.nominal)
        return self._sorted(known + more)

    def pairs(self, scores, second, singles, signs, more):
        """
        Fit the pairs of effects that explain most together.

        Parameters
        ----------
        scores, second : Scores
            Of the nominal model, and of what the best single effect leaves.
        singles : list of Ranked
            Best first.
        signs, more : sequence of Symptom
            Of the nominal model, and those that the best single effect leaves.

        Returns
        -------
        list of Ranked, best first

        """
        best = singles[0].fit.candidate
        couples = [best.with_one_more(e) for e in promising(second, PAIRS)
                   if e.name not in best.names]
        couples += [best.with_one_more(s.effect) for s in more if s.effect.name not in best.names]
        couples += [Candidate(p) for p in promising_pairs(scores, PAIRS)]
        unique = {}
        for couple in couples:
            unique.setdefault(tuple(sorted(
                (e.name, *(getattr(e, f.name) for f in e.words())) for e in couple.effects)),
                couple)
        # what the best effect explains alone is no merit of a second one; of slow noise `relief`
        # tells it of every pair
        kept = list(more) + [s for s in signs if s.effect.name in (*best.names, 'sensor_drift')]
        found = self._fit_all(list(unique.values()), kept, singles[0].fit)
        # a clock is as good as another stiffness beside anything
        known = {frozenset(r.names) for r in found}
        twins = [c for r in found[:1] for c in lookalikes(scores, r.fit.candidate)
                 if frozenset(c.names) not in known]
        return self._sorted(found + self._fit_all(twins, kept, singles[0].fit))

    def at_random(self, templates, known):
        """Fit one effect that nothing speaks for, drawn at random but the same for a record."""
        named = {n for r in known for n in r.names}
        others = [e for e in templates.effects if e.name not in named]
        if not others:
            return []
        draw = np.random.default_rng(abs(int(1e6 * self.nominal.likelihood)))
        fitted = fit(self.simulator, self.evidence,
                     Candidate((others[draw.integers(len(others))],)), self.nominal.levels,
                     FIRST_STEPS, self.tolerance)
        return [] if fitted is None else [Ranked(fitted)]

    def _fit_all(self, candidates, signs, start):
        """Fit all candidates a little, the best ones to the end."""
        bonuses = {s.effect.name: -np.log(max(s.p_value, 1e-300)) for s in signs}
        first = []
        for i, candidate in enumerate(candidates):
            self.tell(i / len(candidates))
            fitted = fit(self.simulator, self.evidence, candidate, start.levels, FIRST_STEPS,
                         self.tolerance)
            if fitted is not None:
                first.append(self._ranked(fitted, bonuses))
        first = self._sorted(first)
        done = []
        for ranked in first[:KEPT]:
            if len(done) >= RIVALS and first[0].evidence - ranked.evidence > BEHIND:
                break
            old = ranked.fit
            around = tolerances(self.simulator, old.candidate, old.levels, self.settings)
            fitted = fit(self.simulator, self.evidence, old.candidate, old.levels,
                         tolerance=around)
            if fitted is not None:
                found = self._ranked(fitted, bonuses)
                done.append(replace(found, bonus=found.bonus + self.relief(fitted)))
        return self._sorted(done)

    def _ranked(self, fitted, bonuses):
        candidate = fitted.candidate
        count = 1
        for e in candidate.effects:
            count *= max(1, sum(1 for _ in places(type(e), self.simulator.spacecraft)))
        return Ranked(fitted, self._bonus(candidate, bonuses), count)

    def _bonus(self, candidate, bonuses):
        """Return the log likelihood of signs beyond what the spectrum has of them already."""
        total = 0.0
        for e in candidate.effects:
            if e.name in bonuses:
                alone = fit(self.simulator, self.evidence, Candidate((e,)), self.nominal.levels,
                            FIRST_STEPS, self.tolerance)
                shown = alone.likelihood - self.nominal.likelihood if alone else 0.0
                total += max(bonuses[e.name] - max(shown, 0.0), 0.0)
        return total

    def _sorted(self, ranked):
        ordered = sorted(ranked, key=lambda r: -worth(r, len(self.names)))
        found = {}
        for r in ordered:
            found.setdefault(tuple(sorted(r.names)), r)
        return list(found.values())


def promising(scores, count):
    """Return the best start of each of the best effects, at the size that its score says."""
    gains = scores.gains()
    found = {}
    for i in np.argsort(-gains):
        if gains[i] < PROMISING or len(found) == count:
            break
        found.setdefault(scores.effects[i].name, at_size(scores.effects[i], scores.size[i]))
    return list(found.values())


def elsewhere(scores, likely):
    """
    Return other good starts of effects near the best one: a mass may sit in many basins.

    Of a number with many starts each value is tried, if its effect is among the best: a template
    in the wrong basin says little.
    """
    gains = scores.gains()
    best, found, tops = gains.max(), {}, {}
    for i in np.argsort(-gains):
        effect = scores.effects[i]
        if gains[i] < PROMISING:
            break
        top = tops.setdefault(effect.name, gains[i])
        first = next((e for e in likely if e.name == effect.name), None)
        rest = found.setdefault(effect.name, [])
        if first is None or len(rest) == OTHERS:
            continue
        others = [f.name for f in quantities(effect) if f.name != effect.size]
        many = [n for n in others if len(effect.starts.get(n, ())) > 2]
        near = gains[i] >= best - max(BEHIND, best / 2)
        basin = many and top >= best - BEHIND and _same(
            effect, first, [f.name for f in effect.words()])
        if (near or basin) and not any(
                _same(effect, k, many or others) for k in ([first, *rest] if many else [first])):
            rest.append(at_size(effect, scores.size[i]))
    return [e for rest in found.values() for e in rest]


def _same(one, other, names):
    return all(getattr(one, n) == getattr(other, n) for n in names)


def relatives(effect, names):
    """
    Return effects that have all quantities of another and more, at its values and a small size.

    A hinge with play is a hinge: it is as good an answer as long as nothing tells of the play.
    """
    shared = {f.name for f in quantities(effect)}
    found = []
    for name in names:
        cls = effect_class(name)
        if cls is type(effect) or not cls.nonlinear or not cls.spectral:
            continue
        common = {f.name: getattr(effect, f.name) for f in quantities(cls) if f.name in shared
                  and f.name != cls.size}
        if {f.name for f in quantities(cls)} - {cls.size} == set(common) and len(common) > 1:
            found.append(cls(**common, **{cls.size: min(cls.starts[cls.size])}))
    return found


def lookalikes(scores, candidate):
    """Return candidates in which one effect is replaced by what can hardly be told from it."""
    found = {}
    for effect in candidate.effects:
        others = tuple(e for e in candidate.effects if e is not effect)
        own = [i for i, e in enumerate(scores.effects) if e.name == effect.name
               and _same(e, effect, [f.name for f in effect.words()])]
        alike = np.abs(scores.cosine[own]).max(axis=0, initial=0.0)
        for j in np.flatnonzero(alike > ALIKE):
            e = scores.effects[j]
            if e.name not in candidate.names and not e.nonlinear:
                found.setdefault((e.name, others), Candidate(
                    (*others, at_size(e, scores.size[j]))))
    return list(found.values())


def promising_pairs(scores, count):
    """Return the pairs of different effects whose templates explain most together."""
    z, r = scores.z, scores.cosine
    both = (z[:, None] ** 2 + z ** 2 - 2 * r * np.outer(z, z)) / np.maximum(1 - r ** 2, 0.02) / 2
    names = np.array([e.name for e in scores.effects])
    both[names[:, None] == names] = 0.0
    found = {}
    for flat in np.argsort(-both, axis=None)[:4000]:
        i, j = np.unravel_index(flat, both.shape)
        inner = np.linalg.solve(np.array([[1, r[i, j]], [r[i, j], 1 + 1e-6]]), [z[i], z[j]])
        sizes = inner / scores.detection[[i, j]]
        effects = (scores.effects[i], scores.effects[j])
        if i > j or any(e.one_sided() and s <= 0 for e, s in zip(effects, sizes)):
            continue
        key = frozenset((names[i], names[j]))
        found.setdefault(key, tuple(at_size(e, s) for e, s in zip(effects, sizes)))
        if len(found) == count:
            break
    return list(found.values())


def at_size(effect, size):
    """Return an effect at the size whose change of the spectrum is `size` times its own."""
    share = float(np.clip(abs(size), 1e-4, 30.0)) ** (1.0 / effect.power)
    values = {}
    for f in effect.numbers():
        null, value = f.default, getattr(effect, f.name)
        if f.name not in (effect.size, *effect.together):
            continue
        if np.isfinite(null):
            value = null + np.copysign(share, size or 1.0) * (value - null)
        else:
            value = value * share
        values[f.name] = min(max(value, f.metadata['low']), f.metadata['high'])
    return replace(effect, **values)


def brackets(effect):
    """Return an effect at sizes over its declared range, near enough that a fit finds any."""
    f = next(f for f in effect.numbers() if f.name == effect.size)
    start = max((abs(v - f.default) for v in effect.starts[f.name] if np.isfinite(f.default)),
                default=None)
    if start is None or not effect.spectral:
        return []
    signs = (1.0,) if effect.one_sided() else (-1.0, 1.0)
    values = [f.default + s * start * k for s in signs for k in SIZES]
    return [replace(effect, **{f.name: v}) for v in values
            if f.metadata['low'] <= v <= f.metadata['high']]
