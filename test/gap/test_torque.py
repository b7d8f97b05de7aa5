"""Disturbances of the input: detected with their sizes, and not where there are none."""
from dataclasses import replace

from gap_records import look
import numpy as np
import pytest
from ssi_ros.bootstrap.parametric_bootstrap import Floor
from ssi_ros.effects import parse_effect
from ssi_ros.gap.detectors import anomalies, detect_in_input
from ssi_ros.gap.detectors.amplitude_modulation import modulation_by_chance
from ssi_ros.gap.detectors.input_reconstruction import reconstruct, Reconstruction


LINE, CHIRP, IMPULSES, MODULATION = (
    'harmonic_disturbance', 'wheel_speed_sweep', 'impulsive_events', 'nonstationary_excitation')


def detected(name, reconstruction):
    """Return the detection of one effect, None where there is none."""
    return next(iter(detect_in_input(reconstruction, (name,))), None)


def off(found, true, name):
    """Return how far a number is from the true one; a phase is the same after a turn."""
    miss = found.parameters[name] - getattr(true, name)
    return abs(np.angle(np.exp(1j * miss))) if name == 'phase_rad' else abs(miss)


def input_of(*texts):
    return look(reconstruct, 300.0, texts)


@pytest.fixture(scope='module')
def quiet():
    return input_of()


def test_a_right_model_leaves_white_noise(quiet):
    """Unit power in every octave: 5 sd of a mean of exponential variables."""
    bins = quiet.first + np.arange(len(quiet.values))
    edges = [quiet.first, 300, 900, 2700, bins[-1]]
    for low, high in zip(edges, edges[1:]):
        power = np.abs(quiet.values[(bins >= low) & (bins < high)]) ** 2
        assert power.mean() == pytest.approx(1.0, abs=5 / np.sqrt(len(power)))
    assert quiet.series()[quiet.inside].std() == pytest.approx(1.0, abs=0.03)


def test_single_samples_count_where_they_were_recorded(quiet):
    """A gap of 2 s and two seconds on both sides are left out, one of 0.5 s is not."""
    missing = np.zeros(quiet.rows, bool)
    missing[10000:10200] = missing[20000:20050] = True
    kept = replace(quiet, missing=missing).recorded
    assert np.array_equal(np.setdiff1d(quiet.recorded, kept), np.arange(9800, 10400))
    assert np.array_equal(quiet.recorded, np.arange(quiet.rows)[quiet.inside])


@pytest.mark.parametrize('name', [LINE, IMPULSES, MODULATION, CHIRP])
def test_a_right_model_shows_nothing(name, quiet):
    """One fixed record: each test reports at 1 % only."""
    assert detected(name, quiet) is None


@pytest.mark.parametrize('text, exact', [
    ('harmonic_disturbance:frequency_hz=12.345,torque_n_m=0.12', 'frequency_hz'),
    ('wheel_speed_sweep:start_hz=4,end_hz=9,torque_n_m=0.12', 'start_hz'),
    ('impulsive_events:rate_per_min=6,impulse_n_m_s=0.1', 'impulse_n_m_s'),
    ('nonstationary_excitation:depth=0.3,period_s=50', 'period_s'),
    ('nonstationary_excitation:depth=0.06,period_s=40,phase_rad=2', 'period_s')])
def test_a_disturbance_is_found_with_its_numbers(text, exact):
    """Clear sizes: every number within five of its standard deviations."""
    true = parse_effect(text)
    sign = detected(true.name, input_of(text))
    assert sign.effect == true.name and sign.p_value < 1e-6
    for name, std in sign.stds.items():
        assert off(sign, true, name) < 5 * std
    # and that is precise: 10 % at most
    assert sign.stds[exact] < 0.1 * getattr(true, exact)


def test_the_frequency_of_a_line_is_in_the_true_time():
    """With a clock that is wrong by 800 ppm in the model a line keeps its own frequency."""
    clock, true = 'clock_rate:ppm=-800', 'harmonic_disturbance:frequency_hz=38.3,torque_n_m=0.6'
    seen = look(reconstruct, 300.0, [clock, true], known=(parse_effect(clock),))
    sign = detected(LINE, seen)
    assert off(sign, parse_effect(true), 'frequency_hz') < 5 * sign.stds['frequency_hz']
    assert sign.stds['frequency_hz'] < 800e-6 * 38.3 / 10


@pytest.mark.parametrize('text', [
    'harmonic_disturbance:frequency_hz=7.3,torque_n_m=3',
    'wheel_speed_sweep:start_hz=20,end_hz=2,torque_n_m=1',
    'nonstationary_excitation:depth=0.7,period_s=77,phase_rad=1'])
def test_a_large_disturbance_is_sized_as_exactly(text):
    """Hundreds of deviations: no grid and no power that the disturbance adds shows in numbers."""
    true = parse_effect(text)
    sign = detected(true.name, input_of(text))
    for name, std in sign.stds.items():
        assert off(sign, true, name) < 5 * std
    assert sign.stds[true.size] < 0.02 * getattr(true, true.size)


def test_impulses_are_no_modulation_and_a_modulation_no_impulses():
    """Each of the two leaves the other's test at rest."""
    assert detected(MODULATION, input_of(
        'impulsive_events:rate_per_min=6,impulse_n_m_s=0.1')) is None
    found = input_of('nonstationary_excitation:depth=0.5,period_s=50')
    assert detected(IMPULSES, found) is None


def test_impulses_that_hide_in_noise_and_ring_together_are_counted():
    """600 in 300 s, of which a seventh stands out."""
    true = parse_effect('impulsive_events:rate_per_min=120,impulse_n_m_s=0.03')
    found = detected(IMPULSES, input_of('impulsive_events:rate_per_min=120,impulse_n_m_s=0.03'))
    for name in ('rate_per_min', 'impulse_n_m_s'):
        # 17 +- 10 a minute of 0.047 +- 0.005, where what stands out is counted
        assert off(found, true, name) < 2.5 * found.stds[name]


def test_impulses_beside_a_modulation_keep_their_size():
    """The level is taken out about 1: the height is within three of its deviations."""
    both = input_of('nonstationary_excitation:depth=0.1,period_s=50',
                    'impulsive_events:rate_per_min=6,impulse_n_m_s=0.15')
    found = detected(IMPULSES, both)
    assert abs(found.parameters['impulse_n_m_s'] - 0.15) < 3 * found.stds['impulse_n_m_s']


def test_noise_that_motion_makes_follows_the_motion():
    """Its level is that of slow modes: no modulation; one of 5 % beside it is detected."""
    jitter = 'timestamp_jitter:rms_s=0.003'
    beside = 'nonstationary_excitation:depth=0.05,period_s=60'
    known = (parse_effect(jitter),)
    for seed in (1, 2, 3, 4):
        assert detected(MODULATION, look(reconstruct, 600.0, [jitter], seed, known)) is None
    sign = detected(MODULATION, look(reconstruct, 600.0, [jitter, beside], 3, known))
    for name, std in sign.stds.items():
        assert off(sign, parse_effect(beside), name) < 3 * std


def test_a_level_that_varies_by_chance_is_no_modulation():
    """As much of a slow sinusoid as simulated records of the candidate have is no detection."""
    sign = detected(MODULATION, input_of('nonstationary_excitation:depth=0.12,period_s=50'))
    own = modulation_by_chance(input_of(), 50.0)
    assert own.shape == (3,) and own.max() < 8          # of three, each exponential of mean 1
    quiet, loud = (floor_of(np.full(15, size)).with_modulation(sign)
                   for size in (1.0, sign.gain / 4))
    assert sign.p_value <= quiet.p_value < 1e-3 < 0.05 < loud.p_value
    assert floor_of(np.array([])).with_modulation(sign) is sign


def test_a_rate_below_1_hz_is_searched_too():
    """White noise of 4000 samples at 0.4 Hz, by every detector of the input: nothing is in it."""
    rng, rows, first = np.random.default_rng(4), 4000, 20
    count = rows // 2 - first
    noise = (rng.standard_normal((count, 3)) + 1j * rng.standard_normal((count, 3))) / np.sqrt(2)
    taper, ones = np.full(rows, rows ** -0.5), np.ones((count, 2))
    slow = Reconstruction(0.4, rows, first, noise[:, 0], ones[:, 0], taper, noise[:, 1:], ones,
                          np.abs(noise[:, 1]) ** 2, noise[:, 1:], 1.0, np.zeros(rows, bool),
                          noise[:, 1:], np.broadcast_to(np.eye(2), (count, 2, 2)),
                          np.zeros(count), noise[:, 0], ones[:, 0])
    assert detect_in_input(slow, (LINE, CHIRP, IMPULSES, MODULATION)) == ()
    assert anomalies(slow, ('a', 'b')) == ()


@pytest.mark.parametrize('in_gap', [0.0, 1.0])
def test_the_size_of_a_sine_does_not_depend_on_how_gaps_are_filled(in_gap):
    """A fifth of 4000 samples is missing; the sine, of amplitude 0.5, fills them too or not."""
    rng, rows, rate_hz, amplitude = np.random.default_rng(5), 4000, 10.0, 0.5
    taper, missing = np.full(rows, rows ** -0.5), np.zeros(rows, bool)
    missing[1000:1800] = True
    sine = amplitude * np.sin(2 * np.pi * 2.0 * np.arange(rows) / rate_hz)
    values = rng.standard_normal(rows) + np.where(missing, in_gap * sine, sine)
    spectrum, first = np.fft.rfft(taper * values)[1:-1], 1
    count = len(spectrum)
    one = Reconstruction(
        rate_hz, rows, first, spectrum, np.ones(count), taper, *[None] * 2, None, None, 1.0,
        missing, None, None, np.zeros(count), spectrum, np.ones(count))
    found = detect_in_input(one, (LINE,))[0]
    # 0.03 is its standard deviation, (2 / 3200)^0.5
    assert found.parameters['torque_n_m'] == pytest.approx(amplitude, abs=0.06)


def floor_of(modulation):
    """Return a floor by simulation of which only the modulation of the level counts."""
    return Floor(*[None] * 11, modulation, None)
