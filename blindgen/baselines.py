# Licensed under the Apache License, Version 2.0.
"""
What simpler ways would have answered: a table of shifts, a random forest, a two-sample test.

They learn from records of this very generator, with the campaign's own sizes and nuisances but
other seeds: more than a diagnosis from a model is given. None of them knows an effect outside the
library. The fourth, always the most frequent truth, needs no record and is in score.py.
"""
import hashlib
from pathlib import Path

from blindgen.answers import Answer
from blindgen.bag import read_bag
from blindgen.detect import magnitude_for
from blindgen.effects import EFFECTS
from blindgen.features import features
from blindgen.plan import nuisances
from blindgen.record import simulate
from blindgen.spread import spread
import numpy as np

SIZES = (2.0, 4.0, 8.0, 16.0)
SEED = 8_000_000            # of the training records; no case has it
NULLS = 60
FALSE_ALARM = 0.05
TREES = 300


def training(duration_s, rounds, client, cache):
    """
    Return labels (n,) and features {kind: (n, f)} of the training records, kept in a folder.

    Each round has every library effect in four sizes; NULLS records have none. The size of an
    effect is found once and used for all places, so d' is met to some tens of percent.
    """
    source = b''.join(p.read_bytes() for p in sorted(Path(__file__).parent.glob('*.py'))
                      if p.stem in ('craft', 'detect', 'effects', 'features', 'march', 'record',
                                    'sensors', 'sparse', 'whittle'))
    key = hashlib.sha256(source + f'{duration_s} {rounds} {NULLS} {SIZES}'.encode()).hexdigest()
    path = Path(cache) / f'baselines-{key[:16]}.npz'
    if not path.exists():
        names = sorted(name for name, e in EFFECTS.items() if e.library)
        sized = dict(spread(client, _size, [(n, d, duration_s) for n in names for d in SIZES],
                            'sizes'))
        jobs = [(n, sized[n, d], duration_s) for _ in range(rounds) for n in names for d in SIZES]
        jobs = [(*job, k) for k, job in enumerate(jobs + [('none', 0.0, duration_s)] * NULLS)]
        told = sorted(spread(client, _example, jobs, 'training'), key=lambda row: row[0])
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix('.part.npz')
        np.savez_compressed(part, labels=[name for _, name, _ in told], **{
            kind: np.array([seen[kind] for *_, seen in told]) for kind in told[0][2]})
        part.replace(path)
    with np.load(path) as kept:
        return kept['labels'], {kind: kept[kind] for kind in kept.files if kind != 'labels'}


def _size(name, target, duration_s):
    """Return (name, target) and the size m of an effect whose d' is the target."""
    variant = EFFECTS[name].draw(np.random.default_rng(SEED))
    return (name, target), magnitude_for(name, variant, target, duration_s)[0]


def _example(name, size, duration_s, k):
    """Return k, the effect and the features of one training record."""
    rng = np.random.default_rng([SEED, k])
    scenario = nuisances(SEED + k)
    if name != 'none':
        effect = EFFECTS[name]
        scenario = effect.apply(scenario, effect.size(effect.draw(rng), size))
    return k, name, features(*simulate(scenario, duration_s, SEED + k), duration_s)


def baselines(folder, names, duration_s, rounds, client, cache):
    """Return {baseline: {bag: Answer}} for the bags of a campaign."""
    labels, seen = training(duration_s, rounds, client, cache)
    jobs = [(folder, name, duration_s) for name in names]
    bags = dict(spread(client, _seen, jobs, 'baselines'))
    names = sorted(bags)
    new = {kind: np.array([bags[name][kind] for name in names]) for kind in seen}
    return {'shift_table': dict(zip(names, shift_table(labels, seen, new))),
            'random_forest': dict(zip(names, random_forest(labels, seen, new))),
            'two_sample': dict(zip(names, two_sample(labels, seen, new)))}


def _seen(folder, name, duration_s):
    return name, features(*read_bag(Path(folder) / 'bags' / name), duration_s)


def shift_table(labels, seen, new):
    """Answer by frequency and damping shifts: any beyond the nulls, then the nearest pattern."""
    from sklearn.neighbors import KNeighborsClassifier
    null = seen['shifts'][labels == 'none']
    mean, sd = null.mean(axis=0), null.std(axis=0, ddof=1)
    z, old = (new['shifts'] - mean) / sd, (seen['shifts'] - mean) / sd
    limit = np.quantile(_one_out(null, lambda z: np.abs(z).max()), 1 - FALSE_ALARM)
    shifted = (np.abs(old).max(axis=1) > limit) & (labels != 'none')
    if not shifted.any():                        # nothing was learnt but what is quiet
        return [Answer('UNEXPLAINED' if np.abs(row).max() > limit else 'WITHIN_FLOOR')
                for row in z]
    nearest = KNeighborsClassifier(min(5, int(shifted.sum())), metric='cosine',
                                   weights='distance')
    nearest.fit(old[shifted], labels[shifted])
    return [_told(nearest.classes_, p) if np.abs(row).max() > limit else Answer('WITHIN_FLOOR')
            for row, p in zip(z, nearest.predict_proba(z))]


def random_forest(labels, seen, new):
    """Answer by a forest on spectra and sample statistics; no effect is one of its classes."""
    from sklearn.ensemble import RandomForestClassifier
    forest = RandomForestClassifier(TREES, random_state=0, class_weight='balanced')
    forest.fit(np.hstack([seen['spectrum'], seen['samples']]), labels)
    return [_told(forest.classes_, p) for p in
            forest.predict_proba(np.hstack([new['spectrum'], new['samples']]))]


def two_sample(labels, seen, new):
    """Answer whether the spectrum differs from that of records without effect; not why."""
    null = seen['spectrum'][labels == 'none']
    limit = np.quantile(_one_out(null, lambda z: np.mean(z**2)), 1 - FALSE_ALARM)
    z = (new['spectrum'] - null.mean(axis=0)) / null.std(axis=0, ddof=1)
    return [Answer('UNEXPLAINED' if d > limit else 'WITHIN_FLOOR') for d in np.mean(z**2, axis=1)]


def _one_out(null, statistic):
    """Return a statistic of each null record's z against all others, as a new record has it."""
    told = []
    for k in range(len(null)):
        others = np.delete(null, k, axis=0)
        told.append(statistic((null[k] - others.mean(axis=0)) / others.std(axis=0, ddof=1)))
    return np.array(told)


def _told(classes, shares):
    """Return the answer of a classifier from the share of each class."""
    order = [classes[k] for k in np.argsort(shares)[::-1]]
    ranked = tuple(frozenset([str(name)]) for name in order if name != 'none')
    if order[0] == 'none':
        return Answer('WITHIN_FLOOR', probability=float(np.max(shares)), ranked=ranked)
    return Answer('EXPLAINED', ranked[0], ranked[0], float(np.max(shares)), ranked,
                  site=EFFECTS[order[0]].site)
