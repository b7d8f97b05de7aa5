"""
State answers of withheld campaigns by the rules of today, and ask how often they are right.

    python -m validation.blind_restated nineteenth twentieth twentythird twentyfourth

For campaigns answered before 2026-11-27 at 19:45, whose answers hold the probabilities of all
candidates: a hidden second effect had half of its odds then, and something unknown the odds of a
single effect also where two were named (eq. 113b, 113f of docs/theory-gap.md).
"""
import argparse
import json

import numpy as np

from ssi_ros.gap.selection.evidence import hidden_odds
from ssi_ros.gap.selection.thresholds import SELECTION
from ssi_ros.gap.settings import DiagnosisSettings
from validation.blind_reliability import deviation
from validation.blind_ties import answers_of, FOLDER

NAMED = ('EXPLAINED', 'TIED')


def restated(answer):
    """Return how many effects an answer names, its probability, and whether it is unknown now."""
    settings, limit = DiagnosisSettings(), {k: v.value for k, v in SELECTION.items()}
    share = dict.fromkeys(('unknown', 'none', 'known'), 0.0)
    for candidate in answer['candidates']:
        name = candidate['effects'][0]
        share[name if name in share else 'known'] += candidate['probability']
    unknown, none, known = share.values()
    stated = answer['verdict']['probability']
    if answer['outcome'] not in (*NAMED, 'UNEXPLAINED') or not known:
        return 0, stated, False
    top, prior = answer['candidates'][0], settings.prior_single
    count = len(top['effects']) if answer['outcome'] in NAMED else 0
    hidden = hidden_odds(settings)
    unknown = max(unknown - hidden / 2 * known, 0.0)
    if count == 2:
        unknown *= prior / settings.prior_pair
        known += limit['missed_share'] * prior / settings.prior_pair * top['probability']
    unknown += hidden * known
    scale = (1 - limit['doubt']) / (known + none + unknown)
    if not count:
        return 0, scale * unknown, True
    return count, scale * max(stated, unknown), bool(unknown > stated)


def rows_of(name):
    """Return [effects named, stated, right, stated anew, right anew, now unknown] of each."""
    failures = {f['name']: f for f in json.loads(
        (FOLDER / f'{name}_scores.json').read_text())['failures']}
    rows = []
    for case, text in answers_of(name).items():
        answer, right = json.loads(text), case not in failures
        count, anew, unknown = restated(answer)
        outside = failures.get(case, {}).get('kind') == 'outside'
        rows.append([count, answer['verdict']['probability'], right, anew,
                     outside if count and unknown else right, count and unknown])
    return np.array(rows, float)


def error(stated, right):
    """Return the calibration error in ten bins."""
    bins = np.minimum((10 * stated).astype(int), 9)
    count = np.maximum(np.bincount(bins), 1)
    return deviation(np.bincount(bins, stated) / count, np.bincount(bins, right) / count,
                     np.bincount(bins))


def main():
    """Print calibration errors of each campaign, and what is right of single effects and pairs."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('campaigns', nargs='+')
    tables = {name: rows_of(name) for name in parser.parse_args().campaigns}
    for name, rows in tables.items():
        _, stated, right, anew, right_anew, unknown = rows.T
        print(f'{name}: {len(rows)} answers, calibration error {error(stated, right):.3f}, stated '
              f'anew {error(anew, right_anew):.3f}; UNEXPLAINED now {unknown.sum():.0f}, '
              f'right before {unknown @ right:.0f}, of no library {unknown @ right_anew:.0f}')
    both = np.concatenate(list(tables.values()))
    for count in (1, 2):
        rows = both[both[:, 0] == count]
        print(f'{count} named: {len(rows)}, right {rows[:, 2].mean():.3f}, stated '
              f'{rows[:, 1].mean():.3f}, stated anew {rows[:, 3].mean():.3f}')


if __name__ == '__main__':
    main()
