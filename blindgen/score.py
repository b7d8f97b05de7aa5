# Licensed under the Apache License, Version 2.0.
"""
Score answers against revealed labels.

Shares have Wilson's 95 % interval; means over effects and the calibration error have a bootstrap
over cases. `strict` is the same effect; `class` also counts an effect in one declared class with
the true one. The answer's own `class` is not used: a tool that calls everything tied gains
nothing. An effect too weak to see that is called within the floor, and surely so, counts as wrong
and confident; beside it stands the same for the answers that see a gap (`alarm`).
"""
from blindgen.curves import curves
from blindgen.places import places
from blindgen.wilson import wilson
import numpy as np

CLEAR = 3.4                  # d' from which a case counts: 4, less the 15 % sizes are found to
CONFIDENT = 0.9
BOOTSTRAPS = 1000


def score(labels, answers, classes=(), runs=None, truths=None, duration_s=600.0):
    """
    Return the scores of a campaign as plain data.

    Parameters
    ----------
    labels : dict of str to dict
        The label of each bag: kind and effects.
    answers : dict of str to Answer
        The order does not matter; a bag without an answer counts as wrong.
    classes : iterable of iterables of str
        Equivalence classes declared before the run.
    runs : dict of str to dict
        What each answer took: seconds, peak_mb.
    truths : dict of str to dict
        `closed` by the true effect at its true size, where the gap is large enough.
    duration_s : float
        Of a record [s].

    Raises
    ------
    ValueError
        If an answer belongs to no bag or a bag has none.

    """
    if set(labels) != set(answers):
        raise ValueError(f'{len(set(labels) ^ set(answers))} names are in labels or answers '
                         'alone; give one answer, if only NO_ANSWER, for each bag')
    same = [frozenset(c) for c in classes]
    rows = [_row(name, labels[name], answers[name], same, duration_s) for name in sorted(labels)]
    clear = [r for r in rows if r['kind'] == 'single' and r['d'] >= CLEAR]
    none = [r for r in rows if r['kind'] == 'none']
    outside = [r for r in rows if r['kind'] == 'outside' and r['d'] >= CLEAR]
    pairs = [r for r in rows if r['kind'] == 'pair' and r['d'] >= CLEAR]
    inside = [r for r in rows if r['kind'] != 'outside']
    said = [r for r in rows if r['answered']]
    placed = [r for r in clear if r['alarm']]
    covered = [hit for r in rows for hit in r['covered']]
    return {
        'cases': len(rows), 'answered': wilson(len(said), len(rows)),
        'false_alarms': _share(none, lambda r: r['alarm']),
        'detected_by_d': {str(d): _share([r for r in rows if r['kind'] == 'single'
                                          and r['target'] == d], lambda r: r['alarm'])
                          for d in sorted({r['target'] for r in rows if r['kind'] == 'single'})},
        'top1_strict': _share(clear, lambda r: r['strict']),
        'top1_class': _share(clear, lambda r: r['right']),
        'top3': _share(clear, lambda r: r['top3']),
        'macro_recall': _boot(clear, _macro),
        'outside_flagged': _share(outside, lambda r: r['outcome'] == 'UNEXPLAINED'),
        'outside_false_flags': _share(inside, lambda r: r['outcome'] == 'UNEXPLAINED'),
        'pairs_both_named': _share(pairs, lambda r: r['right']),
        'calibration_error': _boot([r for r in said if r['probability'] > 0], _calibration),
        'calibration_alarms': _boot([r for r in said if r['alarm'] and r['probability'] > 0],
                                    _calibration),
        'coverage90': wilson(sum(covered), len(covered)),
        'wrong_and_confident': _share(rows, lambda r: not r['right']
                                      and r['probability'] > CONFIDENT),
        'alarm_wrong_and_confident': _share([r for r in rows if r['alarm']],
                                            lambda r: not r['right']
                                            and r['probability'] > CONFIDENT),
        **{f'{kind}_right': _place(placed, kind)
           for kind in ('site', 'sensor', 'side', 'mode', 'band', 'time')},
        'closed_error': _closed(rows, answers, truths or {}),
        'parameter_error': _errors(rows),
        'risk_coverage': _risk(rows),
        'reliability': _reliability([r for r in said if r['probability'] > 0]),
        'curves': curves(rows),
        'confusion': _confusion(clear),
        'baseline_most_frequent': _most_frequent(rows),
        **_cost(runs or {}),
        'failures': [r for r in rows if not r['right']],
    }


def _row(name, label, a, same, duration_s):
    """Return what one case says, as plain data."""
    true = {e['name'] for e in label['effects']}
    kind = label['kind']
    d = min((e['detectability'] for e in label['effects']), default=0.0)
    first = label['effects'][0] if label['effects'] else {}

    def alike(told):
        if len(told) != len(true):
            return False
        return all(any(t == x or any({t, x} <= c for c in same) for x in told) for t in true) \
            and all(any(t == x or any({t, x} <= c for c in same) for t in true) for x in told)

    if kind == 'none':
        strict = right = a.outcome == 'WITHIN_FLOOR'
    elif kind == 'outside':
        strict = right = a.outcome == 'UNEXPLAINED'
    else:
        strict, right = a.effects == true, bool(a.effects) and alike(a.effects)
    covered, errors = [], {}
    if kind == 'single' and strict:
        for key, value in a.values.items():
            at = first['parameters'].get(key.split('.')[-1])
            if isinstance(at, (int, float)) and isinstance(value, (int, float)):
                # a scale is nothing at 1, all else at 0
                errors[key] = abs(value - at) / max(abs(at - key.endswith('.scale')), 1e-30)
                if key in a.intervals:
                    low, high = a.intervals[key]
                    covered.append(bool(low <= at <= high))
    return {'name': name, 'kind': kind, 'true': sorted(true), 'd': d,
            'target': first.get('target', 0.0), 'outcome': a.outcome, 'told': sorted(a.effects),
            'names': [e['name'] for e in label['effects']],
            'parameters': [e['parameters'] for e in label['effects']],
            'probability': a.probability, 'strict': strict, 'right': right,
            'alarm': a.outcome in ('EXPLAINED', 'TIED', 'UNEXPLAINED'),
            'answered': a.outcome not in ('NO_ANSWER', 'TOO_LITTLE_DATA'),
            'top3': any(alike(told) for told in a.ranked[:3]), 'covered': covered,
            'errors': errors,
            'places': places(label, a, duration_s) if kind == 'single' else {}}


def _share(rows, hit):
    return wilson(sum(bool(hit(r)) for r in rows), len(rows))


def _place(rows, kind):
    """Return how often a kind of place is right, and what guessing would give."""
    told = [r['places'][kind] for r in rows if kind in r['places']]
    chance = float(np.mean([c for _, c in told])) if told else None
    return {**wilson(sum(hit for hit, _ in told), len(told)), 'chance': chance}


def _closed(rows, answers, truths):
    """Return the median |closed - closed by the true effect| of the named single effects."""
    told = [{'off': abs(answers[r['name']].closed - truths[r['name']]['closed'])} for r in rows
            if r['told'] and answers[r['name']].closed is not None
            and (truths.get(r['name']) or {}).get('closed') is not None]
    return _boot(told, lambda some: float(np.median([x['off'] for x in some])))


def _errors(rows):
    """Return the median relative error of each parameter of the strictly named effects."""
    told = {}
    for row in rows:
        for key, error in row['errors'].items():
            told.setdefault(key, []).append(error)
    return {key: {'median': float(np.median(v)), 'total': len(v)}
            for key, v in sorted(told.items())}


def _confusion(rows):
    """Return {true effect: {told: count}} of the detectable single effects."""
    told = {}
    for row in rows:
        line = told.setdefault(row['true'][0], {})
        word = '+'.join(row['told']) or row['outcome']
        line[word] = line.get(word, 0) + 1
    return told


def _cost(runs):
    """Return median, 95 % quantile and largest of seconds and peak memory."""
    told = {}
    for key in ('seconds', 'cpu_s', 'peak_mb'):
        v = [run[key] for run in runs.values()]
        if v:
            told[key] = {'median': float(np.median(v)), 'q95': float(np.quantile(v, 0.95)),
                         'largest': float(max(v)), 'total': len(v)}
    return told


def _macro(rows):
    names = {r['true'][0] for r in rows}
    return float(np.mean([np.mean([r['right'] for r in rows if r['true'][0] == name])
                          for name in names]))


def _reliability(rows):
    """Return probability told and share right in each tenth of probability that has cases."""
    p = np.array([r['probability'] for r in rows])
    right = np.array([r['right'] for r in rows], dtype=float)
    which = np.minimum((p * 10).astype(int), 9)
    return [{'low': b / 10, 'mean': float(np.mean(p[which == b])),
             'right': float(np.mean(right[which == b])), 'total': int(np.sum(which == b))}
            for b in range(10) if np.any(which == b)]


def _calibration(rows):
    """Return the mean |confidence - accuracy| over ten bins of equal width."""
    return sum(abs(b['mean'] - b['right']) * b['total'] for b in _reliability(rows)) / len(rows)


def _boot(rows, statistic):
    """Return {value, low95, high95, total} by resampling cases, with a fixed seed."""
    if not rows:
        return {'value': None, 'low95': None, 'high95': None, 'total': 0}
    rng = np.random.default_rng(0)
    draws = [statistic([rows[k] for k in rng.integers(0, len(rows), len(rows))])
             for _ in range(BOOTSTRAPS)]
    low, high = np.quantile(draws, [0.025, 0.975])
    return {'value': statistic(rows), 'low95': float(low), 'high95': float(high),
            'total': len(rows)}


def _risk(rows):
    """Return the share wrong among the most confident 10, 20, ... 100 % of the cases."""
    order = sorted(rows, key=lambda r: (-r['probability'], r['name']))
    cuts = [max(1, round(len(order) * k / 10)) for k in range(1, 11)]
    return {f'{10 * k}': float(np.mean([not r['right'] for r in order[:cut]]))
            for k, cut in enumerate(cuts, 1)}


def _most_frequent(rows):
    """Return how often the most frequent truth alone would be right."""
    truths = [(r['kind'] if r['kind'] in ('none', 'outside') else '', *r['true'])
              if r['kind'] != 'outside' else ('outside',) for r in rows]
    return wilson(max(truths.count(t) for t in set(truths)) if truths else 0, len(truths))
