# Licensed under the Apache License, Version 2.0.
"""
Check a revealed campaign and compute its scores from the archived answers, alone.

    python3 verify.py FOLDER [--repository GIT]

This one file needs the standard library and nothing else. It reads commitment.json, answers.json
(hashes), answers.json.xz (the answers), reveal.json and, where they are there, published.json,
closed.json, scores.json and the cases themselves.
"""
import hashlib
import json
import lzma
from math import pi, sqrt
from pathlib import Path
import subprocess
import sys

ALARMS = ('EXPLAINED', 'TIED', 'UNEXPLAINED')
OUTCOMES = (*ALARMS, 'WITHIN_FLOOR', 'TOO_LITTLE_DATA')
CONFIDENT = 0.9
NONE = {'outcome': 'NO_ANSWER', 'effects': [], 'tied': [], 'tied_pairs': [],
        'probability': 0.0, 'ranked': [], 'values': {}, 'intervals': {}, 'closed': None}


def sha(*parts):
    """Return SHA-256 of bytes, texts and plain data in a row, hex."""
    texts = (p if isinstance(p, (bytes, str)) else
             json.dumps(p, sort_keys=True, separators=(',', ':')) for p in parts)
    return hashlib.sha256(b''.join(t if isinstance(t, bytes) else t.encode() for t in texts)
                          ).hexdigest()


def wilson(hits, total):
    """Return {value, low95, high95, hits, total}; Wilson 1927, z = 1.96."""
    if not total:
        return {'value': None, 'low95': None, 'high95': None, 'hits': 0, 'total': 0}
    z, p = 1.959964, hits / total
    middle, spread = p + z * z / (2 * total), z * sqrt(p * (1 - p) / total + (z / 2 / total)**2)
    scale = 1 + z * z / total
    return {'value': p, 'low95': max(0.0, (middle - spread) / scale),
            'high95': min(1.0, (middle + spread) / scale), 'hits': int(hits), 'total': int(total)}


def answer_of(text):
    """
    Return what counts of an answer of schema ssi_ros/diagnosis/1, a text, as plain data.

    Raises
    ------
    ValueError
        If the schema or the outcome is unknown.

    """
    data = json.loads(text)
    if (not isinstance(data, dict) or data.get('schema') != 'ssi_ros/diagnosis/1'
            or data.get('outcome') not in OUTCOMES):
        raise ValueError('the answer is not of schema ssi_ros/diagnosis/1 with an outcome of '
                         + ', '.join(OUTCOMES))
    verdict = data.get('verdict') or {}
    named = data['outcome'] in ('EXPLAINED', 'TIED')
    effects = sorted(set(verdict.get('effects') or [] if named else []) - {'none', 'unknown'})
    candidates = [c for c in data.get('candidates') or []
                  if not {'none', 'unknown'} & set(c['effects'])]
    best = next((c for c in candidates if set(c['effects']) == set(effects)), {})
    values, intervals = {}, {}
    for key, value in (best.get('parameters') or {}).items():
        if isinstance(value, dict):
            values[key] = value.get('value')
            if value.get('low90') is not None and value.get('high90') is not None:
                intervals[key] = (value['low90'], value['high90'])
        else:
            values[key] = value
    return {'outcome': data['outcome'], 'effects': effects,
            'probability': float(verdict.get('probability') or 0.0),
            'tied': sorted(set(verdict.get('class') or []) | set(effects)) if (
                data['outcome'] == 'TIED' and len(effects) == 1) else effects,
            'ranked': [sorted(c['effects']) for c in candidates],
            'tied_pairs': [c['effects'] for c in candidates
                           if data['outcome'] == 'TIED' and len(c['effects']) == len(effects) == 2
                           and set(c['effects']) <= set(verdict.get('class') or [])],
            'values': values,
            'intervals': intervals, 'closed': best.get('closed')}


def read_answer(text):
    """Return the answer in a text, and NONE for no text or one of a wrong shape."""
    try:
        return answer_of(text)
    except (ValueError, KeyError, TypeError, AttributeError):
        return NONE


def alike(data, effects):
    """Return whether the names said are those of a label's effects, its classes as one."""
    same = [{e['name'], *e.get('same', ())} for e in effects]
    return len(data) == len(effects) and all(any(t in s for t in data) for s in same) and all(
        any(t in s for s in same) for t in data)


def row(name, label, a):
    """Return what one case says, as plain data, from its label and its answer."""
    effects, kind = label['effects'], label['kind']
    true = sorted(e['name'] for e in effects)
    if kind in ('none', 'outside'):
        strict = right = a['outcome'] == ('WITHIN_FLOOR' if kind == 'none' else 'UNEXPLAINED')
    else:
        strict, right = a['effects'] == true, alike(a['effects'], effects)
    # the probability of a tie is that of all its names together
    stated = right or kind == 'single' and any(alike([n], effects) for n in a['tied'])
    covered, at_place, errors = [], [], {}
    there = kind == 'single' and all(a['values'].get(f'{true[0]}.{k}', v) == v for k, v in
                                     effects[0]['parameters'].items() if isinstance(v, str))
    for key, value in a['values'].items() if kind == 'single' and strict else ():
        at = effects[0]['parameters'].get(key.split('.')[-1])
        if isinstance(at, (int, float)) and isinstance(value, (int, float)):
            # a scale is nothing at 1, all else at 0
            errors[key] = abs(value - at) / max(abs(at - key.endswith('.scale')), 1e-30)
            if key in a['intervals']:
                low, high = a['intervals'][key]
                covered.append(bool(low <= at <= high))
                if there:       # a phase is one on the circle
                    turn = 2 * pi * round(((low + high) / 2 - at) / 2 / pi) * (
                        key.endswith('phase_rad'))
                    at_place.append(bool(low <= at + turn <= high))
    return {'name': name, 'kind': kind, 'true': true, 'data': a['effects'],
            'd': min((e['detectability'] for e in effects), default=0.0),
            'target': min((e['target'] for e in effects), default=0.0),
            'names': [e['name'] for e in effects],
            'parameters': [e['parameters'] for e in effects], 'outcome': a['outcome'],
            'probability': a['probability'], 'strict': strict, 'right': right,
            'stated': stated,
            'tied_pair': right or any(alike(t, effects) for t in a['tied_pairs']),
            'alarm': a['outcome'] in ALARMS, 'covered': covered,
            'covered_at_place': at_place, 'errors': errors,
            'answered': a['outcome'] not in ('NO_ANSWER', 'TOO_LITTLE_DATA'),
            'top3': any(alike(data, effects) for data in a['ranked'][:3]),
            'closed': a['closed']}


def reliability(rows, hit='right'):
    """Return ten bins of the probability stated: how many, its mean, the share that holds."""
    bins = [[r for r in rows if k == min(int(r['probability'] * 10), 9)] for k in range(10)]
    return [{'low': k / 10, 'total': len(b), 'mean': sum(r['probability'] for r in b) / len(b),
             'right': sum(r[hit] for r in b) / len(b)} for k, b in enumerate(bins) if b]


def calibration(rows, hit='right'):
    """Return the mean |probability - share that holds| over ten bins, {value, total}."""
    rows = [r for r in rows if r['answered'] and r['probability'] > 0]
    off = sum(abs(b['mean'] - b['right']) * b['total'] for b in reliability(rows, hit))
    return {'value': off / len(rows) if rows else None, 'low95': None, 'high95': None,
            'total': len(rows)}


def scores(rows, closed=None):
    """Return the scores of a campaign from the rows of its cases."""
    def share(kind, hit, least=0.0):
        some = [r for r in rows if r['kind'] in kind.split() and r['d'] >= least]
        return wilson(sum(bool(r[hit]) if isinstance(hit, str) else bool(hit(r)) for r in some),
                      len(some))

    def confident(some, hit='right'):
        return wilson(sum(not r[hit] and r['probability'] > CONFIDENT for r in some), len(some))

    def unknown(r):
        return r['outcome'] == 'UNEXPLAINED'

    alarms = [r for r in rows if r['alarm']]
    covered, at_place = ([hit for r in rows for hit in r[key]]
                         for key in ('covered', 'covered_at_place'))
    off = sorted(abs(r['closed'] - closed[r['name']]['closed']) for r in rows if r['data']
                 and r['closed'] is not None and (closed or {}).get(r['name'], {}).get('closed')
                 is not None)
    middle = (off[(len(off) - 1) // 2] + off[len(off) // 2]) / 2 if off else None
    return {
        'cases': len(rows), 'answered': wilson(sum(r['answered'] for r in rows), len(rows)),
        'false_alarms': share('none', 'alarm'),
        'class_8': share('single', 'right', 8.0), 'class_4': share('single', 'right', 4.0),
        'strict_8': share('single', 'strict', 8.0), 'strict_4': share('single', 'strict', 4.0),
        'stated_8': share('single', 'stated', 8.0), 'stated_4': share('single', 'stated', 4.0),
        'top3_8': share('single', 'top3', 8.0),
        'unknown_8': share('outside', unknown, 8.0), 'unknown_4': share('outside', unknown, 4.0),
        'unknown_false': share('none single pair', unknown),
        'pairs_8': share('pair', 'right', 8.0), 'pairs_4': share('pair', 'right', 4.0),
        'tied_pairs_8': share('pair', 'tied_pair', 8.0),
        'tied_pairs_4': share('pair', 'tied_pair', 4.0),
        'calibration': calibration(rows),
        'calibration_alarms': calibration(alarms),
        'calibration_stated': calibration(rows, 'stated'),
        'calibration_stated_alarms': calibration(alarms, 'stated'),
        'coverage90': wilson(sum(covered), len(covered)),
        'coverage90_at_place': wilson(sum(at_place), len(at_place)),
        'wrong_confident': confident(rows),
        'wrong_confident_alarms': confident(alarms),
        'wrong_confident_stated': confident(rows, 'stated'),
        'closed_error': {'value': middle, 'low95': None, 'high95': None, 'total': len(off)}}


def faults(folder, public, locked, data, answers):
    """Yield what disagrees between commitment, cases, answers and reveal."""
    labels, seed = data['labels'], sha(public['commit'], '||', data['nonce'])
    level = [sha('leaf', sha(v['salt'], k, v['label'])) for k, v in labels.items()]
    while len(level) > 1:
        level = [sha('node', *pair) if pair[1:] else pair[0]
                 for pair in (level[k:k + 2] for k in range(0, len(level), 2))]
    names = {f'case_{sha(seed, "name", str(k))[:12]}' for k in range(public['count'])}
    yield from (text for fine, text in (
        (sha(data['nonce']) == public['nonce_sha256'], 'the nonce is not the committed one'),
        (data['seed'] == seed, 'the seed is not SHA-256(commit || nonce)'),
        (names == set(labels) == set(locked) == set(public['cases']), 'the names are others'),
        (set(answers) <= names, 'the archive has answers to no case'),
        (level == [public['merkle_root']], 'the labels are not the committed ones')) if not fine)
    for k in labels:
        case = folder / 'cases' / k
        files = sorted(p for p in case.rglob('*') if p.is_file())
        parts = [(str(p.relative_to(case)), '\0', sha(p.read_bytes())) for p in files]
        if files and public['cases'].get(k) != sha(*sum(parts, ())):
            yield f'{k}: the case has changed'
        if locked.get(k) != (sha(answers[k]) if k in answers else 'no answer'):
            yield f'{k}: the answer has changed since it was locked'


def unpublished(folder, repository):
    """Return what is wrong with the commit that published the commitment, '' for nothing."""
    at = json.loads((folder / 'published.json').read_text())

    def git(*words):
        return subprocess.run(['git', '-C', str(repository), *words], capture_output=True).stdout

    committed = git('show', f'{at["git_commit"]}:{at["path"]}')
    if committed != (folder / 'commitment.json').read_bytes():
        return f'git commit {at["git_commit"]} has another commitment in {at["path"]}, or none'
    changed = git('show', '--name-only', '--format=', at['git_commit']).decode().split()
    return '' if changed == [at['path']] else f'git commit {at["git_commit"]} changes more files'


def parts_beside(path):
    """Return the archived parts of the answers beside a published commitment, in order."""
    stem = path.name.removesuffix('.json').removesuffix('_commitment')
    return sorted(path.parent.glob(f'{stem}_part*.json.xz'))


def otherwise_archived(path, answers):
    """Yield what the parts that were archived during the run say otherwise than the answers."""
    before = sha(path.read_bytes())
    for part in parts_beside(path):
        got = json.loads(lzma.decompress(part.read_bytes()))
        if got['before'] != before:
            yield f'{part.name} does not follow the part before it'
        before = sha(part.read_bytes())
        yield from (f'{k}: {part.name} has another answer' for k, text in got['answers'].items()
                    if answers.get(k) != text)


def main(folder, repository=None):
    """Print faults and scores; return 1 for a fault."""
    public, locked, data = (json.loads((folder / f'{name}.json').read_text())
                            for name in ('commitment', 'answers', 'reveal'))
    answers = json.loads(lzma.decompress((folder / 'answers.json.xz').read_bytes()))
    found = list(faults(folder, public, locked, data, answers))
    if not (folder / 'published.json').exists():
        print('NOTE the commitment was not published before the run: the order is not proven')
    elif repository:
        path = repository / json.loads((folder / 'published.json').read_text())['path']
        found += [wrong] if (wrong := unpublished(folder, repository)) else []
        found += otherwise_archived(path, answers) if path.exists() else []
    if gone := sum(not (folder / 'cases' / k).exists() for k in public['cases']):
        print(f'NOTE {gone} cases are not here: their hashes are not checked')
    closed = folder / 'closed.json'
    rows = [row(name, v['label'], read_answer(answers.get(name)))
            for name, v in sorted(data['labels'].items())]
    got = scores(rows, json.loads(closed.read_text()) if closed.exists() else None)
    before = folder / 'scores.json'
    if before.exists():
        said = json.loads(before.read_text())
        found += [f'scores.json says another {key}' for key in got
                  if key in said and json.loads(json.dumps(got[key])) != said[key]]
    print(*(f'FAULT {text}' for text in found), f'{len(found)} faults', sep='\n')
    for key, value in got.items():
        if isinstance(value, dict) and value['value'] is not None:
            ends = ('' if value['low95'] is None else
                    f'  [{value["low95"]:.3f}, {value["high95"]:.3f}]')
            print(f'{key:24s} {value["value"]:.3f}{ends}  of {value["total"]}')
    return int(bool(found))


if __name__ == '__main__':
    given = sys.argv[1:]
    where = Path(given[given.index('--repository') + 1]) if '--repository' in given else None
    sys.exit(main(Path(given[0]), where))
