"""Impulses that come where a displacement is extreme are a contact, those at random are none."""
import numpy as np
from scipy.signal import cont2discrete, lfilter
from ssi_ros.events.contacts import contact, FOLLOWS, makes_contact, not_from_outside
from ssi_ros.events.prediction_error import predictor
from ssi_ros.gap.comparison import Detection

RATE_HZ, ROWS, SETTLING, WIDTH = 50.0, 12_000, 3000, 3
MODES = (1.1, 0.02), (3.1, 0.02), (7.7, 0.01)   # [Hz], [1]


def responses(force, power):
    """Return accelerations (n, 3) of a force (n, 3) on three modes, or what they are s^2 of."""
    found = []
    for (hz, ratio), one in zip(MODES, force.T):
        omega = 2 * np.pi * hz
        below = [1.0, 2 * ratio * omega, omega ** 2]
        b, a, _ = cont2discrete(([1.0] + [0.0] * power, below), 1 / RATE_HZ)
        found.append(lfilter(np.ravel(b), a, one))
    shapes = np.random.default_rng(7).standard_normal((len(MODES), WIDTH))
    return np.array(found).T @ shapes


def chance(rows_of):
    """Return p-value and words of impulses at rows that follow from the displacements (n, 3)."""
    rng = np.random.default_rng(5)
    reference, force = (rng.standard_normal((ROWS + SETTLING, len(MODES))) for _ in range(2))
    pushed = force.copy()
    pushed[rows_of(responses(force, 0), rng)] += 12.0
    both = [responses(f, 2)[SETTLING:] for f in (reference, pushed)]
    both = [v + 0.01 * v.std(axis=0) * rng.standard_normal(v.shape) for v in both]
    ways = [predictor(v) for v in both]
    errors = [w.residual(v) for w, v in zip(ways, both)]
    return contact(errors, (ways[1], errors[1]), RATE_HZ, MODES[0][0], ('a', 'b', 'c'))


def at_a_stop(displacements, rng):
    """Return where one channel is beyond twice its deviation for the first time in a while."""
    beyond = np.flatnonzero(displacements[:, 1] > 2 * displacements[:, 1].std())
    return beyond[np.diff(beyond, prepend=-1000) > 150] + 1


def test_a_stop_is_a_contact():
    """Channel b is far to one side when it meets the stop."""
    p_value, where = chance(at_a_stop)
    assert p_value < FOLLOWS
    assert 'b' in where.split()


def test_impulses_at_random_are_none():
    """They come at any displacement."""
    assert chance(lambda _, rng: rng.integers(SETTLING, SETTLING + ROWS, 40))[0] > 0.01


def test_trains_of_impulses_are_none():
    """Each comes in the ringing of the one before, always in the same phase."""
    assert chance(lambda *_: np.arange(SETTLING + 50, SETTLING + ROWS, 225))[0] > 0.01


def test_impulses_from_outside_are_set_aside():
    """Other detections stay, and a joint with play is a contact itself."""
    found = [Detection(n, {}, 1e-9, '') for n in ('impulsive_events', 'hinge_freeplay')]
    assert [d.effect for d in not_from_outside(found)] == ['hinge_freeplay']
    assert makes_contact(('hinge_freeplay',)) and not makes_contact(('impulsive_events',))
