# Licensed under the Apache License, Version 2.0.
"""A finished campaign on one page: what was hidden, what came out, what is still wrong."""
from math import inf
from pathlib import Path

from blindgen.proof.seal import read_json

# score, what it is, target, whether it must lie below; None: between two
TARGETS = (
    ('false_alarms', 'false alarms', 0.05, True),
    ('class_8', "single effects named, d' >= 8", 0.90, False),
    ('class_4', "single effects named, d' >= 4", 0.75, False),
    ('stated_8', 'the same, or tied with what is named first', 0.90, False),
    ('unknown_8', "unknown effects flagged, d' >= 8", 0.85, False),
    ('pairs_8', "both of a pair named, d' >= 8", 0.75, False),
    ('tied_pairs_8', 'the same, or tied with what is named first', 0.75, False),
    ('calibration', 'calibration error', 0.05, True),
    ('calibration_stated', 'the same, a tie stated as all of its names', 0.05, True),
    ('coverage90', '90 % intervals cover', (0.88, 0.92), None),
    ('coverage90_at_place', 'the same, where the place is right, phases on the circle',
     (0.88, 0.92), None),
    ('wrong_confident', 'wrong with probability > 0.9', 0.01, True),
    ('closed_error', "reduction of the gap against the true effect's, median error", 0.05, True))
BESIDE = ('false_alarms', 'class_8', 'class_4', 'strict_8', 'unknown_8', 'unknown_false',
          'pairs_8', 'wrong_confident')
KINDS = {'none': 'no effect', 'single': 'one effect of the library', 'pair': 'two of them',
         'outside': 'an effect of no library'}
MOST = 14                   # lines of what is wrong; the rest is in scores.json


def report(folder):
    """
    Return the lines of the one-page report of a scored campaign, Markdown.

    Raises
    ------
    ValueError
        If the campaign is not scored.

    """
    folder = Path(folder)
    scores, public, data = (read_json(folder / f'{name}.json')
                            for name in ('scores', 'commitment', 'reveal'))
    published = folder / 'published.json'
    proof = (f'committed to in git commit `{read_json(published)["git_commit"][:12]}` before the '
             'first answer' if published.exists() else 'not published before its run')
    return [
        f'# Blind campaign of {scores["cases"]} cases', '',
        f'Tool at `{public["commit"][:12]}`, Merkle root `{public["merkle_root"][:16]}`, {proof}.',
        '', '## What was hidden', '', *_hidden(data['labels']),
        '## What came out', '', *_table(('score', 'target', 'measured [95 %]', 'cases', 'met'), [
            (what, _aim(aim, below), _share(scores[key]), scores[key]['total'],
             _met(scores[key], aim, below)) for key, what, aim, below in TARGETS
            if key in scores]),
        *_beside(scores), '## What is still wrong', '', *_wrong(scores)]


def _hidden(labels):
    """Return a table of the kinds of cases and of their sizes."""
    cases = [v['label'] for v in labels.values()]
    rows = []
    for kind, words in KINDS.items():
        sizes = sorted(min(e['detectability'] for e in c['effects']) for c in cases
                       if c['kind'] == kind and c['effects'])
        rows.append((words, sum(c['kind'] == kind for c in cases),
                     f'{sizes[len(sizes) // 4]:.1f} / {sizes[len(sizes) // 2]:.1f} / '
                     f'{sizes[3 * len(sizes) // 4]:.1f}' if sizes else ''))
    return ['Each case has a spacecraft of its own, a nominal model with every frequency 0.3 to '
            '3 % wrong, and one to three healthy recordings.', '',
            *_table(('hidden', 'cases', "attainable d', quartiles"), rows)]


def _beside(scores):
    """Return a table of the tool beside what a user would try instead."""
    rows = {'the tool': scores, **scores.get('baselines', {})}
    if len(rows) == 1:
        return []
    return _table(('', *(key.replace('_', ' ') for key in BESIDE)), [
        (name.replace('_', ' '), *('' if data[key]['value'] is None else
                                   f'{data[key]["value"]:.2f}' for key in BESIDE))
        for name, data in rows.items()])


def _wrong(scores):
    """Return the wrong answers by what was true and what was said, the largest first."""
    groups = {}
    for r in scores['failures']:
        weak = r['kind'] != 'none' and r['d'] < 4
        key = ("any effect below d' = 4" if weak else
               KINDS['none'] if r['kind'] == 'none' else ' + '.join(r['true']),
               ' + '.join(r['data']) or r['outcome'])
        groups.setdefault(key, []).append(r)
    order = sorted(groups.items(), key=lambda item: -max(r['d'] for r in item[1]))
    weak = [item for item in order if item[0][0].startswith('any')]
    clear = [item for item in order if item not in weak]
    order = clear[:MOST - len(weak)] + weak + clear[MOST - len(weak):]
    data = _table(('true', 'said', 'cases', "largest d'", 'largest probability'), [
        (true, said, len(some), f'{max(r["d"] for r in some):.1f}',
         f'{max(r["probability"] for r in some):.2f}') for (true, said), some in order[:MOST]])
    more = sum(len(some) for _, some in order[MOST:])
    return [*data, f'{len(scores["failures"])} of {scores["cases"]} answers are wrong'
            + (f'; {more} of them are in scores.json alone.' if more else '.')]


def _table(head, rows):
    if not rows:
        return []
    return ['| ' + ' | '.join(map(str, head)) + ' |', '|' + len(head) * '---|',
            *('| ' + ' | '.join(map(str, each)) + ' |' for each in rows), '']


def _aim(aim, below):
    if below is None:
        return f'{aim[0]:g} to {aim[1]:g}'
    return f'{"<=" if below else ">="} {aim:g}'


def _met(score, aim, below):
    """Return yes or no, and 'open' where the interval lies on both sides of the target."""
    if score['value'] is None:
        return ''
    low, high = aim if below is None else (-inf, aim) if below else (aim, inf)
    inside = low <= score['value'] <= high
    if score['low95'] is None:
        return 'yes' if inside else 'no'
    ends = (score['low95'], score['high95'])
    sure = (low <= ends[0] and ends[1] <= high) if inside else (ends[1] < low or ends[0] > high)
    return ('yes' if inside else 'no') + ('' if sure else ', open')


def _share(score):
    if score['value'] is None:
        return ''
    if score['low95'] is None:
        return f'{score["value"]:.2f}'
    return f'{score["value"]:.2f} [{score["low95"]:.2f}, {score["high95"]:.2f}]'
