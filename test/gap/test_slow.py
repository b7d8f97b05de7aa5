"""Slow noise of one channel, which no piece of a minute shows, and what is not it."""
from gap_records import look
import numpy as np
import pytest
from ssi_ros.effects import parse_effect
from ssi_ros.gap.detectors import detect_in_spectrum
from ssi_ros.gap.detectors.low_frequency_noise import noisiest


def slow(*fitted):
    return detect_in_spectrum(*fitted, ('sensor_drift',))


def signs_of(*texts):
    return look(slow, 600.0, texts)


@pytest.mark.parametrize('rms, time', [(3e-5, 2.0), (2e-5, 12.0)])
def test_slow_noise_is_found_with_its_numbers(rms, time):
    """A fifteenth of the sensors' noise; numbers within three of the deviations told."""
    (sign,) = signs_of(f'sensor_drift:channel=e2_a,rms_m_s2={rms},time_constant_s={time}')
    assert sign.parameters['channel'] == 'e2_a' and sign.p_value < 1e-6
    for name, true in (('rms_m_s2', rms), ('time_constant_s', time)):
        assert abs(sign.parameters[name] - true) < 3 * sign.stds[name]


@pytest.mark.parametrize('text', ['', 'attitude_controller:bandwidth_hz=0.02',
                                  'hub_inertia:scale=1.1', 'fuel_slosh:mass_kg=20,frequency_hz=1'])
def test_what_turns_the_whole_hub_is_no_slow_noise(text):
    """One fixed record each: reported at 1 % only."""
    assert signs_of(*[text] if text else []) == ()


def test_a_nutation_is_no_slow_noise():
    """Four records of wheels of 51.5 N m s: once the model has them, none is taken for noise."""
    text = 'gyroscopic_coupling:momentum_n_m_s=51.5'
    for seed in range(4):
        assert look(slow, 600.0, [text], seed, (parse_effect(text),)) == ()


def test_noise_is_of_the_channel_that_has_most_of_it():
    """Log likelihoods of a channel with noise of 0.2 Hz, and of one that it is predicted by."""
    own = np.array([[900.0, 1034.0]]), 973.0, [1.0], 'e1_a'
    other = np.array([[500.0, 566.0]]), 500.0, [1.0], 'e2_b'
    gains, _, channel = noisiest([other, own])
    assert channel == 'e1_a' and gains.max() == 61.0
