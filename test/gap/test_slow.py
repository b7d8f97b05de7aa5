"""Slow noise of one channel, which no piece of a minute shows, and what is not it."""
from gap_records import look
import pytest
from ssi_ros.effects import parse_effect
from ssi_ros.gap.detectors import detect_in_spectrum


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
