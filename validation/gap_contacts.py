"""
Ask whether impulses follow the motion where they come from outside: none should be a contact.

    python -m validation.gap_contacts [RECORDS]

Four channels of five modes under three forces, 300 s at 50 Hz, against a recording without
impulses; RECORDS (default 50) of every kind and size.
"""
import argparse

import numpy as np
from scipy.signal import cont2discrete, lfilter
from ssi_ros.events.contacts import contact, FOLLOWS
from ssi_ros.events.prediction_error import predictor

from validation.report import table

HEAD = 'impulses', 'size', 'p < 0.05', 'p < 0.01', f'p < {FOLLOWS:g}', 'least'
RATE_HZ, ROWS, SETTLING, EVENTS = 50.0, 15_000, 5000, 40
MODES = (0.5, 0.01), (1.7, 0.008), (3.1, 0.01), (7.7, 0.01), (12.3, 0.006)     # [Hz], [1]
NOISE, SIZES = 0.01, (4.0, 12.0)        # of the rms of a channel, of a force
TRAIN = (0, 60, 110, 150), (1.0, 0.8, 0.6, 0.5)     # rows and sizes within one


def at_random(rng):
    """Return rows and sizes of one sign."""
    return rng.integers(0, ROWS, EVENTS), np.ones(EVENTS)


def of_both_signs(rng):
    """Return rows and sizes of either sign."""
    return rng.integers(0, ROWS, EVENTS), rng.choice([-1.0, 1.0], EVENTS)


def periodic(rng):
    """Return rows at a period of 3 to 12 s."""
    rows = np.arange(100, ROWS, int(rng.uniform(150, 600)))
    return rows, np.ones(len(rows))


def in_trains(rng):
    """Return rows of trains, each impulse in the ringing of the one before."""
    begin = rng.integers(0, ROWS - 400, EVENTS // len(TRAIN[0]))
    return (begin[:, None] + TRAIN[0]).ravel(), np.tile(TRAIN[1], len(begin))


KINDS = at_random, of_both_signs, periodic, in_trains


def motion(rng, impulses=0.0):
    """Return accelerations (n, 4) under three forces and impulses (n,) at one place."""
    fixed = np.random.default_rng(3)
    shapes, gains = (fixed.standard_normal((len(MODES), k)) for k in (4, 3))
    place, found = fixed.standard_normal(len(MODES)), 0.0
    forces = rng.standard_normal((ROWS + SETTLING, 3))
    for (hz, ratio), shape, gain, at in zip(MODES, shapes, gains, place):
        omega = 2 * np.pi * hz
        b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * ratio * omega, omega ** 2]),
                                1 / RATE_HZ)
        force = forces @ gain
        force[SETTLING:] += at * impulses
        found = found + np.outer(lfilter(np.ravel(b), a, force)[SETTLING:], shape)
    found = found / found.std(axis=0)
    return found + NOISE * rng.standard_normal(found.shape)


def chance(rng, kind, size):
    """Return the p-value of impulses that follow the motion."""
    impulses = np.zeros(ROWS)
    rows, sizes = kind(rng)
    np.add.at(impulses, rows, size * sizes)
    both = motion(rng), motion(rng, impulses)
    ways = [predictor(v) for v in both]
    errors = [w.residual(v) for w, v in zip(ways, both)]
    white = [w.slew_normalised(v, e) for w, v, e in zip(ways, both, errors)]
    return contact(white, (ways[1], errors[1]), RATE_HZ, MODES[0][0], 'abcd')[0]


def main():
    """Print one row a kind and size."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('records', nargs='?', type=int, default=50, metavar='RECORDS')
    count, rows = parser.parse_args().records, []
    for kind in KINDS:
        for size in SIZES:
            p = np.array([chance(np.random.default_rng(seed), kind, size)
                          for seed in range(count)])
            rows.append((kind.__name__.replace('_', ' '), f'{size:g}', *(
                f'{np.mean(p < x):.3f}' for x in (0.05, 0.01, FOLLOWS)), f'{p.min():.1e}'))
    print('\n'.join(table(HEAD, rows)))


if __name__ == '__main__':
    main()
