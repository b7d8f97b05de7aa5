"""Nonlinear hinges and the gyroscopic moment against limits and an independent integrator."""
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from ssi_ros.model import assemble, simulate, Spacecraft
from ssi_ros.model.nonlinear import HingeLaw, KINDS, simulate_nonlinear
from ssi_ros.model.spacecraft import SolarArray


@pytest.fixture(scope='module')
def hinged():
    """Return a spacecraft with both roots on hinges of 20 kN m/rad."""
    return assemble(Spacecraft(arrays=(
        SolarArray(hinge_n_m_rad=2e4), SolarArray(name='E2', side=-1, hinge_n_m_rad=2e4))),
        explicit_hinges=True)


@pytest.mark.parametrize('kind', KINDS)
def test_size_zero_changes_nothing(hinged, kind):
    """The null law gives the linear record; 1e-11 is the rounding of ten times the steps."""
    laws = (HingeLaw('E1_hinge', kind, 0.0), HingeLaw('E2_hinge', kind, 0.0))
    values = simulate_nonlinear(hinged, 20.0, 1, laws=laws)[0].values
    linear = simulate(hinged, 20.0, 1).values
    assert np.abs(values - linear).max() < 1e-11 * np.abs(linear).max()


@pytest.mark.parametrize('kind, size', [('cubic', 2e8), ('freeplay', 2e-3)])
def test_against_an_adaptive_integrator(hinged, kind, size):
    """Free swing from 0.01 rad for 10 s: 1 % of the largest value at 4 kHz inside."""
    space = hinged.plant
    start = {'E1_hinge': 0.01}
    x0 = np.array([start.get(s, 0.0) for s in space.states])
    where = space.states.index('E1_hinge')
    act = hinged.inputs.index('E1_hinge')

    def torque(alpha):
        return -size * alpha ** 3 if kind == 'cubic' else 2e4 * np.clip(alpha, -size, size)
    t = np.arange(1000) / 100.0
    sol = solve_ivp(lambda _, x: space.a @ x + space.b[:, act] * torque(x[where]), (0, 10), x0,
                    t_eval=t, method='LSODA', rtol=1e-9, atol=1e-13)
    expected = space.c @ sol.y + space.d[:, [act]] * torque(sol.y[where])
    quiet = replace(hinged, chain=())
    values = simulate_nonlinear(quiet, 10.0, 1, laws=(HingeLaw('E1_hinge', kind, size),),
                                excitation=(), state0=start, substeps=40)[0].values
    linear = simulate_nonlinear(quiet, 10.0, 1, excitation=(), state0=start)[0].values
    # 0.5 s after the start, when what the residual mode rang with has died
    late = slice(50, None)
    scale = np.abs(expected.T[late]).max()
    assert np.abs(values[late] - expected.T[late]).max() < 0.01 * scale
    assert np.abs(linear[late] - expected.T[late]).max() > 0.1 * scale      # and it matters


def free_swing(system, friction, substeps=10):
    """Return 60 s of one channel after a start in bending, with friction in all hinges."""
    laws = tuple(HingeLaw(d, 'friction', friction) for d in system.dofs if d.endswith('_hinge'))
    return simulate_nonlinear(replace(system, chain=()), 60.0, 1, laws=laws, excitation=(),
                              state0={'E1_eta1': 0.05}, substeps=substeps)[0].values[:, 0]


def test_friction_takes_energy(hinged):
    """Coulomb friction of 0.2 N m leaves less than half of the swing after a minute."""
    assert free_swing(hinged, 0.2)[-500:].std() < 0.5 * free_swing(hinged, 0.0)[-500:].std()


def test_a_hinge_that_sticks_is_the_clamp(hinged):
    """With 1000 N m no hinge moves; the lowest mode is then the cantilever's to 0.1 %."""
    stuck, clamped = free_swing(hinged, 1e3, 40), free_swing(assemble(Spacecraft()), 0.0)
    # 5 %: the damping is that of the hinged modes, so the decay differs by a little
    assert stuck[-500:].std() == pytest.approx(clamped[-500:].std(), rel=0.05)

    def lowest(values):
        spectrum = np.abs(np.fft.rfft(values * np.hanning(6000), 1 << 18))
        return np.argmax(spectrum[:1 << 10])          # bins of 0.0004 Hz, below 0.4 Hz
    assert lowest(stuck) == pytest.approx(lowest(clamped), rel=1e-3)


def hinge_as_input(stiffness):
    """Return a spacecraft whose first array has a hinge among its modes and as an input."""
    return assemble(Spacecraft(arrays=(SolarArray(hinge_n_m_rad=stiffness),
                                       SolarArray(name='E2', side=-1))), hinge_inputs=True)


@pytest.mark.parametrize('stiffness', [1e3, 1e5, 1e7])
def test_modes_and_give_are_the_whole_hinge(stiffness):
    """A slow torque turns the hinge by 1/k, and a slow force on a clamped mode not at all."""
    system = hinge_as_input(stiffness)
    row = system.input[3:, system.inputs.index('E1_hinge')]
    answer = row @ np.linalg.solve(system.stiffness[3:, 3:], system.input[3:])
    assert answer[system.inputs.index('E1_hinge')] == pytest.approx(1 / stiffness, rel=1e-9)
    forces = [i for i, name in enumerate(system.inputs) if name.startswith('E1_force')]
    assert np.abs(answer[forces]).max() < 1e-9 / stiffness


def test_rubbing_that_never_slips_is_the_clamp():
    """Channels differ from the clamp's by a tenth of what the free hinge does: 5 % seen."""
    system = hinge_as_input(3.7e5)

    def record(of, *laws):
        return simulate_nonlinear(replace(of, chain=()), 100.0, 3, laws=laws, at_rest=True,
                                  substeps=40)[0].values
    clamp = record(assemble(Spacecraft(), hinge_inputs=True))
    stuck = record(system, HingeLaw('E1_hinge', 'friction', 1e3, 3.7e5)) - clamp
    assert np.all(stuck.std(axis=0) < 0.1 * (record(system) - clamp).std(axis=0))


def test_open_hinge_lets_the_array_go():
    """Play that is never crossed: the lowest mode of a hundredth of the stiffness, to 2 %."""
    loose, soft = hinge_as_input(1e5), hinge_as_input(1e3)

    def lowest(system, *laws):
        values = simulate_nonlinear(replace(system, chain=()), 600.0, 3, laws=laws,
                                    excitation=system.excitation[:1], at_rest=True)[0].values
        spectrum = np.abs(np.fft.rfft(values[:, 0] * np.hanning(len(values))))
        return np.argmax(spectrum[:240]) / 600.0        # below 0.4 Hz
    opened = lowest(loose, HingeLaw('E1_hinge', 'freeplay', 1.0, 0.99e5))
    assert opened == pytest.approx(lowest(soft), rel=0.02)
    assert opened != pytest.approx(lowest(loose), rel=0.2)


def test_gyroscopic_moment_turns_a_stiff_body_as_euler_says():
    """The free turn of the hub follows Euler's equations; arrays that flex leave 2 %."""
    craft = replace(Spacecraft(), noise_rms_m_s2=0.0)
    system = assemble(craft)
    rate0 = (0.01, 0.02, 0.03)
    _, rates = simulate_nonlinear(system, 100.0, 1, gyroscopic=True, at_rest=True, excitation=(),
                                  rate0_rad_s=rate0)
    j = system.mass[:3, :3]
    sol = solve_ivp(lambda _, w: -np.linalg.solve(j, np.cross(w, j @ w)), (0, 100), rate0,
                    t_eval=np.arange(10000) / 100.0, rtol=1e-10, atol=1e-14)
    assert np.abs(rates - sol.y.T).max() < 0.02 * np.abs(sol.y).max()
    momentum = np.linalg.norm(rates @ j, axis=1)
    assert momentum == pytest.approx(np.full(10000, momentum[0]), rel=0.01)
    straight = simulate_nonlinear(system, 10.0, 1, at_rest=True, excitation=(),
                                  rate0_rad_s=rate0)[1]
    assert straight == pytest.approx(np.tile(rate0, (1000, 1)), rel=1e-12)


@pytest.mark.parametrize('make, words', [
    (lambda s: HingeLaw('E1_hinge', 'rust', 1.0), 'rust'),
    (lambda s: HingeLaw('E1_hinge', 'cubic', -1.0), 'size=-1'),
    (lambda s: simulate_nonlinear(s, 1.0, 1, laws=(HingeLaw('E3_hinge', 'cubic', 1.0),)),
     'E3_hinge'),
    (lambda s: simulate_nonlinear(s, 1.0, 1, laws=(HingeLaw('E1_hinge', 'cubic', 1.0),) * 2),
     'two laws'),
    (lambda s: simulate_nonlinear(s, 1.0, 1, substeps=0), 'substeps=0'),
    (lambda s: simulate_nonlinear(s, 0.0, 1), 'duration_s=0'),
])
def test_bad_requests_are_refused(hinged, make, words):
    """The message names the value."""
    with pytest.raises(ValueError, match=words):
        make(hinged)
