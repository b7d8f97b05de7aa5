"""
Draw how often answers of blind campaigns are right, by the probability that they state.

    python -m validation.blind_reliability ninth tenth

The names are those of campaigns in docs/validation/blind. Intervals are those of 95 %.
"""
import argparse
import json

import numpy as np

from validation.gap_figures import interval
from validation.report import figure, ROOT


def main():
    """Write docs/figures/blind_reliability.png."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('names', nargs='+', help='of campaigns, such as ninth')
    names = parser.parse_args().names
    shape, save = figure('blind_reliability.png')
    axes = shape.subplots()
    axes.plot([0, 1], [0, 1], color='0.7', linewidth=1)
    for i, name in enumerate(names):
        scores = json.loads((
            ROOT / 'docs' / 'validation' / 'blind' / f'{name}_scores.json').read_text())
        bins = [b for b in scores['reliability'] if b['total']]
        stated, right, count = (np.array([b[k] for b in bins])
                                for k in ('mean', 'right', 'total'))
        low, high = np.array([interval(round(r * n), n) for r, n in zip(right, count)]).T
        axes.errorbar(stated, right, [right - low, high - right], fmt='none', ecolor=f'C{i}',
                      alpha=0.35)
        axes.scatter(stated, right, s=12 + 4 * count, color=f'C{i}', alpha=0.85,
                     label=f'{name}, {count.sum()} answers')
    axes.set(xlabel='probability stated', ylabel='share right; an area counts answers',
             xlim=(0, 1.02), ylim=(-0.05, 1.08))
    axes.legend(loc='upper left', frameon=False)
    save()


if __name__ == '__main__':
    main()
