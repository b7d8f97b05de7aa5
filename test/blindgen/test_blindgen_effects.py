"""Every effect of the generator: nested in the nominal spacecraft, finite, predicted."""
from blindgen import record
from blindgen.beyond import FLEX_RMS_M
from blindgen.craft import assemble, propagators, state_matrices
from blindgen.detect import detectability, size_for
from blindgen.effects import EFFECTS, ROOT_MOMENT_RMS
from blindgen.record import simulate
from blindgen.scenario import PROCESS_RMS, Scenario, TORQUE_RMS
from blindgen.spectrum import GRID_BINS, GRID_HZ
import numpy as np
import pytest

LIBRARY = """excitation_colour harmonic_disturbance wheel_speed_sweep impulsive_events
nonstationary_excitation stiffness_scale array_asymmetry damping_scale hub_inertia added_mass
hinge_compliance hinge_freeplay hinge_friction cubic_stiffness stiffness_drift fuel_slosh
attitude_controller gyroscopic_coupling sensor_gain sensor_crosstalk sensor_misplacement
sensor_noise sensor_drift quantisation saturation sensor_bandwidth channel_delay clock_rate
timestamp_jitter dropped_samples""".split()
CHEAP = sorted(name for name, e in EFFECTS.items() if e.predict != 'simulated')
NOMINAL = Scenario()


@pytest.fixture
def short(monkeypatch):
    """Shorten the settling: these tests compare records, they need no stationarity."""
    monkeypatch.setattr(record, 'SETTLE_S', 10.0)
    monkeypatch.setattr(record, 'LEAD_S', 5.0)


def test_the_library_has_its_thirty_names_and_ten_are_outside():
    """The names are fixed, so that a label and a verdict mean the same."""
    assert [name for name, e in EFFECTS.items() if e.library] == LIBRARY
    assert sum(not e.library for e in EFFECTS.values()) == 10


@pytest.mark.parametrize('name', sorted(EFFECTS))
def test_weak_is_nominal_and_strong_is_not(short, name, rng):
    """At its smallest size an effect is not seen, far up it is, and the record stays finite."""
    effect = EFFECTS[name]
    variant = effect.draw(rng)
    nominal = simulate(NOMINAL, 20, 5)[0]
    weak, index = simulate(effect.apply(NOMINAL, effect.size(variant, effect.low)), 20, 5)
    # 2 % of the rms of 2000 samples is d' below 1 for any effect
    assert len(index) == 2000 and np.std(weak - nominal) < 0.02 * np.std(nominal)
    strong, index = simulate(effect.apply(NOMINAL, effect.size(variant, effect.high / 10)), 20, 5)
    assert np.all(np.isfinite(strong))
    assert len(index) < 2000 or np.std(strong - nominal) > 1e-4 * np.std(nominal)


@pytest.mark.parametrize('name', CHEAP)
def test_a_size_for_a_wanted_detectability(name, rng):
    """The size found has the d' asked for, within 5 %, or lies at a bound of the effect."""
    parameters, d = size_for(name, EFFECTS[name].draw(rng), 2.0, 600.0)
    assert d == pytest.approx(2.0, rel=0.05)
    assert detectability(name, parameters, 600.0) == pytest.approx(d, rel=1e-9)


def test_rails_are_sized_for_the_level_of_their_record():
    """3 dB more excitation asks for a limit 3 dB higher; 1 % is twice the bracket's width."""
    low, high = (size_for('saturation', {}, 4.0, 600.0, level)[0]['limit_m_s2']
                 for level in (1.0, 1.4125))
    assert high / low == pytest.approx(1.4125, rel=0.01)


def test_detectability_of_a_nonlinear_effect_grows_with_its_size():
    """Freeplay ten times as large is seen five times as well, at least."""
    effect = EFFECTS['hinge_freeplay']
    small, large = (detectability('hinge_freeplay', effect.size({'array': 'E1'}, m), 100.0)
                    for m in (1e-7, 1e-6))
    assert large > 5 * small > 0


def test_the_motions_that_sizes_are_scaled_by():
    """Root moment and flexing under the nominal loads, from the exact discrete spectrum."""
    sites = (('none', 0, {'at': 'hinge', 'values': ()}), ('none', 0, {'at': 1.0, 'values': ()}))
    craft = assemble(Scenario(hinge=(1e7, np.inf), local=sites))
    for k in range(3):
        craft.stiffness[k, k] += craft.mass[k, k] * (2 * np.pi * 1e-3)**2
    a, b, *_ = state_matrices(craft)
    e, p0, p1 = propagators(a, 0.01)
    poles, modes = np.linalg.eig(e)
    look = np.hstack([craft.directions[:, 1:].T, np.zeros((2, len(craft.mass)))])
    z = np.exp(2j * np.pi * GRID_HZ / 100)[:, None, None]
    g = ((look @ modes) / (z - poles)) @ np.linalg.solve(modes, (p0 + p1) @ b)
    loads = np.array([TORQUE_RMS, 0] + 20 * [PROCESS_RMS])**2
    power = np.average(np.abs(g)**2 @ loads, axis=0, weights=GRID_BINS)
    moment, flexing = np.sqrt(power) * [1e7, 1.0]
    # they only set the scale of gaps and slips: 15 % is plenty
    assert moment == pytest.approx(ROOT_MOMENT_RMS, rel=0.15)
    assert flexing == pytest.approx(FLEX_RMS_M, rel=0.15)


def test_two_hinges_in_one_array_are_refused():
    """A second hinge would overwrite the first; the message says so."""
    once = EFFECTS['hinge_compliance'].apply(NOMINAL, {'array': 'E1', 'stiffness_n_m_rad': 1e6})
    with pytest.raises(ValueError, match='has a hinge already'):
        EFFECTS['hinge_compliance'].apply(once, {'array': 'E1', 'stiffness_n_m_rad': 1e6})


def test_an_unknown_effect_is_refused():
    """The message lists what is known."""
    with pytest.raises(ValueError, match="'moon' is not known; known are added_mass"):
        detectability('moon', {}, 600.0)
