"""Every effect of the generator: nested in its spacecraft, finite, never the same twice."""
from dataclasses import replace

from blindgen.cases.draw import draw_case, SMALL
from blindgen.effects import families, library, sensing  # noqa: F401  (declare the effects)
from blindgen.effects.base import EFFECTS, motion_rms
from blindgen.physics.functions import draw_curve, draw_response, draw_static, static
from blindgen.physics.record import simulate
from blindgen.physics.scenario import Scenario
from blindgen.physics.spacecraft import PUBLISHED
from blindgen.physics.spectrum import spectrum
import numpy as np
import pytest

LIBRARY = """excitation_colour harmonic_disturbance wheel_speed_sweep impulsive_events
nonstationary_excitation stiffness_scale array_asymmetry damping_scale hub_inertia added_mass
hinge_compliance hinge_freeplay hinge_friction cubic_stiffness stiffness_drift fuel_slosh
attitude_controller gyroscopic_coupling sensor_gain sensor_crosstalk sensor_misplacement
sensor_noise sensor_drift quantisation saturation sensor_bandwidth channel_delay clock_rate
timestamp_jitter dropped_samples""".split()
FAMILIES = """static_curve modulation random_filter extra_oscillator extra_input point_process
sample_corruption nonlinear_joint""".split()
NOMINAL = Scenario()
PLAIN = simulate(NOMINAL, 20, 5)[0]


def test_the_library_has_its_thirty_names_and_all_else_is_a_family():
    """The names are fixed, so that a label and a verdict mean the same."""
    assert sorted(name for name, e in EFFECTS.items() if e.library) == sorted(LIBRARY)
    assert sorted(name for name, e in EFFECTS.items() if not e.library) == sorted(FAMILIES)


@pytest.mark.parametrize('name', sorted(EFFECTS))
def test_weak_is_nominal_and_strong_is_not(name, rng):
    """At its smallest size an effect is nothing, far up it is not, and the record is finite."""
    effect = EFFECTS[name]
    variant = effect.draw(rng, PUBLISHED, 20.0)
    if name != 'sample_corruption':              # its size is a number of runs
        weak, index = simulate(effect.apply(NOMINAL, effect.size(variant, effect.low)), 20, 5)
        # 2 % of the rms of 2000 samples is d' below 1 for any effect
        assert len(index) == 2000 and np.std(weak - PLAIN) < 0.02 * np.std(PLAIN)
    strong, index = simulate(effect.apply(NOMINAL, effect.size(variant, effect.high / 10)), 20, 5)
    assert np.all(np.isfinite(strong))
    assert len(index) < 2000 or np.std(strong - PLAIN) > 1e-4 * np.std(PLAIN)


@pytest.mark.parametrize('seed', [2, 6])
def test_every_effect_fits_a_spacecraft_that_was_drawn(seed, rng):
    """Any array, any channel, any rate: the parameters name what the spacecraft has."""
    draft = draw_case(seed, SMALL)
    for effect in EFFECTS.values():
        if not effect.fits(draft.truth):
            continue
        v = effect.draw(rng, draft.truth, draft.duration_s)
        scenario = effect.apply(Scenario(draft.truth), effect.size(v, 3 * effect.low))
        assert np.all(np.isfinite(simulate(scenario, 1000 / draft.truth.rate_hz, 1)[0]))


def test_jitter_is_of_a_scan():
    """Its noise is as alike in two channels as their slopes: as predicted, so in a record."""
    jitter_s, f = 1e-3, np.linspace(0.02, 49.9, 20000)
    jittered = replace(NOMINAL, jitter_s=jitter_s)
    noise = simulate(jittered, 60, 3)[0] - simulate(NOMINAL, 60, 3)[0]
    plain, other = spectrum(NOMINAL, f)[0], spectrum(jittered, f)[0]
    lost = ((2 * np.pi * f * jitter_s) ** 2)[:, None, None] * plain
    predicted = (other - plain + lost)[1000].real
    rms = np.sqrt(np.diag(predicted))
    assert np.allclose(noise.std(axis=0), rms, rtol=0.05)
    assert np.allclose(np.corrcoef(noise.T), predicted / np.outer(rms, rms), atol=0.15)
    assert np.corrcoef(noise.T)[0, 1] < -0.3


@pytest.mark.parametrize('name', FAMILIES)
def test_a_family_never_draws_the_same_twice(name, rng):
    """Eight draws have eight different functions."""
    draws = [str(EFFECTS[name].draw(rng, PUBLISHED, 600.0)) for _ in range(8)]
    assert len(set(draws)) == 8


def test_a_static_curve_has_no_gain_and_unit_rms(rng):
    """Over a normal signal it is orthogonal to an offset and to a gain, so neither is in it."""
    z = np.random.default_rng(1).standard_normal(400_000)
    for _ in range(5):
        y = static(draw_static(rng), z)
        # clipping at three standard deviations takes some of the highest degrees away
        assert abs(np.mean(y)) < 0.05 and abs(np.mean(y * z)) < 0.12
        assert 0.6 < np.sqrt(np.mean(y**2)) < 1.3


def test_random_functions_of_time_and_of_frequency(rng):
    """A curve has an rms of about one; a response fades to one, and is real in time."""
    for _ in range(8):
        assert 0.5 < np.std(draw_curve(rng).at(np.linspace(0, 1, 5000))) < 2
        h = replace(draw_response(rng, 1.0, 20.0), depth=0.1)
        assert h.at(np.array([1e6]))[0] == pytest.approx(1.0, abs=1e-3)
        assert abs(h.at(np.array([0.0]))[0].imag) < 1e-12


def test_the_moment_that_hinges_are_scaled_by():
    """At the published spacecraft's root 0.2 N m: 15 % is plenty for a scale."""
    assert motion_rms(PUBLISHED, 0, 'root') == pytest.approx(0.21, rel=0.15)


def test_two_hinges_in_one_array_are_refused():
    """A second hinge would overwrite the first; the message says so."""
    once = EFFECTS['hinge_compliance'].apply(NOMINAL, {'array': 'E1', 'stiffness_n_m_rad': 1e6})
    with pytest.raises(ValueError, match='has a hinge already'):
        EFFECTS['hinge_compliance'].apply(once, {'array': 'E1', 'stiffness_n_m_rad': 1e6})
