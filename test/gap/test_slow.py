"""Slow noise of one channel, which no piece of a minute shows, and what is not it."""
import pytest

from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.fit import fit, Simulator
from ssi_ros.gap.likelihood import Evidence
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.slow import slow_signs
from ssi_ros.gap.spectra import make_frame, spectra
from ssi_ros.model import load_spacecraft

SECONDS = 600.0
SETTINGS = DiagnosisSettings()


def signs_of(*texts, seed=3):
    spacecraft = load_spacecraft()
    samples = simulate_setup(inject(spacecraft, [parse_effect(t) for t in texts], SECONDS), seed)
    frame = make_frame(len(samples.values), 100.0, SETTINGS)
    simulator = Simulator(spacecraft, frame, SECONDS)
    evidence = Evidence(frame, spectra(samples, frame), tuple(range(frame.pieces)))
    return slow_signs(simulator, fit(simulator, evidence), samples, SETTINGS)


@pytest.mark.parametrize('rms, time', [(3e-5, 2.0), (2e-5, 12.0)])
def test_slow_noise_is_found_with_its_numbers(rms, time):
    """A fifteenth of the sensors' noise; numbers within three of the deviations told."""
    (sign,) = signs_of(f'sensor_drift:channel=e2_a,rms_m_s2={rms},time_constant_s={time}')
    assert sign.effect.channel == 'e2_a' and sign.p_value < 1e-6
    for name, true in (('rms_m_s2', rms), ('time_constant_s', time)):
        assert abs(getattr(sign.effect, name) - true) < 3 * sign.stds[name]


@pytest.mark.parametrize('text', ['', 'attitude_controller:bandwidth_hz=0.02',
                                  'hub_inertia:scale=1.1', 'fuel_slosh:mass_kg=20,frequency_hz=1'])
def test_what_turns_the_whole_hub_is_no_slow_noise(text):
    """One fixed record each: reported at 1 % only."""
    assert signs_of(*[text] if text else []) == ()
