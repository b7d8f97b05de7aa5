"""Each law holds one effect against a number that does not come from the same lines of code."""
from dataclasses import replace

import numpy as np
import pytest

from ssi_ros.effects import (
    inject, load_configuration, parse_effect, save_configuration, simulate_setup)
from ssi_ros.model import assemble, load_spacecraft, natural_modes


@pytest.fixture(scope='module')
def spacecraft():
    return load_spacecraft()


def setup_of(spacecraft, *texts, duration_s=30.0):
    return inject(spacecraft, [parse_effect(t) for t in texts], duration_s)


def silent(spacecraft):
    """Return a spacecraft that nothing random drives or disturbs."""
    return replace(spacecraft, noise_rms_m_s2=0.0, excitation=replace(
        spacecraft.excitation, torque_rms_n_m=(0.0, 0.0, 0.0), process_noise_rms=0.0))


def frequencies(spacecraft, *texts):
    return natural_modes(setup_of(spacecraft, *texts).system).frequencies_hz


def test_stiffness_scales_all_frequencies_by_the_root(spacecraft):
    """M stays and K scales, so every frequency follows sqrt(D)."""
    ratio = frequencies(spacecraft, 'stiffness_scale:scale=1.21') / frequencies(spacecraft)
    # 1e-6: exact without damping, which enters squared at 0.5 %
    np.testing.assert_allclose(ratio, 1.1, rtol=1e-6)


def test_scaled_array_equals_reassembly(spacecraft):
    """The shortcut of eq. (81) gives the matrices of a plate of another D."""
    arrays = tuple(replace(a, plate=replace(a.plate, stiffness_n_m=a.plate.stiffness_n_m * 0.9))
                   if a.name == 'E1' else a for a in spacecraft.arrays)
    again = natural_modes(assemble(replace(spacecraft, arrays=arrays))).frequencies_hz
    # 1e-7: only round-off of two eigenvalue problems is left; a mesh's lowest of 320 loses most
    np.testing.assert_allclose(frequencies(spacecraft, 'array_asymmetry:array=E1,scale=0.9'),
                               again, rtol=1e-7)


def test_stiff_hinge_is_a_clamp(spacecraft):
    """A hinge that hardly gives moves the frequencies hardly: k = 1e9 against the clamp."""
    soft = frequencies(spacecraft, 'hinge_compliance:array=E1,stiffness_n_m_rad=1e9')
    # 1e-4: relative give of the root is of order D width / (length k) = 1e-6 a mode number^2
    np.testing.assert_allclose(soft, frequencies(spacecraft), rtol=1e-4)
    assert frequencies(spacecraft, 'hinge_compliance:array=E1,stiffness_n_m_rad=2000')[0] < 0.35


def test_controller_on_the_rigid_body(spacecraft):
    """A slow loop moves the whole body as a rigid one: its frequency is the bandwidth."""
    modes = natural_modes(setup_of(
        spacecraft, 'attitude_controller:bandwidth_hz=0.01,damping_ratio=0.3').system)
    slow = modes.frequencies_hz < 0.02
    # 1e-3: (0.01 / 0.36)^2, the give of the first flexible mode
    np.testing.assert_allclose(modes.frequencies_hz[slow], 0.01, rtol=1e-3)
    np.testing.assert_allclose(modes.damping_ratios[slow], 0.3, rtol=5e-3)


def test_slosh_frequency_on_a_heavy_hub(spacecraft):
    """A small mass hardly moves the hub, so it swings at the frequency given."""
    with_mass = frequencies(
        spacecraft, 'fuel_slosh:mass_kg=0.01,frequency_hz=0.5,damping_ratio=0.01,arm_m=0.5')
    # 1e-5: mass ratio 0.01 x 0.25 / 1000
    assert np.min(np.abs(with_mass - 0.5)) < 0.5 * 1e-5


def test_delay_shifts_a_sine(spacecraft):
    """A slow sine read 20 ms late is the sine of 20 ms before."""
    quiet = silent(spacecraft)
    sine = 'harmonic_disturbance:frequency_hz=1,torque_n_m=1'
    plain = simulate_setup(setup_of(quiet, sine), 1).values
    late = simulate_setup(setup_of(quiet, sine, 'channel_delay:channel=e1_a,delay_s=0.02'), 1)
    # Both start in the steady state of the sine, a whole number of its periods apart.
    # 2e-3 of the rms: the ends of the record, which a band-limited delay feels
    error = late.values[4:-4, 0] - plain[2:-6, 0]
    assert np.sqrt(np.mean(error ** 2)) < 2e-3 * plain.std()


def test_clock_stretches_a_sine(spacecraft):
    """At 10000 ppm a 5 Hz torque appears at 5.05 Hz."""
    samples = simulate_setup(setup_of(
        spacecraft, 'harmonic_disturbance:frequency_hz=5,torque_n_m=9', 'clock_rate:ppm=10000',
        duration_s=100.0), 1)
    spectrum = np.abs(np.fft.rfft(samples.values[:, 0] * np.hanning(len(samples.values))))
    peak = np.argmax(spectrum) / 100.0
    assert abs(peak - 5.05) <= 0.01      # one bin


@pytest.mark.parametrize('frequency_hz', [12.0, 33.0])
def test_a_sine_is_the_torque_of_a_machine_not_one_held_over_samples(spacecraft, frequency_hz):
    """At ten times the rate the channels show the same."""
    quiet = silent(spacecraft)
    rms = [np.std(simulate_setup(setup_of(
        replace(quiet, rate_hz=rate_hz),
        f'harmonic_disturbance:frequency_hz={frequency_hz},torque_n_m=1'), 1).values, axis=0)
        for rate_hz in (100.0, 1000.0)]
    # held over samples the first is 2 and 19 % lower
    np.testing.assert_allclose(*rms, rtol=3e-3)


def test_jitter_noise_follows_the_slope(spacecraft):
    """First order: the error of jitter is slope x rms, and white."""
    from ssi_ros.model.sensors import Noise
    setup = setup_of(replace(spacecraft, noise_rms_m_s2=0.0), 'timestamp_jitter:rms_s=1e-4',
                     duration_s=60.0)
    still = replace(setup, jitter_rms_s=0.0, delays_s=(0.0, 0.0, 0.0, 1e-12))
    assert isinstance(setup.system.chain[0], Noise)
    plain = simulate_setup(still, 2).values[:, 0]
    error = simulate_setup(setup, 2).values[:, 0] - plain
    f = np.fft.rfftfreq(len(plain), 0.01)
    slope = np.fft.irfft(2j * np.pi * f * np.fft.rfft(plain), len(plain))
    # 5 %: 6000 samples know an rms to 1 %, the rest is the second order at 50 Hz
    assert np.sqrt(np.mean(error ** 2)) == pytest.approx(1e-4 * slope.std(), rel=0.05)


def test_slight_drift_is_the_linear_simulator(spacecraft):
    """Stepping the matrices every half second carries the state over without loss."""
    drifting = simulate_setup(setup_of(spacecraft, 'stiffness_drift:change=1e-9'), 4, at_rest=True)
    plain = simulate_setup(setup_of(spacecraft), 4, at_rest=True).values
    # 1e-5: 1e-9 of the stiffness moves a phase by 1e-9 / 4 x 2 pi x 31 Hz x 30 s = 1.5e-6
    assert np.abs(drifting.values - plain).max() < 1e-5 * plain.std()


def test_several_at_once_and_saved(spacecraft, tmp_path):
    """A configuration with two effects comes back and gives the same record."""
    effects = [parse_effect('sensor_gain:channel=e2_a,scale=1.1'),
               parse_effect('array_asymmetry:array=E2,scale=0.97')]
    save_configuration(spacecraft, effects, tmp_path / 'corrected.yaml')
    again, loaded = load_configuration(tmp_path / 'corrected.yaml')
    assert loaded == tuple(effects) and again == spacecraft
    both = simulate_setup(inject(again, loaded, 5.0), 1).values
    swapped = simulate_setup(inject(spacecraft, effects[::-1], 5.0), 1).values
    # round-off of one product more: the two effects act at different places
    np.testing.assert_allclose(both, swapped, rtol=1e-12, atol=1e-15)
