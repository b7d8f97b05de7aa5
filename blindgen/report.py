# Licensed under the Apache License, Version 2.0.
"""A finished campaign as Markdown tables: scores against targets, places, baselines, failures."""
from math import inf
from pathlib import Path

from blindgen.score import CLEAR
from blindgen.seal import read_json

# score, what it is, target, whether it must lie below; None: between two
TARGETS = (
    ('false_alarms', 'false alarms', 0.05, True),
    ('top1_class', "named, up to declared classes, d' >= 4", 0.95, False),
    ('top1_strict', "named strictly, d' >= 4", 0.85, False),
    ('top3', "among the first three, d' >= 4", 0.98, False),
    ('macro_recall', "mean over effects, d' >= 4", 0.93, False),
    ('outside_flagged', "outside the library flagged, d' >= 4", 0.85, False),
    ('outside_false_flags', 'flagged though inside', 0.05, True),
    ('pairs_both_named', "both of a pair named, d' >= 4", 0.75, False),
    ('calibration_error', 'calibration error', 0.05, True),
    ('calibration_alarms', 'the same of answers that see a gap', 0.05, True),
    ('coverage90', '90 % intervals cover', (0.85, 0.95), None),
    ('closed_error', 'closed against the true effect, median', 0.05, True),
    ('wrong_and_confident', 'wrong with probability > 0.9', 0.02, True),
    ('alarm_wrong_and_confident', 'the same of answers that see a gap', 0.02, True))
BESIDE = ('false_alarms', 'top1_strict', 'top1_class', 'top3', 'macro_recall', 'outside_flagged',
          'outside_false_flags', 'pairs_both_named', 'wrong_and_confident')     # of baselines too
PLACES = ('site', 'sensor', 'side', 'mode', 'band', 'time')


def report(folder):
    """
    Return the lines of the report of a scored campaign, Markdown.

    Parameters
    ----------
    folder : Path
        Of the campaign; it has scores.json.

    Raises
    ------
    ValueError
        If the campaign is not scored.

    """
    folder = Path(folder)
    scores, public = (read_json(folder / f'{name}.json') for name in ('scores', 'commitment'))
    told = [f'{scores["cases"]} cases of {public["duration_s"]:g} s, tool and generator at commit '
            f'`{public["commit"][:12]}`, Merkle root `{public["merkle_root"][:16]}`.', '']
    told += _table(('score', 'target', 'measured [95 %]', 'cases', 'met'), [
        (what, _aim(aim, below), _share(scores[key]), scores[key]['total'],
         _met(scores[key], aim, below)) for key, what, aim, below in TARGETS])
    pooled = scores['curves']['pooled']
    sizes = sorted({size for curve in pooled.values() for size in curve}, key=float)
    told += _table(("d'", 'cases', 'detected', 'named strictly', 'named, classes'), [
        ('none' if size == '0' else size, pooled['detected'][size]['total'],
         *(_share(pooled[curve][size]) if size in pooled[curve] else ''
           for curve in ('detected', 'strict', 'class'))) for size in sizes])
    told += _table(('where', 'right [95 %]', 'cases', 'guessing'), [
        (place, _share(scores[f'{place}_right']), scores[f'{place}_right']['total'],
         f'{scores[f"{place}_right"]["chance"]:.2f}')
        for place in PLACES if scores[f'{place}_right']['total']])
    risk = sorted((int(k), v) for k, v in scores['risk_coverage'].items())
    told += _table(('most confident', *(f'{k} %' for k, _ in risk)), [
        ('wrong among them', *(f'{v:.2f}' for _, v in risk))])
    told += _table(('probability told', 'cases', 'mean', 'right'), [
        (f'{b["low"]:.1f}-{b["low"] + 0.1:.1f}', b['total'], f'{b["mean"]:.2f}',
         f'{b["right"]:.2f}') for b in scores['reliability']])
    told += _table(('one answer took', 'median', '95 % below', 'largest'), [
        (words, *(f'{scores[key][k]:.0f}' for k in ('median', 'q95', 'largest')))
        for key, words in (('seconds', 'seconds'), ('cpu_s', 'processor seconds'),
                           ('peak_mb', 'MB')) if key in scores])
    told += _beside(scores)
    told += _named(scores)
    return told + failures(scores)


def failures(scores):
    """Return the wrong answers: the clear ones one by one, unseen weak ones by effect."""
    weak, clear = {}, []
    for row in scores['failures']:
        if row['outcome'] == 'WITHIN_FLOOR' and row['d'] < CLEAR:
            weak.setdefault(' + '.join(row['true']), []).append(row['d'])
        else:
            clear.append(row)
    clear.sort(key=lambda row: (row['kind'], row['true'], row['d']))
    told = [f'{len(scores["failures"])} answers are wrong. {sum(map(len, weak.values()))} of them '
            f"call an effect below d' = {CLEAR:g} within the floor:", '']
    told += _table(('effect', "within the floor at d'"), [
        (name, ', '.join(f'{d:.1f}' for d in sorted(v))) for name, v in sorted(weak.items())])
    told += [f'The other {len(clear)}, one by one:', '']
    return told + _table(('bag', 'truth', "d'", 'answer', 'probability'), [
        (row['name'][4:10], _truth(row), f'{row["d"]:.1f}' if row['true'] else '',
         ' + '.join(row['told']) or row['outcome'], f'{row["probability"]:.2f}')
        for row in clear])


def _beside(scores):
    rows = {'the tool': scores, **scores.get('baselines', {})}
    if len(rows) == 1:
        return []
    return _table(('', *(key.replace('_', ' ') for key in BESIDE)), [
        (name.replace('_', ' '), *('' if told[key]['value'] is None else
                                   f'{told[key]["value"]:.2f}' for key in BESIDE))
        for name, told in rows.items()])


def _named(scores):
    """Return a table of the detectable effects that were not all named, and what was told."""
    rows = []
    for name, told in scores['confusion'].items():
        total, right = sum(told.values()), told.get(name, 0)
        if right < total:
            rows.append((name, f'{right} of {total}', ', '.join(
                f'{word} {count}' for word, count in sorted(told.items()) if word != name)))
    return _table(("effect, d' >= 4", 'named', 'else told'), sorted(rows))


def _truth(row):
    words = []
    for name, parameters in zip(row['names'], row['parameters']):
        values = ', '.join(f'{key} {value:.3g}' if isinstance(value, float) else f'{value}'
                           for key, value in parameters.items())
        words.append(f'{name} ({values})')
    return ' + '.join(words) or 'no effect'


def _table(head, rows):
    if not rows:
        return []
    return ['| ' + ' | '.join(map(str, head)) + ' |', '|' + len(head) * '---|',
            *('| ' + ' | '.join(map(str, row)) + ' |' for row in rows), '']


def _aim(aim, below):
    if below is None:
        return f'{aim[0]:g} to {aim[1]:g}'
    return f'{"<=" if below else ">="} {aim:g}'


def _met(score, aim, below):
    """Return yes or no, and 'open' where the interval lies on both sides of the target."""
    if score['value'] is None:
        return ''
    low, high = aim if below is None else (-inf, aim) if below else (aim, inf)
    ends = (score['low95'], score['high95'])
    inside = low <= score['value'] <= high
    sure = (low <= ends[0] and ends[1] <= high) if inside else (ends[1] < low or ends[0] > high)
    return ('yes' if inside else 'no') + ('' if sure else ', open')


def _share(score):
    if score['value'] is None:
        return ''
    return f'{score["value"]:.2f} [{score["low95"]:.2f}, {score["high95"]:.2f}]'
