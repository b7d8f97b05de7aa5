"""A nonlinear force between a measured point and another, seen beside a recording, (188c)."""
from functools import lru_cache

import numpy as np
import pytest

from ssi_ros.events.prediction_error import predictor
from ssi_ros.open_set.force_beside import Driven, force_beside

RATE_HZ, SUBSTEPS, SECONDS, CHANNELS = 50.0, 8, 200.0, 'abc'
MEASURED = 0, 2, 3
STIFFNESS, DAMPING = (2 * np.pi * 3.0) ** 2, 0.25


def cubic(stretch):
    """Return the force of a spring that hardens: a tenth of its stiffness at usual stretches."""
    return 0.1 * STIFFNESS * stretch ** 3 / 0.08 ** 2


def one_sided(stretch):
    """Return the force of a contact that holds in one direction."""
    return 0.1 * STIFFNESS * max(stretch, 0.0)


@lru_cache(maxsize=None)
def motion(seed, force=None, level=1.0):
    """Return accelerations (n, 3) of a chain of five masses, a force between two of them."""
    rng, count = np.random.default_rng(seed), 5
    springs = STIFFNESS * (2 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1))
    matrix = np.block([[np.zeros((count, count)), np.eye(count)],
                       [-springs, -DAMPING * np.eye(count)]])
    dt = 1 / RATE_HZ / SUBSTEPS
    rows, state, found = int(SECONDS * RATE_HZ), np.zeros(2 * count), []
    between = np.array([0, 1.0, 0, -1.0, 0])
    for inputs in 60 * level * rng.standard_normal((rows, count)) * [1, 0, 0, 0, 1]:
        for _ in range(SUBSTEPS):
            slope = matrix @ state
            slope[count:] += inputs
            if force:
                slope[count:] -= between * force(between @ state[:count])
            # velocities first, so that an oscillation gains no energy
            state[count:] += dt * slope[count:]
            state[:count] += dt * state[count:]
        found.append(slope[count:])
    found = np.array(found)[:, MEASURED]
    return found + 0.01 * found.std(axis=0) * rng.standard_normal(found.shape)


def driven(values):
    """Return a record as the test takes it."""
    values = values - values.mean(axis=0)
    return Driven(values, predictor(values).residual(values), RATE_HZ, 0.3)


def beside_model(record):
    """Return what a record shows beside a model, whose forces are linear."""
    return force_beside(None, driven(record), CHANNELS)


def beside(record, reference=None, **more):
    """Return what a record shows beside a healthy one, or another."""
    return force_beside(*map(driven, (motion(1) if reference is None else reference, record)),
                        CHANNELS, **more)


@pytest.mark.parametrize('force, text', [
    (cubic, 'large motion differs'), (one_sided, 'one direction differs')])
def test_forces_between_two_points(force, text):
    """One of them has no channel; differences of those beside it move nearly as it does."""
    found = beside(motion(2, force))
    assert found.p_value < 1e-9
    assert 'A force in the structure' in found.text and text in found.text
    assert not found.channel
    alone = beside_model(motion(2, force))
    assert alone.p_value < 1e-9 and 'before' not in alone.text


def test_linear_motion_has_no_such_force():
    """At one level or another, or at one that varies."""
    swing = 1 + 0.8 * np.sin(2 * np.pi * np.arange(int(SECONDS * RATE_HZ)) / 2500)[:, None]
    for record in (motion(3), motion(4, level=3.0), motion(5) * swing):
        assert beside(record).p_value > 1e-3 and beside_model(record).p_value > 1e-3


def test_a_force_that_was_there_before_is_none():
    """A structure may be nonlinear as it was, or more so where it moves more."""
    assert beside(motion(2, cubic, 1.3), motion(6, cubic)).p_value == 1.0


def test_a_channel_that_follows_a_curve_is_no_force():
    """What its values make of themselves is asked elsewhere."""
    values = motion(3).copy()
    values[:, 1] = np.clip(values[:, 1], -0.7 * values[:, 1].std(), None)
    assert beside(values).p_value < 1e-3
    found = beside(values, sensors={'b'})
    assert 'channel b' not in found.text
