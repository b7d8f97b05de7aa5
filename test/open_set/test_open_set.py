"""The open-set test names what it found where, and is quiet beside records without effect."""
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.detectors import open_set
from ssi_ros.gap.detectors.input_reconstruction import reconstruct
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.whittle import Evidence
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame, spectra
from ssi_ros.model import load_spacecraft
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.open_set.amplitude import dependence_on_amplitude
from ssi_ros.open_set.families import beside, calibrated, FAMILIES, joined
from ssi_ros.open_set.products import of_channel, of_mode, slow_variation
from ssi_ros.open_set.spectra import modes_of, record_spectra

SECONDS = 300.0


@lru_cache(maxsize=None)
def beside_model(seed=1, effect=None):
    """Return model side, fit of the levels and samples of a record."""
    craft, settings = load_spacecraft(), DiagnosisSettings()
    effects = [parse_effect(effect)] if effect else ()
    samples = simulate_setup(inject(craft, effects, SECONDS), seed)
    frame = make_frame(len(samples.values), 100.0, settings)
    side = Simulator(craft, frame, SECONDS)
    return side, fit(side, Evidence(frame, spectra(samples, frame), frame.used)), samples


def findings(change=None, seed=1, effect=None):
    """Return the findings in a record whose values a function changes in place, by family."""
    side, fitted, samples = beside_model(seed, effect)
    values = samples.values.copy()
    if change is not None:
        change(values)
    samples = replace(samples, values=values)
    found = open_set(side, fitted, reconstruct(side, fitted, samples, DiagnosisSettings()),
                     samples.channels)
    return {d.basis: d for d in found}


def curve(values):
    """Bend the second channel by 1 % of its rms."""
    unit = values[:, 1] / values[:, 1].std()
    values[:, 1] += 0.01 * values[:, 1].std() * (unit ** 3 - 3 * unit)


def modulated(values):
    """Modulate the gain of the third channel by 1 %, at 0.05 Hz."""
    values[:, 2] *= 1 + 0.01 * np.sin(2 * np.pi * 0.05 * np.arange(len(values)) / 100)


def jumping(values):
    """Let the gain of the first channel jump by 1 % at 150 s."""
    values[15_000:, 0] *= 1.01


def spike(values):
    """Displace one sample of the fourth channel."""
    values[12_345, 3] += 0.1


CASES = {
    curve: ('curve', 'Channel e1_b follows a curve'),
    modulated: (
        'modulation of a gain', 'The gain of e2_a or the gain of e2_b is modulated at 0.05 Hz'),
    jumping: ('jump of a gain', 'The gain of e1_'),
    spike: ('spikes', 'Channel e2_b jumps at 123.45 s')}


@pytest.mark.parametrize('change', CASES)
def test_a_change_of_a_channel_is_named_with_its_place(change):
    """Each family names channel, time or frequency, and the joined p-value is small."""
    family, words = CASES[change]
    found = findings(change)
    assert found[family].p_value < 1e-5 and found[family].text.startswith(words)
    assert joined([d.p_value for d in found.values()]) < 1e-4


def test_a_frequency_that_goes_with_amplitude_is_named():
    """The pole of one mode is turned by 0.005 times its energy over the mean; no other is."""
    side, fitted, samples = beside_model()
    inputs = reconstruct(side, fitted, samples, DiagnosisSettings())
    system = side.setup(Candidate(), fitted.levels).system
    record = record_spectra(system, fitted.levels, inputs, samples.channels)
    mode = modes_of(record)[8]
    spectrum = np.zeros(record.rows, complex)
    spectrum[record.first + np.arange(len(record.recorded))[mode.bins]] = mode.state
    state = np.fft.ifft(spectrum)
    energy = np.abs(state) ** 2 / np.mean(np.abs(state) ** 2)
    change = np.fft.fft(1j * mode.pole * 5e-3 * (energy - 1) * state)[
        record.first:record.first + len(record.recorded)]
    gain = 1 / (np.exp(2j * np.pi * record.frequencies_hz / record.rate_hz) - mode.pole)
    recorded = record.recorded + (gain * change)[:, None] * mode.shape
    record = replace(record, recorded=recorded,
                     adjoint=np.einsum('kij,kj->ki', record.inverse, recorded))
    p_value, text = dependence_on_amplitude([
        of_mode(m, record.duration_s, 1.0) for m in modes_of(record)])
    assert p_value < 1e-6
    assert text == (f'the frequency of the mode at {mode.frequency_hz:.2f} Hz rises with its '
                    'amplitude')


def test_a_frequency_that_a_calibration_left_wrong_depends_on_no_amplitude():
    """All modes a deviation of such a record off: their scores follow their energy."""
    side, fitted, samples = beside_model()
    names, _ = declared(side.spacecraft)
    values = np.array([1.2e-3 * n.startswith('frequency') for n in names])
    side = side.but(spacecraft=replace(side.spacecraft, calibration=Calibration(names, values)))
    inputs = reconstruct(side, fitted, samples, DiagnosisSettings())
    system = side.setup(Candidate(), fitted.levels).system

    record = record_spectra(system, fitted.levels, inputs, samples.channels)
    modes = [of_mode(m, record.duration_s, 1.0) for m in modes_of(record)]
    assert dependence_on_amplitude(modes)[0] > 0.02
    assert slow_variation([p for m in modes for p in m.pair])[0] > 0.02


def test_a_family_that_is_asked_alone_finds_the_same():
    """What simulated records are asked for is what the record was asked for."""
    side, fitted, samples = beside_model()
    inputs = reconstruct(side, fitted, samples, DiagnosisSettings())
    every = {d.basis: d.p_value for d in open_set(side, fitted, inputs, samples.channels)}
    some = open_set(side, fitted, inputs, samples.channels, ('jump of a gain', 'distribution'))
    assert {d.basis: d.p_value for d in some} == {
        name: every[name] for name in ('jump of a gain', 'distribution')}
    assert open_set(side, fitted, inputs, samples.channels, ()) == ()


def test_records_without_effect_are_quiet():
    """Of 12 records none has a joined p-value below 1e-3, and most families exceed 0.1."""
    found = [[d.p_value for d in findings(seed=s).values()] for s in range(40, 52)]
    assert all(len(p) == len(FAMILIES) for p in found)
    assert min(joined(p) for p in found) > 1e-3
    assert np.mean(np.array(found) > 0.1) > 0.8


def test_products_have_the_variance_that_the_model_expects():
    """The mean of |F|^2 over its expectation is 1, of gains and of modes."""
    side, fitted, samples = beside_model()
    inputs = reconstruct(side, fitted, samples, DiagnosisSettings())
    system = side.setup(Candidate(), fitted.levels).system
    record = record_spectra(system, fitted.levels, inputs, samples.channels)
    for i in range(4):
        assert of_channel(record, i, 1.0).ratios.mean() == pytest.approx(1.0, abs=0.2)
    assert all(m.decays > 60 for m in modes_of(record))
    frequencies = [m.frequency_hz for m in modes_of(record)]
    assert frequencies == sorted(frequencies) and len(frequencies) > 10


def test_a_record_too_short_for_modes_still_has_all_families():
    """In 20 s no mode decays 60 times: those families say nothing, those of channels do."""
    craft, settings = load_spacecraft(), DiagnosisSettings()
    samples = simulate_setup(inject(craft, (), 20.0), 5)
    frame = make_frame(len(samples.values), 100.0, settings)
    side = Simulator(craft, frame, 20.0)
    fitted = fit(side, Evidence(frame, spectra(samples, frame), frame.used))
    found = {d.basis: d.p_value for d in open_set(
        side, fitted, reconstruct(side, fitted, samples, settings), samples.channels)}
    assert set(found) == set(FAMILIES) and found['amplitude'] == 1.0 > found['curve']


def test_p_values_join():
    """Of nothing the joint one is large; of one certain finding it is small; never 0."""
    count = len(FAMILIES)
    assert joined([0.5] * count) == 1.0
    assert joined([1e-9] + [0.5] * (count - 1)) == pytest.approx(2.5e-9 * count, rel=1e-3)
    assert 0.0 < joined([calibrated('curve', 0.0, 600.0)] + [0.5] * (count - 1)) < 1e-100
    usual = {f: [0.4] * 5 for f in FAMILIES}
    assert beside(1e-8, 'curve', usual) == pytest.approx(1e-8)
    assert beside(1e-8, 'curve', {**usual, 'curve': [1e-8] * 5}) > 0.01
    assert beside(1e-8, 'curve', {**usual, 'input': [1e-99] * 5}) == 1.0


def test_a_family_that_simulated_records_do_not_hold():
    """Of a model without geometry some detections alone have a family: no error, and no credit."""
    assert beside(1e-4, 'spikes', {}) == 1e-4
    # six simulated records as improbable as this one: it is what the model does
    assert beside(1e-4, 'spikes', {'spikes': [1e-4] * 6}) > 0.1
