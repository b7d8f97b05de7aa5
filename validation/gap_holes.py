"""
Diagnose records with lost rows, and with values at the rails: what is left once they are filled.

    python -m validation.gap_holes

Every record: 600 s of the package's own simulator, level within 3 dB of the model's.
"""
import time

import numpy as np
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.model import load_spacecraft

from validation.gap_reference import at_decibel, SECONDS

CASES = ('dropped_samples:fraction=0.02', 'dropped_samples:fraction=0.1',
         'dropped_samples:fraction=0.3', 'saturation:limit_m_s2=0.1',
         'saturation:limit_m_s2=0.075', 'saturation:limit_m_s2=0.05',
         'saturation:limit_m_s2=0.035', 'saturation:limit_m_s2=0.02')
SEED = 90_000


def main():
    """Print what is said of every case."""
    spacecraft = load_spacecraft()
    print('| injected | named | outcome | reason | CPU s |\n' + '|---' * 5 + '|', flush=True)
    for k, case in enumerate(CASES):
        craft = at_decibel(spacecraft, np.random.default_rng(k).uniform(-3, 3))
        samples = simulate_setup(inject(craft, [parse_effect(case)], SECONDS), SEED + k)
        begin = time.process_time()
        found = diagnose(spacecraft, samples)
        print(f'| {case} | {"; ".join(found.signs)} | {found.outcome} | {found.reason} | '
              f'{time.process_time() - begin:.0f} |', flush=True)


if __name__ == '__main__':
    main()
