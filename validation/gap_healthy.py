"""
Measure the tests of a calibrated model on healthy records of spacecraft that differ from it.

    python -m validation.gap_healthy 8 6 --errors 0.01
    python -m validation.gap_healthy 8 6 --errors 0.01 --recordings 3 --apart 0.0005

Of each spacecraft, as of `validation.gap_nominal`, one healthy record or more calibrate the model,
and others, at other levels, undergo all tests. Each frequency may differ from one to the next. A
p-value that is right is below a with probability a.
"""
import argparse
from collections import defaultdict

import numpy as np

from ssi_ros.effects import applicable, inject, simulate_setup
from ssi_ros.gap.inference.whittle import BLAS
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.open_set.families import FAMILIES
from validation.gap_campaign import SECONDS
from validation.gap_nominal import at_other_levels, crafts, elsewhere
from validation.report import table

SHARES = 0.2, 0.05, 0.01, 0.001


def p_values(nominal, samples):
    """Return the p-values of a record by test, of the open-set test by family."""
    with BLAS.limit(limits=1):
        comparison = ModelNominal(nominal).compare(
            samples, DiagnosisSettings(), applicable(nominal), lambda share: None)
        null = comparison.null
        residual, (_, odd, _) = comparison.residual(null), comparison.detections(null)
    return {'all tests together': residual.p_value, 'scores of effects':
            residual.score_test.p_value, **{d.basis: d.p_value for d in odd
                                            if d.basis in FAMILIES}}


def main():
    """Read the command line, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('crafts', type=int, help='spacecraft')
    parser.add_argument('records', type=int, help='of each')
    parser.add_argument('--errors', type=float, default=0.01, help='of the frequencies')
    parser.add_argument('--first', type=int, default=500, help='number of the first spacecraft')
    parser.add_argument('--recordings', type=int, default=1, help='healthy ones (default: 1)')
    parser.add_argument('--apart', type=float, default=0.0,
                        help='deviation of each frequency from recording to recording')
    args = parser.parse_args()
    found = defaultdict(list)
    for number, _, truth, nominal, _ in crafts('calibrated', args.errors, args.first,
                                               args.recordings, args.apart):
        if number == args.first + args.crafts:
            break
        for k in range(args.records):
            rng = np.random.default_rng([number, 77, k])
            recorded = at_other_levels(elsewhere(truth, args.apart, rng), rng)
            samples = simulate_setup(inject(recorded, (), SECONDS), 990_000 + 100 * number + k)
            for test, p in p_values(nominal, samples).items():
                found[test].append(p)
            print(f'{number}.{k}', ' '.join(f'{t}: {v[-1]:.2g};' for t, v in found.items()
                                            if v[-1] < 0.01), flush=True)
    print('\n'.join(table(('test', 'records', *(f'p < {a}' for a in SHARES), 'least'), [
        (test, len(p), *(f'{np.mean(np.array(p) < a):.3f}' for a in SHARES), f'{min(p):.1g}')
        for test, p in found.items()])))


if __name__ == '__main__':
    main()
