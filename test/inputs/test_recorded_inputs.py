"""Recorded inputs: predicted, never alarmed about themselves, and what they show is named."""
from dataclasses import replace

import numpy as np
import pytest
from ssi_ros.cli._inputs import simulated_inputs
from ssi_ros.cli.main import main
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.goodness_of_fit import _from_white, floor_of_band
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import frame_of
from ssi_ros.inputs.beside import beside_inputs
from ssi_ros.inputs.prediction import Played
from ssi_ros.inputs.rows import in_rows
from ssi_ros.model import assemble, Channel, Input, modal_model, save_model
from ssi_ros.records import Samples

SECONDS, SOME = 240.0, ('sensor_gain', 'channel_delay', 'mode_damping', 'mode_frequency')
ONE = modal_model([2.0, 5.0], 0.02, [[1.0, 0.6]], [[1.0], [0.7]], rate_hz=50.0,
                  drives=(Input('motor', 1.0),), sensors=(Channel('tip', noise_rms=0.02),))
TWO = modal_model([2.0, 5.0], 0.02, [[1.0, 0.6], [0.8, -0.9]], [[1.0, 0.3], [0.7, -0.5]],
                  rate_hz=50.0, drives=(Input('motor', 1.0), Input('wind', 0.1)),
                  sensors=(Channel('tip', noise_rms=0.02), Channel('elbow', noise_rms=0.02)))


def recorded(model, effects=(), seed=1, seconds=SECONDS):
    """Return Samples of a model, and of its motor."""
    setup = inject(model, [parse_effect(e) for e in effects], seconds)
    samples = simulate_setup(setup, seed)
    inputs = simulated_inputs(setup, assemble(model).excitation, samples, seed)
    return samples, Samples(inputs.values[:, :1], inputs.rate_hz, ('motor',), inputs.start_ns)


def driven(model, motor, seed=1):
    """Return Samples of a model whose motor follows a series, and of the motor."""
    setup = inject(replace(model, drives=(replace(model.drives[0], level=0.0), *model.drives[1:])),
                   (), len(motor) / model.rate_hz)
    setup = replace(setup, system=replace(setup.system, excitation=setup.system.excitation + (
        Played(('motor',), motor[:, None]),)))
    return simulate_setup(setup, seed), Samples(motor[:, None], model.rate_hz, ('motor',))


def compare(model, samples, inputs):
    """Return the comparison of a model and its input with a record."""
    settings = model.cut(DiagnosisSettings())
    return ModelNominal(model, (), inputs).compare(samples, settings, SOME, lambda share: None)


def test_a_gain_that_is_silent_without_the_input(tmp_path, capsys):
    """One channel of unknown level: its gain shows in nothing but its answer to the input."""
    model, bag = str(tmp_path / 'model.npz'), str(tmp_path / 'bag')
    save_model(ONE, model)
    assert main(['simulate', bag, '--model', model, '--duration-s', '240', '--record-input',
                 '--effect', 'sensor_gain:channel=tip,scale=1.02']) == 0
    assert '--input /input/motor:wrench.force.x' in capsys.readouterr().out
    words = ['diagnose', bag, '--model', model, '--no-pairs', '--effects', ','.join(SOME)]
    assert main(words) == 0
    assert 'WITHIN_FLOOR' in capsys.readouterr().out
    assert main([*words, '--input', '/input/motor:wrench.force.x']) == 0
    assert 'EXPLAINED: sensor_gain: scale of channel tip is 1.0' in capsys.readouterr().out


@pytest.mark.parametrize('words, said', [
    (['/nowhere:data'], '/nowhere'), (['/input/motor:wrench.mass'], 'has no member'),
    (['/input/motor'], 'needs a field'), (['motor'], 'must be /topic or /topic:field'),
    (['/input/motor:wrench.force.x=sail'], "no input 'sail'; it has motor, wind"),
    (['/input/motor:wrench.force.x', '/input/wind:wrench.force.x=motor'], 'two topics are given'),
    (['/accelerometer/tip:accel.linear.z'], 'any of the inputs motor, wind'),
    (['/input/motor:wrench.force.y'], 'is 0 throughout')])
def test_mistakes_are_answered_in_one_sentence(words, said, bag_of_two, capsys):
    """Of topic, field, name and values."""
    model, bag = bag_of_two
    more = [w for text in words for w in ('--input', text)]
    assert main(['diagnose', bag, '--model', model, *more]) == 2
    err = capsys.readouterr().err
    assert said in err and 'Traceback' not in err


@pytest.fixture(scope='module')
def bag_of_two(tmp_path_factory):
    """Return a model of two inputs and a bag of it."""
    folder = tmp_path_factory.mktemp('two')
    model, bag = str(folder / 'model.npz'), str(folder / 'bag')
    save_model(TWO, model)
    assert main(['simulate', bag, '--model', model, '--duration-s', '120', '--record-input']) == 0
    return model, bag


@pytest.mark.parametrize('kind', ['steps', 'multisine', 'bursts'])
def test_nothing_is_said_of_the_input_itself(kind):
    """Whatever it does: its block of the whitened record is 1, and the model explains the rest."""
    rng, n = np.random.default_rng(3), round(SECONDS * 50.0)
    t = np.arange(n) / 50.0
    motor = {'steps': np.repeat(rng.standard_normal(n // 100 + 1), 100)[:n],
             'multisine': sum(np.cos(2 * np.pi * f * t + p) for f, p in zip(
                 np.arange(1, 40) * 0.5, rng.uniform(0, 6, 39))),
             'bursts': 3 * rng.standard_normal(n) * (np.sin(2 * np.pi * t / 40) > 0.7)}[kind]
    samples, inputs = driven(TWO, motor)
    comparison = compare(TWO, samples, inputs)
    white = comparison.goodness_of_fit(comparison.null).whitened
    # the spectrum of the input is the mean of its own periodograms, or more where it has none
    assert white[:, 0, 0].real.max() < 1 + 1e-9
    assert np.median(white[:, 0, 0].real) > 0.99
    assert comparison.residual(comparison.null).p_value > 0.01
    assert not comparison.mismatch


def test_known_channels_have_no_gap():
    """Mean and deviation of D with a fixed first channel, by 4000 Wishart matrices; to 4 sd."""
    rng, n, d = np.random.default_rng(5), 12, 3
    z = rng.standard_normal((4000, n, d, 2)) @ [1, 1j] / np.sqrt(2)
    z[:, :, 0] = np.linspace(0.1, 3.0, n)           # given, whatever it is
    found = _from_white(np.einsum('rni,rnj->rij', z, z.conj()) / n, 1)
    mean, std = floor_of_band(n, d, known=1)
    assert found.mean() == pytest.approx(mean, abs=4 * std / np.sqrt(4000))
    assert found.std() == pytest.approx(std, rel=0.06)


def test_expected_cross_spectra_are_those_of_records():
    """Inputs and residuals of a model with effects, to the scatter of 40 records."""
    effects = 'sensor_gain:channel=tip,scale=1.1', 'mode_frequency:mode=1,scale=1.01', (
        'channel_delay:channel=elbow,delay_s=0.001')
    ratios = []
    for seed in range(40):
        samples, inputs = recorded(TWO, effects, seed, 80.0)
        settings = DiagnosisSettings(segment_s=20.0, least_segments=4)
        side = Simulator(TWO, frame_of(samples, settings), 80.0)
        side, rest, _ = beside_inputs(side, samples, np.full(samples.values.shape, np.nan), inputs)
        expected = side.expected(Candidate(tuple(map(parse_effect, effects)))).at_nominal[0]
        inverse = np.linalg.inv(np.linalg.cholesky(expected))
        mean = side.evidence(rest).mean[0]
        ratios.append((inverse @ mean @ inverse.conj().swapaxes(1, 2)).mean(axis=0))
    # 4 segments of 960 bins a record, tapered: a mean of one scatters by 0.02 a record
    assert np.abs(np.mean(ratios, axis=0) - np.eye(3)).max() < 0.03


def test_rows_of_an_input():
    """Held from a message to the next: exact on the grid, a mean between, NaN in a gap."""
    record = Samples(np.zeros((100, 1)), 50.0, ('y',), 10 ** 18)
    values, ticks = np.random.default_rng(1).standard_normal(100), record.stamps_ns()
    assert np.allclose(in_rows(ticks, values, record), values, atol=1e-6)
    later = in_rows(ticks + 10_000_000, values, record)         # by half a row
    assert np.isnan(later[0]) and np.allclose(later[1:], (values[1:] + values[:-1]) / 2, atol=1e-6)
    slow = in_rows(ticks[::4], values[::4], record)
    assert np.allclose(slow[:96], np.repeat(values[::4], 4)[:96], atol=1e-6)
    gone = np.delete(np.arange(100), [50, 51, 52])
    assert list(np.flatnonzero(np.isnan(in_rows(ticks[gone], values[gone], record)))) == [
        50, 51, 52]
    with pytest.raises(ValueError, match='do not overlap'):
        in_rows(ticks + 10 ** 12, values, record)


def test_missing_rows_of_an_input_are_filled():
    """One in a hundred, and a gap of half a second; too many are refused."""
    samples, inputs = recorded(TWO)
    values = inputs.values.copy()
    values[np.random.default_rng(2).random(len(values)) < 0.01] = np.nan
    values[6000:6025] = np.nan
    comparison = compare(TWO, samples, replace(inputs, values=values))
    assert comparison.residual(comparison.null).p_value > 0.01
    values[:3000] = np.nan
    with pytest.raises(ValueError, match='motor lacks .* of the rows'):
        compare(TWO, samples, replace(inputs, values=values))


def test_a_wrong_sign_is_a_mistake_of_the_input():
    """Not an effect of the structure."""
    samples, inputs = recorded(TWO)
    found = diagnose(ModelNominal(TWO, (), replace(inputs, values=-inputs.values)), samples,
                     effects=SOME, pairs=False)
    assert found.outcome == 'UNEXPLAINED' and 'motor has a wrong sign' in found.reason
