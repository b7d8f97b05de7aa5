"""
Curves and figures of a campaign on the package's own simulator.

    python -m validation.gap_figures singles.jsonl

The files are those of `validation.gap_campaign`; several are taken together.
"""
import argparse
import json

import numpy as np
from scipy.stats import beta

from ssi_ros.effects import applicable, effect_class
from ssi_ros.effects.base import is_log
from validation.report import figure, table, write

COVERED = 1.645         # standard deviations of a 90 % interval
LEAST = 2e-4            # nats off the held-out gap, below which shares of it are noise


def detected(case):
    """Return whether a gap was detected."""
    return case['outcome'] != 'WITHIN_FLOOR'


def in_class(case):
    """Return whether the effect is in the class that was named."""
    return detected(case) and set(case['effects']) <= set(case['verdict']['class'])


def strict(case):
    """Return whether exactly the effect was named."""
    return detected(case) and sorted(case['verdict']['effects']) == sorted(case['effects'])


def interval(right, count):
    """Return the 95 % interval of a share (Clopper and Pearson)."""
    return (beta.ppf(0.025, right, count - right + 1) if right else 0.0,
            beta.ppf(0.975, right + 1, count - right) if right < count else 1.0)


def draw_detection(cases):
    """Draw shares that are detected and named against size, and return the table."""
    sizes = sorted({c['detection'] for c in cases})
    shape, save = figure('diagnosis_detection.png')
    axes = shape.subplots()
    rows = []
    for verb, label in ((detected, 'detected'),
                        (in_class, 'named, counting indistinguishable effects as one'),
                        (strict, 'named strictly')):
        shares, ends = [], []
        for size in sizes:
            some = [c for c in cases if c['detection'] == size]
            right = sum(map(verb, some))
            shares.append(right / len(some))
            ends.append(interval(right, len(some)))
            rows.append((label, f'{size:g}', len(some), right, f'{shares[-1]:.2f} '
                         f'[{ends[-1][0]:.2f}, {ends[-1][1]:.2f}]'))
        reach = np.abs(np.transpose(ends) - shares)
        axes.errorbar(sizes, shares, reach, marker='o', capsize=3, label=label)
    axes.set(xscale='log', xlabel="size d' [standard deviations of an oracle]",
             ylabel='share of the cases', ylim=(-0.02, 1.02), xticks=sizes,
             xticklabels=[f'{s:g}' for s in sizes])
    axes.minorticks_off()
    axes.legend()
    axes.grid(alpha=0.3)
    save()
    return table(('what', "d'", 'cases', 'right', 'share [95 %]'), rows)


def draw_confusion(cases):
    """Draw what was named against what was there, of the gaps detected."""
    names = list(applicable(None))
    columns = names + ['two effects', 'unexplained']
    counts = np.zeros((len(names), len(columns)))
    for case in filter(detected, cases):
        effects = case['verdict']['effects']
        column = ('unexplained' if case['outcome'] == 'UNEXPLAINED' else
                  effects[0] if len(effects) == 1 else 'two effects')
        counts[names.index(case['effects'][0]), columns.index(column)] += 1
    shape, save = figure('diagnosis_confusion.png')
    shape.set_size_inches(9, 8)
    axes = shape.subplots()
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    axes.imshow(shares, cmap='Blues', vmin=0.0, vmax=1.3)       # dark enough for white numbers
    for i, j in zip(*np.nonzero(counts)):
        axes.text(j, i, f'{counts[i, j]:.0f}', ha='center', va='center', fontsize=9,
                  color='white' if shares[i, j] > 0.6 else 'black', fontweight='bold')
    for side in ('x', 'y'):
        getattr(axes, f'set_{side}ticks')(
            np.arange(len(columns if side == 'x' else names)) - 0.5, minor=True)
    axes.grid(which='minor', color='#dddddd', linewidth=0.5)
    axes.tick_params(which='minor', length=0)
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    axes.set_yticks(range(len(names)), names, fontsize=7)
    axes.set(xlabel='named first', ylabel='was there')
    save()


def parameters(cases):
    """Return error in standard deviations and coverage of each parameter of right answers."""
    found = {}
    for case in cases:
        best = case['candidates'][0]
        if sorted(best['effects']) != sorted(case['effects']):
            continue
        for key, value in best['parameters'].items():
            truth = case['truth'].get(key)
            if truth is None or value['low90'] is None:
                continue
            name, number = key.split('.')
            f = next(f for f in effect_class(name).numbers() if f.name == number)
            ends = np.array([value['low90'], value['value'], value['high90'], truth], float)
            if is_log(f) and (ends > 0).all():
                ends = np.log(ends)
            std = max((ends[2] - ends[0]) / (2 * COVERED), 1e-300)
            found.setdefault(key, []).append(
                ((ends[1] - ends[3]) / std, value['low90'] <= truth <= value['high90']))
    rows = [(key, len(v), f'{np.median([abs(z) for z, _ in v]):.2f}',
             f'{max(abs(z) for z, _ in v):.1f}', f'{sum(i for _, i in v)} of {len(v)}')
            for key, v in sorted(found.items())]
    every = [v for values in found.values() for v in values]
    rows.append(('all', len(every), f'{np.median([abs(z) for z, _ in every]):.2f}',
                 f'{max(abs(z) for z, _ in every):.1f}',
                 f'{sum(i for _, i in every)} of {len(every)}'))
    return table(('parameter', 'answers', 'median error [sd]', 'largest [sd]',
                  '90 % interval holds it'), rows)


def of_other_classes(case, alike):
    """Return the candidates and controls of a case that have none of the effects alike."""
    return [k for k in case['candidates'] + case['controls']
            if not set(k['effects']) & {*alike, 'none', 'unknown'}]


def draw_closed(cases):
    """Draw what was closed against what the true effect closes; return the table of cases."""
    rows, right, wrong = [], [], []
    for case in cases:
        truth = case.get('closed_by_truth')
        if truth is None:
            continue
        best = case['candidates'][0]
        rival = max([(k['closed'], '+'.join(k['effects']))
                     for k in of_other_classes(case, {*case['effects'], *best['class']})
                     if k['closed'] is not None], default=(float('nan'), ''))
        right.append((truth, best['closed']))
        wrong.append((truth, rival[0]))
        rows.append((case['texts'][0], f"{case['detection']:g}", f'{truth:.2f}',
                     f"{best['closed']:.2f} {'+'.join(best['effects'])}",
                     f'{rival[0]:.2f} {rival[1]}'))
    if not rows:
        return ['No gap was three standard deviations above its floor.', '']
    shape, save = figure('diagnosis_closed.png')
    axes = shape.subplots()
    axes.plot([0, 1.1], [0, 1.1], color='0.7')
    axes.plot(*np.transpose(right), 'o', label='first answer')
    axes.plot(*np.transpose(wrong), 'x', color='tab:red', label='best of another class')
    axes.set(xlabel='closed by the true effect at its true size', ylabel='closed on unseen pieces')
    axes.legend()
    axes.grid(alpha=0.3)
    save()
    off = np.abs(np.subtract(*np.transpose(right)))
    return [f'|closed - closed by the true effect|: median {np.median(off):.3f}, largest '
            f'{off.max():.2f}, {len(off)} cases.', '',
            *table(('effect', "d'", 'true effect', 'first answer', 'best of another class'), rows)]


def rivals(cases):
    """Return the best candidate of another class for each case named right and shown by G."""
    rows, shares = [], []
    for case in filter(in_class, cases):
        best = case['candidates'][0]
        before = next(k['gap_after'] for k in case['candidates'] if k['effects'] == ['unknown'])
        gain = before - best['gap_after']
        others = [(before - k['gap_after'], k['probability'], '+'.join(k['effects']))
                  for k in of_other_classes(case, case['verdict']['class']) if 'gap_after' in k]
        if not others or gain < LEAST:
            continue
        took, probability, name = max(others)
        shares.append(took / gain)
        rows.append((case['texts'][0], f"{case['detection']:g}", f'{1e3 * gain:.2f}', name,
                     f'{100 * took / gain:.0f}', f'{probability:.2g}'))
    return [f'{len(rows)} cases; the share has the median {100 * np.median(shares):.0f} %, '
            f'{sum(s > 1 for s in shares)} are above 100 %.', '',
            *table(('effect', "d'", 'first answer takes [1e-3 nats]', 'best of another class',
                    'takes of that [%]', 'probability'), rows)]


def main():
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('files', nargs='+', help='of gap_campaign singles')
    files = parser.parse_args().files
    cases = []
    for path in files:
        with open(path) as file:
            cases += [json.loads(line) for line in file]
    cases = [c for c in cases if len(c['effects']) == 1]
    first, last = (pick(c['case'] for c in cases) for pick in (min, max))
    draw_confusion(cases)
    write('diagnosis_curves', 'Diagnosis: curves', [
        f'{len(cases)} cases with one effect each.', '', '## Detected and named against size', '',
        '![](../figures/diagnosis_detection.png)', '', *draw_detection(cases),
        '## What was named', '', 'Numbers are cases, of those where a gap was detected; rows are '
        'what was there.', '', '![](../figures/diagnosis_confusion.png)', '',
        '## What is closed', '', 'Where the gap is three standard deviations above its floor; '
        'rails and steps change no expected spectrum, so they close nothing at their true size.',
        '', '![](../figures/diagnosis_closed.png)', '', *draw_closed(cases),
        '## The best wrong candidate', '', 'What it takes off the gap on pieces that its fit did '
        'not see, of what the right answer takes.', '', *rivals(cases),
        '## Parameters', '', *parameters(cases)],
        seed=f'{first} to {last}', command=f'gap_figures {" ".join(files)}')


if __name__ == '__main__':
    main()
