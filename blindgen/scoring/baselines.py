# Licensed under the Apache License, Version 2.0.
"""
What a user would try instead: table of shifts, random forest, two-sample test, neural posterior.

They compare each record with its first healthy recording, and learn from cases of this very
generator with other seeds: more than a diagnosis from a model is given. None of them knows an
effect outside the library. The neural posterior is amortised: a network on summary statistics,
trained by its log score on simulated cases, gives the probability of each effect.
"""
import hashlib
import json
from pathlib import Path

from blindgen.cases.bag import read_bag
from blindgen.cases.draw import draw_case, healthy
from blindgen.cases.make import at_hand
from blindgen.cases.plan import Case, case_of, scenario_of
from blindgen.effects.base import EFFECTS
from blindgen.physics.record import simulate
from blindgen.run.spread import spread
from blindgen.scoring.features import features
import numpy as np

SIZES = (3.0, 30.0)         # attainable d' of the training cases
SEED = 8_000_000            # of the training cases; no case has it
NULLS = 60
FALSE_ALARM = 0.05
TREES = 300
KINDS = ('spectrum', 'shifts', 'samples')


def training(scope, rounds, client, cache):
    """
    Return labels (n,) and features {kind: (n, f)} of the training records, kept in a folder.

    Each round has every library effect once; NULLS records have none.
    """
    root = Path(__file__).parent.parent
    source = b''.join(p.read_bytes() for p in sorted(root.rglob('*.py'))
                      if p.parent.name in ('physics', 'effects', 'sizes', 'cases')
                      or p.stem == 'features')
    key = hashlib.sha256(source + f'{scope} {rounds} {NULLS} {SIZES}'.encode()).hexdigest()
    path = Path(cache) / f'baselines-{key[:16]}.npz'
    if not path.exists():
        names = sorted(name for name, e in EFFECTS.items() if e.library)
        jobs = [(n, k, scope) for k, n in enumerate(rounds * names + ['none'] * NULLS)]
        data = sorted(spread(client, _example, jobs, 'training'), key=lambda one: one[0])
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix('.part.npz')
        np.savez_compressed(part, labels=[name for _, name, _ in data], **{
            kind: np.array([f[kind] for *_, f in data]) for kind in KINDS})
        part.replace(path)
    with np.load(path) as kept:
        return kept['labels'], {kind: kept[kind] for kind in KINDS}


def _example(name, k, scope):
    """Return k, the effect and the features of one training case."""
    seed = SEED + k
    target = float(SIZES[0] * (SIZES[1] / SIZES[0])**np.random.default_rng(seed).random())
    draft = draw_case(seed, scope)
    case = (Case('none', (), seed) if name == 'none' else
            case_of('single', ((name, target),), seed, scope, places=False))
    known, duration = healthy(seed, draft)[0]
    return k, name, features(simulate(scenario_of(case, draft), draft.duration_s, seed),
                             simulate(known, duration, seed + 2**40))


def baselines(folder, labels, scope, rounds, client, cache):
    """Return {baseline: {case: text of its answer}} for the cases of a campaign."""
    truths, old = training(scope, rounds, client, cache)
    jobs = [(folder, name, labels[name], scope) for name in sorted(labels)]
    got = dict(spread(client, _measured, jobs, 'baselines'))
    names = sorted(got)
    new = {kind: np.array([got[name][kind] for name in names]) for kind in KINDS}
    return {way.__name__: dict(zip(names, way(truths, old, new)))
            for way in (shift_table, random_forest, two_sample, neural_posterior)}


def _measured(folder, name, label, scope):
    craft = draw_case(label['seed'], scope).nominal
    with at_hand(folder, name, label, scope) as case:
        return name, features(read_bag(case / 'bag', craft), read_bag(case / 'healthy_1', craft))


def shift_table(labels, old, new):
    """Answer by frequency and damping shifts: any beyond the nulls, then the nearest pattern."""
    from sklearn.neighbors import KNeighborsClassifier
    null = old['shifts'][labels == 'none']
    mean, sd = null.mean(axis=0), null.std(axis=0, ddof=1)
    z, past = (new['shifts'] - mean) / sd, (old['shifts'] - mean) / sd
    limit = np.quantile(_one_out(null, lambda z: np.abs(z).max()), 1 - FALSE_ALARM)
    shifted = (np.abs(past).max(axis=1) > limit) & (labels != 'none')
    if not shifted.any():                        # nothing was learnt but what is quiet
        return [_answer('UNEXPLAINED' if np.abs(each).max() > limit else 'WITHIN_FLOOR')
                for each in z]
    nearest = KNeighborsClassifier(min(5, int(shifted.sum())), metric='cosine',
                                   weights='distance')
    nearest.fit(past[shifted], labels[shifted])
    return [_ranked(nearest.classes_, p) if np.abs(each).max() > limit
            else _answer('WITHIN_FLOOR') for each, p in zip(z, nearest.predict_proba(z))]


def random_forest(labels, old, new):
    """Answer by a forest on all features; no effect is one of its classes."""
    from sklearn.ensemble import RandomForestClassifier
    forest = RandomForestClassifier(TREES, random_state=0, class_weight='balanced')
    forest.fit(_all(old), labels)
    return [_ranked(forest.classes_, p) for p in forest.predict_proba(_all(new))]


def neural_posterior(labels, old, new):
    """Answer by a network on all features, trained by its log score, stopped on a tenth."""
    from sklearn.neural_network import MLPClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import QuantileTransformer
    network = make_pipeline(
        QuantileTransformer(n_quantiles=min(100, len(labels)), output_distribution='normal'),
        MLPClassifier((64, 64), alpha=0.1, early_stopping=len(labels) > 300, max_iter=400,
                      random_state=0))
    network.fit(_all(old), labels)
    return [_ranked(network.classes_, p) for p in network.predict_proba(_all(new))]


def two_sample(labels, old, new):
    """Answer whether the spectrum differs from the healthy one's; not why."""
    null = old['spectrum'][labels == 'none']
    limit = np.quantile(_one_out(null, lambda z: np.mean(z**2)), 1 - FALSE_ALARM)
    z = (new['spectrum'] - null.mean(axis=0)) / null.std(axis=0, ddof=1)
    return [_answer('UNEXPLAINED' if d > limit else 'WITHIN_FLOOR')
            for d in np.mean(z**2, axis=1)]


def _all(each):
    return np.nan_to_num(np.hstack([each[kind] for kind in KINDS]))


def _one_out(null, statistic):
    """Return a statistic of each null record's z against all others, as a new record has it."""
    data = []
    for k in range(len(null)):
        others = np.delete(null, k, axis=0)
        data.append(statistic((null[k] - others.mean(axis=0)) / others.std(axis=0, ddof=1)))
    return np.array(data)


def _answer(outcome, effects=(), probability=0.0, ranked=()):
    """Return the text of an answer."""
    return json.dumps({'schema': 'ssi_ros/diagnosis/1', 'outcome': outcome,
                       'verdict': {'effects': list(effects), 'probability': probability},
                       'candidates': [{'effects': [name]} for name in ranked]})


def _ranked(classes, shares):
    """Return the answer of a classifier from the share of each class."""
    order = [str(classes[k]) for k in np.argsort(shares)[::-1]]
    ranked = [name for name in order if name != 'none']
    if order[0] == 'none':
        return _answer('WITHIN_FLOOR', (), float(np.max(shares)), ranked)
    return _answer('EXPLAINED', ranked[:1], float(np.max(shares)), ranked)
