"""
What curves, products and gains of channels are found, and how often of none.

    python -m validation.gap_odd_channels [PAIRS] [--model]

Beside a recording of the same structure, or beside a model that is linear.
"""
import sys

import numpy as np
from scipy.signal import cont2discrete, lfilter
from ssi_ros.events.prediction_error import predictor
from ssi_ros.regimes.odd_channels import findings_beside

from validation.report import table

RATE_HZ, SETTLING, CHANNELS, FORCES = 50.0, 5000, 'abcd', 3
MODES = (0.5, 0.005), (1.7, 0.004), (3.1, 0.01), (7.7, 0.005), (12.3, 0.003)    # [Hz], [1]
LOWEST_HZ = 0.2
NOISE = 0.01            # of the rms of each channel
LENGTHS_S = 60.0, 150.0, 300.0, 600.0
LEVELS = {'steady': (0.0, 0.0), 'all forces vary by half': (0.5, 0.0),
          'one force varies by half': (0.0, 0.5)}
LIMITS = 0.05, 0.01, 0.001
SIZES = {
    'gain varies by 0.3 %': (0.003, 0.0, 0.0), 'by 1 %': (0.01, 0.0, 0.0),
    'product of two others, 0.3 % of the rms': (0.0, 0.003, 0.0), '1 %': (0.0, 0.01, 0.0),
    'dead zone of 3 % of the rms': (0.0, 0.0, 0.03), '10 %': (0.0, 0.0, 0.1)}


def motion(rng, seconds, levels=(0.0, 0.0)):
    """Return accelerations (n, l) of modes under forces whose levels vary, all and the first."""
    drawn = np.random.default_rng(3)        # one structure
    shapes, reached = (drawn.standard_normal((len(MODES), k)) for k in (len(CHANNELS), FORCES))
    rows = int(seconds * RATE_HZ)
    force = rng.standard_normal((rows + SETTLING, FORCES))
    swing = np.sin(2 * np.pi * 3 * np.arange(rows + SETTLING) / rows + rng.uniform(0, 6))
    force *= 1 + levels[0] * swing[:, None]
    force[:, 0] *= 1 + levels[1] * swing
    found = 0.0
    for (hz, ratio), shape, reach in zip(MODES, shapes, reached):
        omega = 2 * np.pi * hz
        b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * ratio * omega, omega ** 2]),
                                1 / RATE_HZ)
        found = found + np.outer(lfilter(np.ravel(b), a, force @ reach)[SETTLING:], shape)
    return found / found.std(axis=0) + NOISE * rng.standard_normal(found.shape)


def wrong(values, gain, product, zone):
    """Return a record whose second channel varies, holds a product, or has a dead zone."""
    values, rows = values.copy(), len(values)
    values[:, 1] *= 1 + gain * np.sin(2 * np.pi * 2.3 * np.arange(rows) / rows)
    values[:, 1] += product * values[:, 0] * values[:, 2]
    values[:, 1] -= np.clip(values[:, 1], -zone, zone)
    return values


def found(reference, record, model):
    """Return what a record shows beside another, or beside a linear model, by family."""
    predicted = [(v, way, way.residual(v)) for v, way in (
        (v, predictor(v)) for v in (reference, record)[model:])]
    predicted = [None] * model + predicted
    return {f.family: f for f in findings_beside(predicted, RATE_HZ, LOWEST_HZ, CHANNELS)}


def main():
    """Print how often p-values of linear motion are small, and those of what is not."""
    numbers = [int(a) for a in sys.argv[1:] if a.isdigit()]
    pairs, model = numbers[0] if numbers else 100, '--model' in sys.argv
    print(f'{pairs} {"records" if model else "pairs"} of linear motion each, share of p-values '
          'below a limit\n')
    rows = []
    for (text, levels), seconds in ((k, s) for k in LEVELS.items() for s in LENGTHS_S):
        rng = np.random.default_rng(int(seconds))
        every = [found(motion(rng, seconds), motion(rng, seconds, levels), model)
                 for _ in range(pairs)]
        for family in every[0]:
            p = np.array([f[family].p_value for f in every])
            rows.append((text, f'{seconds:g}', family, *(f'{(p < x).mean():.3f}' for x in LIMITS),
                         f'{p.min():.1e}'))
    print('\n'.join(table(('levels', 's', 'family', *map(str, LIMITS), 'least'), rows)))
    rows = []
    for (text, sizes), seconds in ((k, s) for k in SIZES.items() for s in LENGTHS_S[1:]):
        rng = np.random.default_rng(int(seconds) + 1)
        is_found = found(motion(rng, seconds), wrong(motion(rng, seconds), *sizes), model)
        best = min(is_found.values(), key=lambda f: f.p_value)
        rows.append((text, f'{seconds:g}', f'{best.p_value:.1e}', best.text))
    print('\n' + '\n'.join(table(('what is wrong with b', 's', 'p-value', 'found'), rows)))


if __name__ == '__main__':
    main()
