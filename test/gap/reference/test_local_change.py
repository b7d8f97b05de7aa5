"""A chain of masses in which one spring gives, or one mass grows: the record names the place."""
import numpy as np
import pytest
from reference_records import diagnose_reference
from scipy.linalg import eigh
from scipy.signal import cont2discrete, lfilter
from ssi_ros.records import Samples

RATE_HZ = 50.0
MASSES = np.array([10.0, 8.0, 9.0, 7.0, 10.0, 8.0])          # [kg]
SPRINGS = np.array([60.0, 45.0, 50.0, 40.0, 52.0, 45.0])    # [kN/m], the first to the ground
CHANNELS, FORCES = [0, 2, 3, 5], [1, 3, 4]


def chain(seed, springs=SPRINGS, masses=MASSES, seconds=400.0):
    """Return accelerations of four of six masses under three white forces, 45 dB over noise."""
    rng, rows = np.random.default_rng(seed), int(seconds * RATE_HZ)
    stiffness = np.diag(springs + np.append(springs[1:], 0.0)) * 1e3
    stiffness -= 1e3 * (np.diag(springs[1:], 1) + np.diag(springs[1:], -1))
    sizes, shapes = eigh(stiffness, np.diag(masses))
    forces = shapes[FORCES].T @ rng.standard_normal((len(FORCES), rows + 2000))
    modal = []
    for w, force in zip(np.sqrt(sizes), forces):
        b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 0.02 * w, w ** 2]), 1 / RATE_HZ)
        modal.append(lfilter(np.ravel(b), a, force)[2000:])
    values = np.array(modal).T @ shapes[CHANNELS].T
    values += 10 ** (-45 / 20) * values.std() * rng.standard_normal(values.shape)
    return Samples(values, RATE_HZ, tuple(f'm{c + 1}' for c in CHANNELS))


@pytest.mark.parametrize('changed, near', [
    pytest.param({'springs': SPRINGS * [1, 1, 0.97, 1, 1, 1]}, [], marks=pytest.mark.slow),
    ({'masses': MASSES * [1, 1, 1, 1.03, 1, 1]}, ['m4'])])
def test_one_spring_or_mass_is_named_before_a_sensor_that_moved(changed, near):
    """All modes by one place explain the gap; a mass at a channel is found there."""
    found = diagnose_reference(chain(1), chain(3, **changed), effects=(
        'stiffness_scale', 'sensor_misplacement', 'sensor_gain'))
    best = found.candidates[0]
    assert best.effects == ('stiffness_scale',) and best.closed > 0.9
    names = [n.removeprefix('stiffness_scale.') for n in best.parameters]
    assert sum(n.startswith('modal_mass_at_') for n in names) == len(MASSES) - 1
    assert [n.removeprefix('near.') for n in names if n.startswith('near.')] == near
    assert found.where.site['structure'] > 0.7
