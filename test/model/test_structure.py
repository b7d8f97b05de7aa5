"""The coupled model against the reference frequencies and the laws of mechanics."""
from dataclasses import replace

import numpy as np
import pytest
from ssi_ros.model import assemble, natural_modes, Spacecraft
from ssi_ros.model.errors import Calibration
from ssi_ros.model.plate import plate_modes
from ssi_ros.model.spacecraft import Hub, SolarArray
from ssi_ros.model.structure import add_point_mass, displacement_row

# First 20 frequencies [Hz] from a separate plate FEM of 16 x 4 Bogner-Fox-Schmit elements.
REFERENCE_HZ = [0.361, 0.693, 2.260, 2.437, 2.918, 2.982, 6.345, 6.445, 9.009, 9.033, 12.484,
                12.557, 15.828, 15.844, 20.707, 20.767, 23.768, 23.782, 30.978, 31.030]


def scaled_hub(factor):
    """Return the default spacecraft with the hub's inertia times a factor."""
    inertia = np.array(Hub().inertia_kg_m2) * factor
    return Spacecraft(hub=Hub(tuple(map(tuple, inertia.tolist()))))


def test_reference_frequencies():
    """0.2 % allows for the rounding of the reference and for its mesh (0.08 %)."""
    modes = natural_modes(assemble(Spacecraft()))
    assert modes.frequencies_hz == pytest.approx(REFERENCE_HZ, rel=2e-3)


def test_symmetry_gives_pairs():
    """Every pair holds one shape equal on both arrays and one opposite, to rounding."""
    shapes = natural_modes(assemble(Spacecraft())).shapes
    for k in range(0, 20, 2):
        parity = sorted(round((shapes[0, m] / shapes[2, m]).real, 6) for m in (k, k + 1))
        assert parity == [-1.0, 1.0]


def test_rigid_hub_gives_the_cantilever():
    """A hub of 1e9 times the inertia moves no frequency by more than 1e-8."""
    frequencies = natural_modes(assemble(scaled_hub(1e9))).frequencies_hz
    plate = plate_modes(Spacecraft().arrays[0].plate, 10).frequencies_hz
    assert frequencies == pytest.approx(np.repeat(plate, 2), rel=1e-8)


def test_inertia_holds_what_the_arrays_weigh():
    """J_x is the hub's plus two even bars from 1 m to 9 m: 600 + 2 (4.4) (9^3 - 1) / 3."""
    j = assemble(Spacecraft()).mass[:3, :3]
    assert j[0, 0] == pytest.approx(600 + 2 * 4.4 * (9 ** 3 - 1) / 3, rel=1e-12)
    assert j[1, 1] == pytest.approx(400 + 2 * 4.4 * 8 * 2 ** 2 / 12, rel=1e-12)


def test_rotation_matches_the_modal_sum():
    """H_x H_x^T tends to the arrays' inertia from below: ten modes hold 98 % of it."""
    system = assemble(Spacecraft())
    h = system.mass[:3, 3:]
    share = (h @ h.T)[0, 0] / (2 * 4.4 * (9 ** 3 - 1) / 3)
    assert 0.98 < share < 1.0


def test_point_mass_lowers_every_frequency():
    """Rayleigh: added mass raises no frequency, and 0.5 kg at the tip lowers the first by 1 %."""
    craft = Spacecraft()
    system = assemble(craft)
    row = displacement_row(craft, 'E1', 8.0, 0.0)
    heavy = natural_modes(add_point_mass(system, row, 0.5)).frequencies_hz
    plain = natural_modes(system).frequencies_hz
    assert np.all(heavy <= plain * (1 + 1e-12)) and heavy[0] < 0.99 * plain[0]
    same = add_point_mass(system, row, 0.0)
    assert np.array_equal(same.mass, system.mass)
    with pytest.raises(ValueError, match='mass_kg=-1'):
        add_point_mass(system, row, -1.0)


@pytest.mark.parametrize('stiffness, tolerance', [(3e3, 2e-3), (3e5, 2e-3)])
def test_explicit_hinge_equals_hinged_modes(stiffness, tolerance):
    """The clamped modes and an angle span nearly what the hinged modes do: 0.2 % on ten."""
    array = SolarArray(hinge_n_m_rad=stiffness)
    craft = Spacecraft(arrays=(array, replace(array, name='E2', side=-1)))
    inside = natural_modes(assemble(craft)).frequencies_hz
    outside = natural_modes(assemble(craft, explicit_hinges=True))
    assert outside.frequencies_hz[:18] == pytest.approx(inside[:18], rel=tolerance)


@pytest.mark.parametrize('kind, values', [('frequency', (0.03, -0.02)), ('shape', (0.05, -0.05))])
def test_errors_of_a_hinged_array_are_of_its_clamped_modes(kind, values):
    """Hinged modes have them as clamped modes beside an angle have, eq. (161a)."""
    names = {'frequency': ('frequency E1 1', 'frequency E1 2'),
             'shape': ('shape E1 1 e1_a', 'shape E1 2 e1_b')}[kind]
    craft = Spacecraft(arrays=(SolarArray(modes=3, hinge_n_m_rad=3e4),
                               SolarArray(modes=3, name='E2', side=-1)),
                       calibration=Calibration(names, values))
    inside, outside = assemble(craft), assemble(craft, explicit_hinges=True)
    modes = [natural_modes(s).frequencies_hz[:4] for s in (inside, outside)]
    at_hz = np.array([0.3, 1.0, 2.0])
    torque = [s.transfer(at_hz, 100.0)[:, :, 0] for s in (inside, outside)]
    # with errors of the hinged modes themselves 5e-3 and 0.03
    assert modes[0] == pytest.approx(modes[1], rel=1e-3)
    assert np.abs(torque[0] / torque[1] - 1).max() < 0.007


def test_stiff_hinge_is_the_clamp():
    """A hinge a million times stiffer than the array moves no frequency by 1e-4."""
    craft = Spacecraft(arrays=(SolarArray(hinge_n_m_rad=1e10),
                               SolarArray(name='E2', side=-1, hinge_n_m_rad=1e10)))
    plain = natural_modes(assemble(Spacecraft())).frequencies_hz
    assert natural_modes(assemble(craft)).frequencies_hz == pytest.approx(plain, rel=1e-4)


def test_stored_momentum_couples_the_axes():
    """With momentum along z_b the linear term is theta' x h: skew, and it does no work."""
    craft = Spacecraft(momentum_n_m_s=(0.0, 0.0, 50.0))
    damping = assemble(craft).damping[:3, :3]
    assert np.array_equal(damping, -damping.T)
    rate = np.array([0.3, -0.2, 0.1])
    assert damping @ rate == pytest.approx(np.cross(rate, [0.0, 0.0, 50.0]))
    # The nutation of the whole body is a mode more, at h / sqrt(J_x J_y) if it were rigid.
    nutation = natural_modes(assemble(craft)).frequencies_hz[0]
    j = assemble(craft).mass
    rigid = 50.0 / np.sqrt(j[0, 0] * j[1, 1]) / (2 * np.pi)
    assert nutation == pytest.approx(rigid, rel=0.01)    # the arrays follow almost rigidly


def test_mesh_too_coarse_is_refused():
    """The message says how many modes the mesh carries."""
    with pytest.raises(ValueError, match='modes=25 is too many.*carries 20'):
        assemble(Spacecraft(arrays=(SolarArray(modes=25),), sensors=Spacecraft().sensors[:2]))
