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


def stiffness_of(springs):
    """Return the stiffness matrix of the chain [N/m]."""
    return 1e3 * (np.diag(springs + np.append(springs[1:], 0.0))
                  - np.diag(springs[1:], 1) - np.diag(springs[1:], -1))


def chain(seed, springs=SPRINGS, masses=MASSES, seconds=400.0):
    """Return accelerations of four of six masses under three white forces, 45 dB over noise."""
    rng, rows = np.random.default_rng(seed), int(seconds * RATE_HZ)
    sizes, shapes = eigh(stiffness_of(springs), np.diag(masses))
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


def with_damper(seed, coefficient=0.0, at=5, seconds=400.0):
    """Return accelerations of the chain, damped by 1 %, with a damper [N s/m] to the ground."""
    rng, rows = np.random.default_rng(seed), int(seconds * RATE_HZ)
    stiffness = stiffness_of(SPRINGS)
    sizes, shapes = eigh(stiffness, np.diag(MASSES))
    modal = MASSES[:, None] * shapes
    damping = modal @ np.diag(0.02 * np.sqrt(sizes)) @ modal.T
    damping[at, at] += coefficient
    w = 2 * np.pi * np.fft.rfftfreq(rows, 1 / RATE_HZ)[:, None, None]
    force = np.fft.rfft(rng.standard_normal((len(FORCES), rows)))
    moved = np.linalg.solve(stiffness - w ** 2 * np.diag(MASSES) + 1j * w * damping,
                            np.eye(len(MASSES))[:, FORCES] @ force.T[..., None])
    values = np.fft.irfft(-(w * w * moved)[..., 0], rows, axis=0)[:, CHANNELS]
    values += 10 ** (-45 / 20) * values.std() * rng.standard_normal(values.shape)
    return Samples(values, RATE_HZ, tuple(f'm{c + 1}' for c in CHANNELS))


def test_one_damper_is_named_before_a_delay():
    """It turns the phases of shapes where it is, as a delay of the channel there does."""
    found = diagnose_reference(with_damper(1), with_damper(2, 40.0), effects=(
        'damping_scale', 'channel_delay', 'sensor_misplacement', 'sensor_gain'))
    best = found.candidates[0]
    assert best.effects == ('damping_scale',) and best.closed > 0.9
    assert best.parameters['damping_scale.loss_angle'].value == pytest.approx(np.pi / 2, abs=0.3)
    assert 'damping_scale.near.m6' in best.parameters
    assert found.where.site['structure'] > 0.7
