"""Disturbances of the torque: found with their numbers, and not found where there are none."""
from gap_records import look
import numpy as np
import pytest
from ssi_ros.effects import parse_effect
from ssi_ros.gap.resimulate import Floor
from ssi_ros.gap.sweeps import sweep
from ssi_ros.gap.swings import swing, wander
from ssi_ros.gap.torque import line, pulses, reconstruct


def off(found, true, name):
    """Return how far a number is from the true one; a phase is the same after a turn."""
    miss = getattr(found, name) - getattr(true, name)
    return abs(np.angle(np.exp(1j * miss))) if name == 'phase_rad' else abs(miss)


def torque_of(*texts):
    return look(reconstruct, 300.0, texts)


@pytest.fixture(scope='module')
def quiet():
    return torque_of()


def test_a_right_model_leaves_white_noise(quiet):
    """Unit power in every octave: 5 sd of a mean of exponential variables."""
    bins = quiet.first + np.arange(len(quiet.values))
    edges = [quiet.first, 300, 900, 2700, bins[-1]]
    for low, high in zip(edges, edges[1:]):
        power = np.abs(quiet.values[(bins >= low) & (bins < high)]) ** 2
        assert power.mean() == pytest.approx(1.0, abs=5 / np.sqrt(len(power)))
    assert quiet.series()[quiet.inside].std() == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize('test', [line, pulses, swing, sweep])
def test_a_right_model_shows_nothing(test, quiet):
    """One fixed record: each test reports at 1 % only."""
    assert test(quiet) is None


@pytest.mark.parametrize('text, test, exact', [
    ('harmonic_disturbance:frequency_hz=12.345,torque_n_m=0.12', line, 'frequency_hz'),
    ('wheel_speed_sweep:start_hz=4,end_hz=9,torque_n_m=0.12', sweep, 'start_hz'),
    ('impulsive_events:rate_per_min=6,impulse_n_m_s=0.1', pulses, 'impulse_n_m_s'),
    ('nonstationary_excitation:depth=0.3,period_s=50', swing, 'period_s'),
    ('nonstationary_excitation:depth=0.06,period_s=40,phase_rad=2', swing, 'period_s')])
def test_a_disturbance_is_found_with_its_numbers(text, test, exact):
    """Clear sizes: every number within five of the standard deviations that are told."""
    true = parse_effect(text)
    sign = test(torque_of(text))
    assert sign.effect.name == true.name and sign.p_value < 1e-6
    for name, std in sign.stds.items():
        assert off(sign.effect, true, name) < 5 * std
    # and that is precise: 10 % at most
    assert sign.stds[exact] < 0.1 * getattr(true, exact)


def test_a_line_is_told_in_the_true_time():
    """With a clock that is wrong by 800 ppm in the model a line keeps its own frequency."""
    clock, true = 'clock_rate:ppm=-800', 'harmonic_disturbance:frequency_hz=38.3,torque_n_m=0.6'
    seen = look(reconstruct, 300.0, [clock, true], known=(parse_effect(clock),))
    sign = line(seen)
    assert off(sign.effect, parse_effect(true), 'frequency_hz') < 5 * sign.stds['frequency_hz']
    assert sign.stds['frequency_hz'] < 800e-6 * 38.3 / 10


@pytest.mark.parametrize('text, test', [
    ('harmonic_disturbance:frequency_hz=7.3,torque_n_m=3', line),
    ('wheel_speed_sweep:start_hz=20,end_hz=2,torque_n_m=1', sweep),
    ('nonstationary_excitation:depth=0.7,period_s=77,phase_rad=1', swing)])
def test_a_gross_disturbance_is_told_as_exactly(text, test):
    """Hundreds of deviations: no grid and no power that the disturbance adds shows in numbers."""
    true = parse_effect(text)
    sign = test(torque_of(text))
    for name, std in sign.stds.items():
        assert off(sign.effect, true, name) < 5 * std
    assert sign.stds[true.size] < 0.02 * getattr(true, true.size)


def test_pulses_are_no_swing_and_a_swing_no_pulses():
    """Each of the two leaves the other's test at rest."""
    assert swing(torque_of('impulsive_events:rate_per_min=6,impulse_n_m_s=0.1')) is None
    found = torque_of('nonstationary_excitation:depth=0.5,period_s=50')
    assert pulses(found, swing(found)) is None


def test_pulses_beside_a_swing_keep_their_size():
    """The level is taken out about 1: the height told is within three of its deviations."""
    torque = torque_of('nonstationary_excitation:depth=0.1,period_s=50',
                       'impulsive_events:rate_per_min=6,impulse_n_m_s=0.15')
    found = pulses(torque, swing(torque))
    assert abs(found.effect.impulse_n_m_s - 0.15) < 3 * found.stds['impulse_n_m_s']


def test_noise_that_motion_makes_wanders_with_it():
    """Its level is that of slow modes: no swing by itself, and one of 5 % beside it is told."""
    jitter = 'timestamp_jitter:rms_s=0.003'
    beside = 'nonstationary_excitation:depth=0.05,period_s=60'
    known = (parse_effect(jitter),)
    for seed in (1, 2, 3, 4):
        assert swing(look(reconstruct, 600.0, [jitter], seed, known)) is None
    sign = swing(look(reconstruct, 600.0, [jitter, beside], 3, known))
    for name, std in sign.stds.items():
        assert off(sign.effect, parse_effect(beside), name) < 3 * std


def test_a_level_that_wanders_is_no_swing():
    """As much of a slow sinusoid as the candidate's own records have by chance is no sign."""
    sign = swing(torque_of('nonstationary_excitation:depth=0.12,period_s=50'))
    own = wander(torque_of(), 50.0)
    assert own.shape == (3,) and own.max() < 8          # of three, each exponential of mean 1
    quiet, loud = (floor_of(np.full(15, size)).sign(sign) for size in (1.0, sign.look[0] / 4))
    assert sign.p_value <= quiet.p_value < 1e-3 < 0.05 < loud.p_value
    assert floor_of(np.array([])).sign(sign) is sign


def floor_of(wandering):
    """Return a floor by simulation of which only the wander of the level counts."""
    return Floor(*[None] * 11, wandering, None)
