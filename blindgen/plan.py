# Licensed under the Apache License, Version 2.0.
"""Which cases a campaign has: effects, sizes, nuisances; all from one seed."""
from dataclasses import asdict, dataclass

from blindgen.detect import size_for
from blindgen.effects import EFFECTS
from blindgen.scenario import Scenario
from blindgen.where import where
import numpy as np

TARGETS = (0.5, 2.0, 4.0, 8.0, 16.0)
TARGETS_LARGE = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
LARGE = 600                 # cases
LEVEL_DB, NOISE, GAIN, STIFFNESS = 3.0, 0.2, 2e-4, 1e-4


@dataclass(frozen=True)
class Case:
    """What is withheld: (name, parameters, d') of each effect, and the seed of the record."""

    kind: str                # none, single, pair, outside
    effects: tuple           # of {name, site, parameters, target, detectability, where}
    seed: int

    def label(self):
        """Return the case as plain data."""
        return asdict(self)


def kinds_of(count):
    """Return how many cases of each kind: a fifth none, a tenth pairs, a tenth outside."""
    none, pair, outside = round(count / 5), round(count / 10), round(count / 10)
    return {'none': none, 'pair': pair, 'outside': outside,
            'single': count - none - pair - outside}


def drafts(count, seed):
    """
    Return the drafts of a campaign in random order: (kind, ((effect, target), ...), seed).

    Singles go round all effects x sizes before any is repeated; a campaign too small for all
    takes a random part.

    Parameters
    ----------
    count : int
        Number of cases; from LARGE on there are seven sizes for five.
    seed : int
        Of everything drawn.

    Raises
    ------
    ValueError
        If fewer than six cases are asked for.

    """
    if count < 6:
        raise ValueError(f'count={count} has no pair and no effect outside the library; '
                         'ask for 6 or more')
    rng = np.random.default_rng(seed)
    targets = TARGETS if count < LARGE else TARGETS_LARGE
    library = sorted(name for name, effect in EFFECTS.items() if effect.library)
    outside = sorted(name for name, effect in EFFECTS.items() if not effect.library)
    want = kinds_of(count)
    singles = _rounds([(name, d) for name in library for d in targets], want['single'], rng)
    strangers = _rounds([(name, d) for name in outside for d in targets], want['outside'], rng)
    jobs = ([('single', (job,)) for job in singles] + [('outside', (job,)) for job in strangers]
            + [('none', ())] * want['none'])
    for _ in range(want['pair']):
        sites = rng.choice(['excitation', 'structure', 'sensor', 'timing'], 2, replace=False)
        names = [str(rng.choice([n for n in library if EFFECTS[n].site == site]))
                 for site in sites]
        jobs.append(('pair', tuple((name, float(rng.choice(targets))) for name in names)))
    return [(*jobs[k], int(rng.integers(2**62))) for k in rng.permutation(len(jobs))]


def case_of(kind, effects, seed, duration_s):
    """
    Return the case of a draft: its effects sized for their targets, and where they show.

    d' counts on the length of the record [s]; everything else follows from the seed.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(98,)))
    level, drawn = nuisances(seed).level, []
    for name, target in effects:
        parameters, d = size_for(name, EFFECTS[name].draw(rng), target, duration_s, level)
        drawn.append({'name': name, 'site': EFFECTS[name].site, 'parameters': parameters,
                      'target': target, 'detectability': d,
                      'where': where(name, parameters, duration_s, seed)})
    return Case(kind, tuple(drawn), seed)


def _rounds(jobs, count, rng):
    """Return `count` jobs: whole rounds in random order, then a random part of one."""
    chosen = []
    while len(chosen) < count:
        chosen += [jobs[k] for k in rng.permutation(len(jobs))]
    return chosen[:count]


def nuisances(seed):
    """Return the spacecraft without effect that the record of a seed is made of."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(99,)))
    return Scenario(
        level=10**(rng.uniform(-LEVEL_DB, LEVEL_DB) / 20),
        noise_level=1 + rng.uniform(-NOISE, NOISE),
        gains=tuple(1 + rng.uniform(-GAIN, GAIN, 4)),
        plate_scale=tuple(1 + rng.uniform(-STIFFNESS, STIFFNESS, 2)))


def scenario_of(case):
    """Return the scenario of a case: its effects on top of its nuisances."""
    scenario = nuisances(case.seed)
    for effect in case.effects:
        scenario = EFFECTS[effect['name']].apply(scenario, effect['parameters'])
    return scenario
