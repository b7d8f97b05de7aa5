"""
Diagnose a chain of three modes against a recording of it: healthy pairs, gains, other levels.

    python -m validation.gap_chain
"""
from itertools import product
import time

import numpy as np
from scipy.signal import cont2discrete, lfilter
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.records import Samples

from validation.report import table

HEAD = 'levels of the forces', 'gain put in', 'outcome', 'named', 'found', 'CPU s'
PAIRS = 32
RATE_HZ, SECONDS, SETTLING = 50.0, 240.0, 2000
MODES = (2.1, 0.01), (5.3, 0.008), (9.7, 0.01)          # frequency [Hz], damping ratio [1]
SHAPES = np.array([[1.0, 0.8, 0.6], [0.7, -0.9, 0.3], [0.4, 0.5, -1.0]])    # (channel, mode)
NOISE = 0.01            # of the rms that a mode gives to the channel of its largest component
LEVELS = (1.0, 1.0, 1.0), (2.0, 2.0, 2.0), (1.2, 0.8, 1.5), (0.5, 2.0, 1.0)
GAINS = 1.05, 1.1, 1.3, 1.5, 0.7


def chain(seed, levels=LEVELS[0], gain=1.0):
    """Return accelerations of modes under white forces; the second channel reads `gain` times."""
    rng = np.random.default_rng(seed)
    rows, motion = int(SECONDS * RATE_HZ), []
    for (frequency_hz, ratio), level in zip(MODES, levels):
        omega = 2 * np.pi * frequency_hz
        b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * ratio * omega, omega ** 2]),
                                1 / RATE_HZ)
        drawn = level * rng.standard_normal(rows + SETTLING)
        motion.append(lfilter(np.ravel(b), a, drawn)[SETTLING:])
    values = np.array(motion).T @ SHAPES.T
    values += NOISE * rng.standard_normal(values.shape)
    return Samples(values * [1.0, gain, 1.0], RATE_HZ, ('a', 'b', 'c'))


def main():
    """Print the alarms of healthy pairs, and one row a gain."""
    named = []
    for seed in range(0, 2 * PAIRS, 2):
        found = diagnose(RecordedNominal(chain(seed)), chain(seed + 1))
        if found.outcome != 'WITHIN_FLOOR':
            named.append(' + '.join(found.verdict['effects']) or found.outcome)
    print(f'{len(named)} of {PAIRS} healthy pairs are not within the floor: '
          f'{", ".join(named) or "none"}\n')
    rows = []
    for row, (levels, gain) in enumerate(product(LEVELS, (1.0, *GAINS))):
        begin, seed = time.process_time(), 1000 + 2 * row
        found = diagnose(RecordedNominal(chain(seed)), chain(seed + 1, levels, gain))
        got = found.candidates[0].parameters.get('sensor_gain.scale')
        rows.append((', '.join(f'{x:g}' for x in levels), f'{gain:g}', found.outcome,
                     ' + '.join(found.verdict['effects']),
                     f'{got.value:.4g} [{got.low90:.4g}, {got.high90:.4g}]' if got else '',
                     f'{time.process_time() - begin:.1f}'))
    print('\n'.join(table(HEAD, rows)))


if __name__ == '__main__':
    main()
