"""
Hold the probabilities of answers against how often they are right.

    python -m validation.gap_probability alone.jsonl calibrated.jsonl

The files are those of `validation.gap_campaign` and `validation.gap_nominal`. An answer is right
if the effect that was put in is in the class that it names, or if it says WITHIN_FLOOR of a
record without effect; its probability is that of the verdict.
"""
import argparse
import json

import numpy as np

from validation.gap_figures import in_class, interval
from validation.report import figure, table

EDGES = 0.0, 0.35, 0.55, 0.7, 0.8, 0.87, 0.95, 1.0      # of stated probabilities
SURE = 0.9              # above it an answer that is wrong is counted by itself


def right(case):
    """Return whether the answer of a case is right."""
    if not case['effects']:
        return case['outcome'] == 'WITHIN_FLOOR'
    return case['outcome'] != 'UNEXPLAINED' and in_class(case)


def named(case):
    """Return whether an answer names effects."""
    return case['outcome'] in ('EXPLAINED', 'TIED')


def stated(case):
    """Return the probability of an answer, and whether it is right."""
    return case['verdict']['probability'], right(case)


def reliability(pairs):
    """
    Return rows of (mean stated, share right, right, count) for bins, and the calibration error.

    The error is the mean over answers of the distance of the two shares of their bin.
    """
    probabilities, truths = (np.array(v, float) for v in zip(*pairs))
    index, rows, error = np.digitize(probabilities, EDGES[1:-1], right=True), [], 0.0
    for i in range(len(EDGES) - 1):
        here = index == i
        if here.any():
            mean, share = probabilities[here].mean(), truths[here].mean()
            rows.append((mean, share, int(truths[here].sum()), int(here.sum())))
            error += abs(mean - share) * here.sum() / len(here)
    return rows, float(error)


def report(cases):
    """Return the lines of a report, and draw the reliability diagram."""
    shape, save = figure('gap_probability.png')
    axes, lines = shape.subplots(), []
    axes.plot([0, 1], [0, 1], color='grey', linewidth=0.8)
    for label, kept in (('answers that name effects', named), ('all answers', lambda c: True)):
        pairs = [stated(c) for c in cases if kept(c)]
        rows, error = reliability(pairs)
        ends = np.array([interval(r, n) for *_, r, n in rows])
        means, shares = np.array(rows)[:, 0], np.array(rows)[:, 1]
        axes.errorbar(means, shares, np.abs(ends.T - shares), marker='o', capsize=3, label=label)
        lines += ['', f'{label[0].upper()}{label[1:]}, calibration error {error:.3f}:', '']
        lines += table(('stated', 'right', 'of', 'share', '95 %'), [
            (f'{m:.2f}', r, n, f'{s:.2f}', f'{a:.2f} to {b:.2f}')
            for (m, s, r, n), (a, b) in zip(rows, ends)])
    wrong = sum(p > SURE and not ok for p, ok in map(stated, filter(named, cases)))
    lines += ['', f'Wrong with more than {SURE}: {wrong} of {sum(map(named, cases))} that name '
              'effects.']
    axes.set(xlabel='probability that is stated', ylabel='share that is right')
    axes.legend()
    save()
    return lines


def main():
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('files', nargs='+', help='lines of JSON, one a case')
    args = parser.parse_args()
    cases = []
    for path in args.files:
        with open(path) as file:
            cases += [json.loads(line) for line in file]
    print('\n'.join(report(cases)))


if __name__ == '__main__':
    main()
