# Licensed under the Apache License, Version 2.0.
"""
Score answers against revealed labels.

Shares have Wilson's 95 % interval; means over effects and the calibration error have a bootstrap
over cases. `strict` is the same effect; `class` also counts an effect in one declared class with
the true one. The answer's own `class` is not used: a tool that calls everything tied gains
nothing.
"""
from math import sqrt

import numpy as np

CLEAR = 4.0                  # d' from which a case counts as detectable
CONFIDENT = 0.9
BOOTSTRAPS = 1000


def wilson(hits, total):
    """Return {value, low95, high95, hits, total}; Wilson 1927, z = 1.96."""
    if not total:
        return {'value': None, 'low95': None, 'high95': None, 'hits': 0, 'total': 0}
    z, p = 1.959964, hits / total
    middle, spread = p + z * z / (2 * total), z * sqrt(p * (1 - p) / total + (z / 2 / total)**2)
    scale = 1 + z * z / total
    return {'value': p, 'low95': max(0.0, (middle - spread) / scale),
            'high95': min(1.0, (middle + spread) / scale), 'hits': int(hits), 'total': int(total)}


def score(labels, answers, classes=()):
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

    Raises
    ------
    ValueError
        If an answer belongs to no bag or a bag has none.

    """
    if set(labels) != set(answers):
        raise ValueError(f'{len(set(labels) ^ set(answers))} names are in labels or answers '
                         'alone; give one answer, if only NO_ANSWER, for each bag')
    same = [frozenset(c) for c in classes]
    rows = [_row(name, labels[name], answers[name], same) for name in sorted(labels)]
    clear = [r for r in rows if r['kind'] == 'single' and r['d'] >= CLEAR]
    none = [r for r in rows if r['kind'] == 'none']
    outside = [r for r in rows if r['kind'] == 'outside' and r['d'] >= CLEAR]
    pairs = [r for r in rows if r['kind'] == 'pair' and r['d'] >= CLEAR]
    inside = [r for r in rows if r['kind'] != 'outside']
    said = [r for r in rows if r['answered']]
    with_site = [r for r in clear if r['outcome'] != 'WITHIN_FLOOR' and r['told_site']]
    with_sensor = [r for r in with_site if r['channel'] and r['told_sensor']]
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
        'coverage90': wilson(sum(covered), len(covered)),
        'wrong_and_confident': _share(rows, lambda r: not r['right']
                                      and r['probability'] > CONFIDENT),
        'site_right': _share(with_site, lambda r: r['told_site'] == r['site']),
        'sensor_right': _share(with_sensor, lambda r: r['told_sensor'] == r['channel']),
        'risk_coverage': _risk(rows),
        'baseline_most_frequent': _most_frequent(rows),
        'failures': [r for r in rows if not r['right']],
    }


def _row(name, label, a, same):
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
    covered = []
    if kind == 'single' and strict:
        for key, (low, high) in a.intervals.items():
            value = first['parameters'].get(key.split('.')[-1])
            if isinstance(value, (int, float)):
                covered.append(bool(low <= value <= high))
    return {'name': name, 'kind': kind, 'true': sorted(true), 'd': d,
            'target': first.get('target', 0.0), 'outcome': a.outcome, 'told': sorted(a.effects),
            'parameters': [e['parameters'] for e in label['effects']],
            'probability': a.probability, 'strict': strict, 'right': right,
            'alarm': a.outcome in ('EXPLAINED', 'TIED', 'UNEXPLAINED'),
            'answered': a.outcome not in ('NO_ANSWER', 'TOO_LITTLE_DATA'),
            'top3': any(alike(told) for told in a.ranked[:3]), 'covered': covered,
            'site': first.get('site', ''), 'told_site': a.site,
            'channel': first.get('parameters', {}).get('channel', '')
            if first.get('parameters', {}).get('channel') != 'all' else '',
            'told_sensor': a.sensor}


def _share(rows, hit):
    return wilson(sum(bool(hit(r)) for r in rows), len(rows))


def _macro(rows):
    names = {r['true'][0] for r in rows}
    return float(np.mean([np.mean([r['right'] for r in rows if r['true'][0] == name])
                          for name in names]))


def _calibration(rows):
    """Return the mean |confidence - accuracy| over ten bins of equal width."""
    p = np.array([r['probability'] for r in rows])
    right = np.array([r['right'] for r in rows], dtype=float)
    which = np.minimum((p * 10).astype(int), 9)
    return float(sum(abs(np.sum(p[which == b] - right[which == b])) for b in range(10)) / len(p))


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
