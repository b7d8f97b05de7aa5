"""Transfer functions, expected spectra and shaping filters."""
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov
from scipy.signal import welch
from ssi_ros.model import assemble, natural_modes, simulate, Spacecraft
from ssi_ros.model.sensors import Mix, Noise
from ssi_ros.model.shaping import low_pass, resonance, same_on_all
from ssi_ros.model.spectrum import output_spectrum
from ssi_ros.model.three_dof import three_dof


@pytest.fixture(scope='module')
def system():
    """Return the default system."""
    return assemble(Spacecraft())


def test_transfer_is_the_matrix_inverse(system):
    """H(j w) = -w^2 S (K - w^2 M + j w D)^-1 B, without modes; 1e-8 is its rounding."""
    f = np.array([0.1, 0.69, 7.0, 12.5, 45.0])
    for h, w in zip(system.transfer(f), 2 * np.pi * f):
        dynamic = system.stiffness - w ** 2 * system.mass + 1j * w * system.damping
        expected = -w ** 2 * system.sensor @ np.linalg.solve(dynamic, system.input)
        assert np.abs(h - expected).max() < 1e-8 * np.abs(expected).max()


def test_hold_makes_the_difference(system):
    """At 0.5 Hz and 1 kHz the hold costs less than 1 %; at a fifth of the rate, 6.5 % or so."""
    near = system.transfer([0.5])[:, :, 0] / system.transfer([0.5], 1000.0)[:, :, 0]
    assert np.abs(np.abs(near) - 1).max() < 0.01
    row = three_dof(noise_rms_m=0.0)      # a displacement has no feedthrough, and rolls off
    ratio = np.abs(row.transfer([20.0], 100.0) / row.transfer([20.0]))[0, 0, 0]
    assert ratio == pytest.approx(np.sinc(0.2), rel=0.02)


@pytest.mark.parametrize('shaping', [None, low_pass(5.0, 23), resonance(8.0, 0.1, 5.0, 23)])
def test_spectrum_of_a_record(system, shaping):
    """Band by band, 1200 s against theory: 20 % is 4 standard errors where modes are few."""
    shaped = replace(system, shaping=shaping)
    values = simulate(shaped, 1200.0, 1).values[:, 0]
    f, density = welch(values, 100.0, nperseg=8192)
    expected = 2 * output_spectrum(shaped, f[1:-1])[:, 0, 0].real
    for low, high in ((5.5, 7.5), (8.0, 10.0), (11.5, 13.5), (20.0, 25.0), (35.0, 49.0)):
        band = (f[1:-1] > low) & (f[1:-1] < high)
        assert density[1:-1][band].sum() == pytest.approx(expected[band].sum(), rel=0.2)


def test_stationary_covariance(system):
    """The closed form equals the Lyapunov solver to 1e-7, the solver's own rounding."""
    shaped = replace(system, shaping=low_pass(5.0, 23))
    for space in (system.plant, shaped.state_space):
        sampled = space.discrete(100.0)
        q = np.diag(np.linspace(1.0, 2.0, 23))
        p = sampled.state_covariance(q)
        values, vectors, inverse = space.diagonal
        a = (vectors * np.exp(values / 100.0) @ inverse).real
        held = (vectors * (np.expm1(values / 100.0) / values) @ inverse @ space.b).real
        expected = solve_discrete_lyapunov(a, held @ q @ held.T)
        size = np.sqrt(np.diag(expected))
        assert np.abs((p - expected) / np.outer(size, size)).max() < 1e-6


def test_augmented_system_keeps_both_sets_of_poles(system):
    """Paper, section 4.2: poles of A and of A_f, nothing else."""
    values, _, _ = replace(system, shaping=resonance(8.0, 0.1, 5.0, 23)).state_space.diagonal
    plant, _, _ = system.plant.diagonal
    omega = 2 * np.pi * 8.0
    own = omega * (-0.1 + 1j * np.sqrt(1 - 0.01))
    assert len(values) == len(plant) + 46
    assert np.sum(np.abs(values - own) < 1e-9 * omega) == 23
    for pole in plant:
        assert np.min(np.abs(values - pole)) < 1e-12 * abs(pole)


def test_a_filter_that_changes_nothing(system):
    """Direct feedthrough alone leaves the numbers as they are, to rounding."""
    through = same_on_all(-1.0, 0.0, 1.0, 1.0, 23)
    plain = simulate(system, 5.0, 1, at_rest=True).values
    shaped = simulate(replace(system, shaping=through), 5.0, 1, at_rest=True).values
    assert np.abs(shaped - plain).max() < 1e-10 * np.abs(plain).max()


def test_conditioning_filter(system):
    """A filter behind the channels multiplies the continuous response."""
    behind = replace(system, conditioning=low_pass(3.0, 4))
    f = np.array([0.5, 3.0, 20.0])
    filtered = behind.state_space.response(2j * np.pi * f)[:, 0, 0]
    ratio = filtered / system.transfer(f)[:, 0, 0]
    assert ratio == pytest.approx(1 / (1 + 1j * f / 3.0), rel=1e-7)


def test_chain_acts_on_the_spectrum(system):
    """Gain before and after the noise: densities follow."""
    plain = replace(system, chain=(Noise((1.0,) * 4),), excitation=())
    assert output_spectrum(plain, [1.0])[0] == pytest.approx(np.eye(4) / 100.0)
    double = tuple(map(tuple, (2 * np.eye(4)).tolist()))
    after = replace(plain, chain=(Noise((1.0,) * 4), Mix(double)))
    assert output_spectrum(after, [1.0])[0] == pytest.approx(4 * np.eye(4) / 100.0)


@pytest.mark.parametrize('make, words', [
    (lambda: low_pass(-1.0, 3), 'corner_hz=-1'),
    (lambda: same_on_all(1.0, 1.0, 1.0, 0.0, 2), 'real part 1'),
    (lambda: replace(assemble(Spacecraft()), shaping=low_pass(1.0, 3)).state_space, '3 outputs'),
])
def test_bad_filters_are_refused(make, words):
    """The message names what does not fit."""
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize('field, words', [('mass', 'positive definite'),
                                          ('stiffness', 'negative stiffness')])
def test_bad_matrices_are_refused(field, words):
    """A negative mass or stiffness is told apart."""
    system = three_dof()
    with pytest.raises(ValueError, match=words):
        replace(system, **{field: -np.array(getattr(system, field))})
    skew = np.array(getattr(system, field))
    skew[0, 1] += 5.0
    with pytest.raises(ValueError, match=f'{field} is not symmetric'):
        replace(system, **{field: skew})


def test_three_dof_frequencies():
    """Paper, section 5.1: 7.0831, 19.8462, 28.6787 Hz, to the rounding of the print."""
    found = natural_modes(three_dof()).frequencies_hz
    assert found == pytest.approx([7.0831, 19.8462, 28.6787], abs=1.1e-4)
