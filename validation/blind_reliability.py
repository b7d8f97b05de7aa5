"""
Draw how often answers of blind campaigns are right, by the probability that they state.

    python -m validation.blind_reliability ninth tenth

The names are those of campaigns in docs/validation/blind. Intervals are those of 95 %. The mean
deviation of the bins is printed beside what answers would have that are right exactly as often as
they say, by chance (median and 90 % interval): no count of answers has zero.
"""
import argparse
import json

import numpy as np

from validation.blind_ties import FOLDER
from validation.gap_figures import interval
from validation.report import figure

DRAWS = 10000


def reliability(name):
    """Return the mean probability, share right and number of answers of each bin of a campaign."""
    bins = json.loads((FOLDER / f'{name}_scores.json').read_text())['reliability']
    return tuple(np.array([b[k] for b in bins]) for k in ('mean', 'right', 'total'))


def deviation(stated, right, count):
    """Return the mean |probability - share right| over answers in bins, the last axis."""
    return np.sum(np.abs(stated - right) * count, axis=-1) / count.sum()


def by_chance(stated, count):
    """Return median and 90 % interval of the deviation of answers as often right as they say."""
    right = np.random.default_rng(0).binomial(count, stated, (DRAWS, len(count))) / count
    return np.quantile(deviation(stated, right, count), [0.5, 0.05, 0.95])


def main():
    """Write docs/figures/blind_reliability.png."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('names', nargs='+', help='of campaigns, such as ninth')
    names = parser.parse_args().names
    shape, save = figure('blind_reliability.png')
    axes = shape.subplots()
    axes.plot([0, 1], [0, 1], color='0.7', linewidth=1)
    for i, name in enumerate(names):
        stated, right, count = reliability(name)
        print(f'{name}: calibration error {deviation(stated, right, count):.3f}, of answers as '
              'often right as they say {:.3f} [{:.3f}, {:.3f}]'.format(*by_chance(stated, count)))
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
