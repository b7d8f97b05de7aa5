# Licensed under the Apache License, Version 2.0.
"""
Which cases a campaign has; all from one seed, and nothing of it public before the reveal.

The shares of the kinds, how often each effect comes, and the distribution of the sizes are drawn
for each campaign: no prior that a tool may hold equals them.
"""
from dataclasses import asdict, dataclass

from blindgen.cases.draw import before, draw_case, healthy, Scope, stream
from blindgen.cases.where import where
from blindgen.effects.base import EFFECTS
from blindgen.sizes.classes import rivals, same
from blindgen.sizes.information import Knowledge, Record
from blindgen.sizes.predict import size_for
import numpy as np


@dataclass(frozen=True)
class Case:
    """What is withheld: each effect with its parameters and sizes, and the seed of the records."""

    kind: str                # none, single, pair, outside
    effects: tuple
    seed: int

    def label(self):
        """Return the case as plain data."""
        return asdict(self)


def drafts(count, seed, scope=Scope()):
    """
    Return the drafts of a campaign in random order: (kind, ((effect, target), ...), seed).

    Targets are attainable d' between the two of the sizes of the scope.

    Raises
    ------
    ValueError
        If fewer than six cases are asked for.

    """
    if count < 6:
        raise ValueError(f'count={count} has no pair and no effect outside the library; '
                         'ask for 6 or more')
    rng = np.random.default_rng(seed)
    want = {kind: max(1, round(count * rng.uniform(*share))) for kind, share in scope.shares}
    want['single'] = count - sum(want.values())
    shape = rng.uniform(0.8, 2.0, 2)
    library = sorted(name for name, effect in EFFECTS.items() if effect.library)
    families = sorted(name for name, effect in EFFECTS.items() if not effect.library)
    often = {names[0]: rng.dirichlet(np.full(len(names), 3.0)) for names in (library, families)}

    def one(names):
        size = scope.sizes[0] * (scope.sizes[1] / scope.sizes[0])**rng.beta(*shape)
        return str(rng.choice(names, p=often[names[0]])), float(size)

    jobs = [('none', ())] * want['none']
    jobs += [('single', (one(library),)) for _ in range(want['single'])]
    jobs += [('outside', (one(families),)) for _ in range(want['outside'])]
    while want['pair']:
        two = one(library), one(library)
        if len({EFFECTS[name].site for name, _ in two}) == 2:
            jobs.append(('pair', two))
            want['pair'] -= 1
    return [(*jobs[k], int(rng.integers(2**62))) for k in rng.permutation(len(jobs))]


def case_of(kind, effects, seed, scope=Scope(), places=True):
    """
    Return the case of a draft: its effects sized for their targets, and where they show.

    An effect that the drawn spacecraft cannot have (an asymmetry of one array) is drawn as the
    stiffness of all arrays. Without `places` neither its rivals nor where it shows are
    computed.
    """
    if not effects:
        return Case(kind, (), seed)
    knowledge, rng, drawn = knowledge_of(seed, scope), stream(seed, 98), []
    craft, duration = knowledge.record.scenario.craft, knowledge.record.duration_s
    for name, target in effects:
        name = name if EFFECTS[name].fits(craft) else 'stiffness_scale'
        effect = EFFECTS[name]
        parameters, sizes = size_for(knowledge, name, effect.draw(rng, craft, duration), target)
        data = {'name': name, 'site': effect.site, 'parameters': plain(parameters),
                'target': target, 'detectability': float(sizes['attainable']),
                'alone': float(sizes['alone'])}
        if effect.library and places:
            found = rivals(knowledge, name, parameters, sizes['alone'], seed % 2**32)
            data.update(rivals=found, same=same(found),
                        where=where(knowledge, name, parameters, seed))
        drawn.append(data)
    return Case(kind, tuple(drawn), seed)


def plain(value):
    """Return parameters as plain data that JSON repeats to the last digit."""
    if isinstance(value, dict):
        return {key: plain(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value


def knowledge_of(seed, scope=Scope()):
    """Return what a diagnosis can know of the record of a seed, with its healthy recordings."""
    draft = draw_case(seed, scope)
    return Knowledge(Record(before(seed, draft), draft.duration_s),
                     [Record(*each) for each in healthy(seed, draft)])


def scenario_of(case, draft):
    """Return the scenario of a case: its effects on top of its own state."""
    scenario = before(case.seed, draft)
    for effect in case.effects:
        scenario = EFFECTS[effect['name']].apply(scenario, effect['parameters'])
    return scenario
