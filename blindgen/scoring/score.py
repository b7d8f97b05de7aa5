# Licensed under the Apache License, Version 2.0.
"""
Score answers against revealed labels: the verifier's scores, and what stands beside them.

The verifier (verify.py) alone says what is right; here come places, curves, parameter errors, cost
and the list of failures. A class is that of the case's own label: effects that the generator's
information cannot separate there. The answer's own `class` is not used: a tool that calls
everything tied gains nothing.
"""
from blindgen.scoring.answers import places_named
from blindgen.scoring.curves import curves
from blindgen.scoring.places import KINDS, places
from blindgen.verify import read_answer, reliability, row, scores, wilson
import numpy as np


def score(labels, texts, runs=None, closed=None, durations=None):
    """
    Return the scores of a campaign as plain data.

    Parameters
    ----------
    labels : dict of str to dict
        The label of each case: kind and effects.
    texts : dict of str to str
        The answers; a case without one counts as wrong.
    runs : dict of str to dict
        What each answer took: seconds, peak_mb.
    closed : dict of str to dict
        `closed` by the true effect at its true size, where the gap is large enough.
    durations : dict of str to float
        Of the records [s], for places in time.

    Raises
    ------
    ValueError
        If an answer belongs to no case.

    """
    if set(texts) - set(labels):
        raise ValueError(f'{len(set(texts) - set(labels))} answers belong to no case; give those '
                         'of this campaign')
    read = {name: read_answer(texts.get(name)) for name in labels}
    rows = [row(name, labels[name], read[name]) for name in sorted(labels)]
    judged = [places(labels[r['name']]['effects'][0]['where'], read[r['name']]['values'],
                     places_named(texts.get(r['name'])), (durations or {}).get(r['name'], 600.0))
              for r in rows if r['kind'] == 'single' and r['alarm'] and r['d'] >= 4]
    return {
        **scores(rows, closed),
        **{f'{kind}_right': _place(judged, kind) for kind in KINDS},
        'parameter_error': _errors(rows),
        'risk_coverage': _risk(rows),
        'reliability': reliability([r for r in rows if r['answered'] and r['probability'] > 0]),
        'curves': curves(rows),
        'confusion': _confusion([r for r in rows if r['kind'] == 'single' and r['d'] >= 4]),
        'families': _families(rows),
        'most_frequent': _most_frequent(rows),
        **_cost(runs or {}),
        'failures': [r for r in rows if not r['right']],
    }


def _place(judged, kind):
    """Return how often a kind of place is right, and what guessing would give."""
    data = [each[kind] for each in judged if kind in each]
    chance = float(np.mean([c for _, c in data])) if data else None
    return {**wilson(sum(hit for hit, _ in data), len(data)), 'chance': chance}


def _errors(rows):
    """Return the median relative error of each parameter of the strictly named effects."""
    data = {}
    for each in rows:
        for key, error in each['errors'].items():
            data.setdefault(key, []).append(error)
    return {key: {'median': float(np.median(v)), 'total': len(v)}
            for key, v in sorted(data.items())}


def _confusion(rows):
    """Return {true effect: {said: count}} of the detectable single effects."""
    data = {}
    for each in rows:
        line = data.setdefault(each['true'][0], {})
        word = '+'.join(each['data']) or each['outcome']
        line[word] = line.get(word, 0) + 1
    return data


def _families(rows):
    """Return {family: share flagged} of the unknown effects of d' >= 4."""
    data = {}
    for each in rows:
        if each['kind'] == 'outside' and each['d'] >= 4:
            data.setdefault(each['true'][0], []).append(each['right'])
    return {name: wilson(sum(hits), len(hits)) for name, hits in sorted(data.items())}


def _risk(rows):
    """Return the share wrong among the most confident 10, 20, ... 100 % of the cases."""
    order = sorted(rows, key=lambda r: (-r['probability'], r['name']))
    cuts = [max(1, round(len(order) * k / 10)) for k in range(1, 11)]
    return {f'{10 * k}': float(np.mean([not r['right'] for r in order[:cut]]))
            for k, cut in enumerate(cuts, 1)}


def _most_frequent(rows):
    """Return how often the most frequent truth alone would be right."""
    truths = [(r['kind'],) if r['kind'] in ('none', 'outside') else tuple(r['true'])
              for r in rows]
    return wilson(max(map(truths.count, set(truths)), default=0), len(truths))


def _cost(runs):
    """Return median, 95 % and largest of what an answer took."""
    data = {}
    for key in ('seconds', 'cpu_s', 'peak_mb'):
        values = [run[key] for run in runs.values() if key in run]
        if values:
            data[key] = {'median': float(np.median(values)), 'total': len(values),
                         'q95': float(np.quantile(values, 0.95)), 'largest': float(max(values))}
    return data
