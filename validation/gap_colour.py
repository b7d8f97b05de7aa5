"""
Calibrate and diagnose spacecraft whose excitation has a colour that their model does not state.

    python -m validation.gap_colour 4 --first 1
    python -m validation.gap_colour 5 --smooth

Each spacecraft differs from its model as in `validation.gap_nominal` at 1 %, is driven at levels
of its own in each record, and its torque and the forces on its modes pass low-passes of first
order, corners even in their logarithm from 0.05 of the rate to 2.0; one in three is white. After a
calibration on one healthy record, three further healthy records and four with an effect. With
`--smooth` they are healthy: one as it was calibrated, and three whose forces have a smooth colour
beside, all of them, the torque or the process noise, each order of 2 dB.
"""
import argparse
from dataclasses import replace
import math
import time

import numpy as np

from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.model import load_spacecraft
from ssi_ros.updating.calibrate import calibrate
from validation.gap_campaign import SECONDS
from validation.gap_nominal import at_other_levels, uncertainty, wrong

ERRORS = 0.01
EFFECTS = ('', '', '', 'sensor_gain:channel=e1_a,scale=1.03',
           'array_asymmetry:array=E1,scale=1.01', 'excitation_colour:corner_hz=40',
           'channel_delay:channel=e2_a,delay_s=0.0005')


ORDERS = 'slope_db', 'curvature_db', 'third_order_db', 'fourth_order_db'


def smooth(rng, force):
    """Return a smooth colour of a force."""
    drawn = zip(ORDERS, 2.0 * rng.standard_normal(len(ORDERS)))
    return f'excitation_spectrum:force={force},' + ','.join(f'{n}={v:.3f}' for n, v in drawn)


def corner(rng, rate_hz):
    """Return a corner [Hz]; infinite for one in three."""
    drawn = rate_hz * math.exp(rng.uniform(math.log(0.05), math.log(2.0)))
    return math.inf if rng.random() < 1 / 3 else drawn


def main():
    """Print a line for each calibration and each record."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('count', type=int, help='spacecraft')
    parser.add_argument('--first', type=int, default=1, help='number of the first')
    parser.add_argument('--smooth', action='store_true', help='healthy, under smooth colours')
    args = parser.parse_args()
    model = replace(load_spacecraft(), uncertainty=uncertainty(ERRORS))
    for number in range(args.first, args.first + args.count):
        rng = np.random.default_rng([number, 194])
        truth = wrong(model, rng)
        corners = {f'{kind}_corner_hz': corner(rng, truth.rate_hz)
                   for kind in ('torque', 'process')}

        def record(seed, *texts):
            craft = at_other_levels(truth, rng)
            driven = replace(craft, excitation=replace(craft.excitation, **corners))
            return simulate_setup(inject(driven, [parse_effect(t) for t in texts], SECONDS), seed)
        begin = time.process_time()
        found = calibrate(model, [record(90_000 + 10 * number)])
        print(f'{number}: corners {corners}: p={found.checks[0].p_value:.2g} '
              f'{time.process_time() - begin:.0f}s; {"; ".join(found.notes) or "white"}',
              flush=True)
        texts = ('', *(smooth(rng, f) for f in ('all', 'torque', 'process_noise')))
        for case, text in enumerate(texts if args.smooth else EFFECTS):
            samples = record(90_001 + 10 * number + case, *filter(None, [text]))
            begin = time.process_time()
            answer = diagnose(found.spacecraft, samples)
            top = ' ; '.join(f'{"+".join(c["effects"])} {c["probability"]:.2f}'
                             for c in answer.to_json()['candidates'][:2])
            print(f'{number}.{case} {text or "none"} -> {answer.outcome} '
                  f'p={answer.gap["p_value"]:.1e} {time.process_time() - begin:.0f}s {top}',
                  flush=True)


if __name__ == '__main__':
    main()
