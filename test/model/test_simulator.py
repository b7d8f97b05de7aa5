"""Exact propagation: the same numbers however time is cut, and the laws that they obey."""
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from scipy.linalg import expm
from ssi_ros.model import (
    assemble, load_spacecraft, natural_modes, simulate, Spacecraft, stream)
from ssi_ros.model.disturbances import Firings
from ssi_ros.model.errors import Calibration
from ssi_ros.model.excitation import Coloured, White
from ssi_ros.model.simulator import propagate
from ssi_ros.model.statespace import settling
from ssi_ros.records import Samples


def take(blocks, count):
    """Join the first blocks of a stream into one record."""
    blocks = list(islice(blocks, count))
    return Samples(np.vstack([b.values for b in blocks]), blocks[0].rate_hz, blocks[0].channels,
                   blocks[0].start_ns)


@pytest.fixture(scope='module')
def system():
    """Return the default system."""
    return assemble(Spacecraft())


def test_two_runs_are_equal_bit_for_bit(system):
    """The seed decides every bit, and another seed gives another record."""
    one = simulate(system, 30.0, 7).values
    assert np.array_equal(one, simulate(system, 30.0, 7).values)
    assert not np.any(one == simulate(system, 30.0, 8).values)


@pytest.mark.parametrize('block_s', [0.01, 0.37, 1.0, 25.0])
def test_blocks_do_not_matter(system, block_s):
    """1e-12 of the largest value: only the order of sums in BLAS may differ."""
    whole = simulate(system, 25.0, 3).values
    count = int(np.ceil(25.0 / block_s))
    parts = take(stream(system, 3, block_s), count).values[:2500]
    assert np.abs(parts - whole).max() < 1e-12 * np.abs(whole).max()


def test_propagation_equals_the_matrix_exponential(system):
    """The modal recurrence is the textbook zero-order hold; 1e-9 is the rounding of expm."""
    space, dt = system.plant, 0.01
    n, m = space.b.shape
    whole = expm(np.block([[space.a, space.b], [np.zeros((m, n + m))]]) * dt)
    a, b = whole[:n, :n], whole[:n, n:]
    quiet = replace(system, chain=())
    forces = np.zeros((400, m))
    forces[:, 0] = np.random.default_rng(5).standard_normal(400)
    forces[:, 7] = np.random.default_rng(6).standard_normal(400)
    x, expected = np.zeros(n), []
    for u in forces:
        expected.append(space.c @ x + space.d @ u)
        x = a @ x + b @ u

    class Given:
        name = 'given'

        def begin(self, rate_hz, inputs, generator):
            return lambda first, count: forces[first:first + count]

        def covariance(self, rate_hz, inputs):
            return np.zeros((m, m))
    got = simulate(quiet, 4.0, 1, excitation=(Given(),)).values
    assert np.abs(got - expected).max() < 1e-9 * np.abs(expected).max()


def test_the_start_is_stationary(system):
    """Over 400 seeds the first second has the variance of the 20th: 25 % is 4 standard errors."""
    runs = np.array([simulate(system, 20.0, s).values for s in range(400)])
    early, late = runs[:, :100].std(axis=(0, 1)), runs[:, -100:].std(axis=(0, 1))
    assert early == pytest.approx(late, rel=0.25)
    rest = np.array([simulate(system, 1.0, s, at_rest=True).values for s in range(20)])
    assert rest[:, :10].std() < 0.5 * runs[:, :10].std()


def test_a_coloured_excitation_has_gone_on_for_ever_too(system):
    """Fast modes begin with the little that a low-pass leaves them, not with what white gives."""
    coloured = replace(system, chain=(), excitation=tuple(
        Coloured(part, 0.8) for part in system.excitation))
    runs = np.array([simulate(coloured, 20.0, s).values for s in range(100)])
    fast = np.diff(runs, n=2, axis=1)
    assert fast[:, :100].std(axis=(0, 1)) == pytest.approx(
        fast[:, -100:].std(axis=(0, 1)), rel=0.25)


def test_only_what_takes_an_hour_to_settle_grows_over_a_record():
    """A mode of 0.5 Hz with 0.05 % of damping, 640 s, is stationary like all others, (23b)."""
    slow, forever = (np.exp((-z + 1j) * 2 * np.pi * 0.5 / 100.0) for z in (5e-4, 5e-5))
    slowly, held = settling(np.array([slow, forever]), 100.0, 60_000)
    assert slowly == 1.0 and abs(forever * held) == pytest.approx(np.exp(-1 / 60_000))


def test_the_state_stays_bounded(system):
    """A free hub turns ever further, but its angle is not in the state that is propagated."""
    assert not any(name.startswith('theta') for name in system.plant.states)
    long = simulate(system, 3600.0, 2).values
    assert long[-60000:].std() == pytest.approx(long[:60000].std(), rel=0.1)


def test_sources_do_not_disturb_each_other(system):
    """Taking the sensor noise away leaves the torque's numbers as they were."""
    noisy = simulate(system, 60.0, 4).values
    clean = simulate(replace(system, chain=()), 60.0, 4).values
    # What is left is the noise itself, white with its rms: 5 % is 5 standard errors.
    assert (noisy - clean).std(axis=0) == pytest.approx(3e-4, rel=0.05)


def test_density_does_not_depend_on_the_rate(system):
    """Twice the rate gives the same response: 12 % is 3 standard errors of one record's rms."""
    quiet = replace(system, chain=())
    one = simulate(quiet, 900.0, 1).values.std()
    two = simulate(quiet, 900.0, 2, rate_hz=200.0).values
    slow = two[:, 0].reshape(-1, 2).mean(axis=1)   # below 50 Hz both hold the same modes
    assert slow.std() == pytest.approx(one, rel=0.12)


def test_a_rate_that_aliases_is_refused(system):
    """The message names the alias and the rate that would do."""
    with pytest.raises(ValueError, match=r'31.030 Hz would appear at 8.970 Hz; raise'):
        simulate(system, 10.0, 1, rate_hz=40.0)


def test_errors_may_move_a_mode_above_half_of_the_rate():
    """A calibration is not refused for a mode that no recording shows, at 31.03 Hz here."""
    craft = replace(load_spacecraft(), rate_hz=50.0)
    fitted = replace(craft, calibration=Calibration(('gain e1_a',), (1e-3,)))
    assert np.isfinite(simulate(assemble(fitted), 10.0, 1).values).all()
    with pytest.raises(ValueError, match='is too low: 2 modes'):
        simulate(assemble(craft), 10.0, 1)
    with pytest.raises(ValueError, match='is too low'):
        simulate(assemble(fitted), 10.0, 1, rate_hz=45.0)


@pytest.mark.parametrize('duration_s', [0.0, -1.0, float('nan'), float('inf')])
def test_no_duration_is_refused(system, duration_s):
    """A record has at least one sample and an end."""
    with pytest.raises(ValueError, match='duration_s'):
        simulate(system, duration_s, 1)


def test_a_bad_seed_is_refused(system):
    """A seed is a whole number."""
    with pytest.raises(ValueError, match='seed=-1'):
        simulate(system, 1.0, -1)


def test_an_unknown_input_is_refused(system):
    """The message lists the inputs."""
    with pytest.raises(ValueError, match="'torque_q' is not on this system; it has torque_x"):
        simulate(system, 1.0, 1, excitation=(White('t', ('torque_q',), (1.0,)),))


def test_stamps_follow_on(system):
    """Blocks carry the stamps of one even grid."""
    stamps = [b.start_ns for b, _ in zip(stream(system, 1, 0.03, start_ns=10), range(3))]
    assert stamps == [10, 30000010, 60000010]


def test_eigenvalues_are_those_of_the_record(system):
    """A free decay, realised by ERA without the model, has the model's poles to 1e-6."""
    kick = tuple(Firings(f'{a}_force{i + 1}', 1.0 + 0.1 * i + (a == 'E2') * 0.37, (0.0,), 0.01,
                         f'kick_{a}{i}') for a in ('E1', 'E2') for i in range(10))
    quiet = replace(system, chain=())
    decay = simulate(quiet, 60.0, 1, excitation=kick, at_rest=True).values[1:]
    # ERA (Juang and Pappa 1985): shift of the row space of a Hankel matrix of rank 40.
    rows = 200
    hankel = np.hstack([decay[k:k + rows].reshape(-1, 1) for k in range(0, 4000, 7)])
    gamma = np.linalg.svd(hankel, full_matrices=False)[0][:, :40]
    shift = np.linalg.lstsq(gamma[:-4], gamma[4:], rcond=None)[0]
    found = 100 * np.log(np.linalg.eigvals(shift))
    for value in natural_modes(system).eigenvalues:
        assert np.min(np.abs(found - value)) < 1e-6 * abs(value)


def test_energy_is_kept():
    """Without damping and torque eq. (4) holds over 1e5 steps to 1e-9, rounding of the poles."""
    craft = Spacecraft()
    free = assemble(replace(craft, arrays=tuple(
        replace(a, damping_ratio=0.0) for a in craft.arrays)))
    sampled = free.plant.discrete(100.0)
    z = sampled.inverse @ np.random.default_rng(1).standard_normal(40)
    h, j = free.mass[:3, 3:], free.mass[:3, :3]

    def energy(z):
        # no momentum in all, so the hub turns by J theta' = -H eta'
        x = ((sampled.vectors * sampled.weight) @ z).real
        reduced = np.eye(20) - h.T @ np.linalg.solve(j, h)
        return x[20:] @ reduced @ x[20:] + x[:20] @ free.stiffness[3:, 3:] @ x[:20]
    start = energy(z)
    for _ in range(10):
        _, z = propagate(sampled, np.zeros((10000, 23)), z)
        assert energy(z) == pytest.approx(start, rel=1e-9)
