"""What a record would show if an input of the model were recorded beside it."""
import json
from pathlib import Path

import numpy as np
import pytest
from ssi_ros.cli.main import main
from ssi_ros.model import Channel, Input, load_spacecraft, modal_model, save_model
from ssi_ros.planning.identifiability import identifiability

MODEL = modal_model([2.0, 5.0], 0.02, [[1.0, 0.6]], [[1.0, 0.1, 0.3], [0.7, 0.4, 0.1]],
                    rate_hz=50.0,
                    drives=(Input('motor', 1.0), Input('wind', 0.2), Input('idle', 0.0)),
                    sensors=(Channel('tip', noise_rms=0.02),))


@pytest.fixture(scope='module')
def both():
    """Return what is visible by effect without a recorded input, and with one."""
    return [{v.effect.name: v for v in identifiability(MODEL, 240.0, inputs=inputs)}
            for inputs in ((), ('motor',))]


def test_a_gain_of_one_channel_shows_by_the_input_alone(both):
    """Without the input it is a level, which is free; with it it is known from the answer."""
    plain, beside = both
    assert plain['sensor_gain'].detection < 1.0
    assert beside['sensor_gain'].detection > 10 * beside['sensor_gain'].without
    assert beside['sensor_gain'].detection > 3.0


def test_what_is_not_on_the_path_gains_nothing(both):
    """White noise of the sensor is as visible as before, to a tenth."""
    assert both[1]['sensor_noise'].detection == pytest.approx(
        both[1]['sensor_noise'].without, rel=0.3)
    assert all(np.isnan(v.without) for v in both[0].values())


@pytest.mark.slow
def test_one_torque_of_the_spacecraft_says_little_of_gains_and_slosh():
    """The noise on its modes is not recorded; a controller had 50 times, a slosh a third."""
    found = identifiability(load_spacecraft(), 240.0, inputs=('torque_x',))
    times = {v.effect.name: v.detection / v.without for v in found}
    assert all(0.95 < times[n] < 1.3 for n in (
        'sensor_gain', 'sensor_crosstalk', 'attitude_controller', 'fuel_slosh'))
    # a record that is known better shows no less, of large effects and of small ones
    assert min(t for t in times.values() if np.isfinite(t)) > 0.98


@pytest.mark.slow
def test_of_a_declared_gain_its_square_does_not_count():
    """One torque moves four channels alike, so that 0.6 % of one is large by its square alone."""
    model = load_spacecraft(Path(__file__).resolve().parents[2] / 'examples/torque.yaml')
    found = {v.effect.name: v for v in identifiability(model, 240.0)}
    assert found['sensor_gain'].exact > 30 > 10 * found['sensor_gain'].detection
    assert found['sensor_crosstalk'].detection < 20


def test_the_table_says_by_how_much(tmp_path, capsys):
    """With the strings that `diagnose --input` takes, and as JSON."""
    model, out = str(tmp_path / 'model.npz'), tmp_path / 'out.json'
    save_model(MODEL, model)
    words = ['identifiability', '--model', model, '--duration-s', '240', '--json', str(out)]
    assert main([*words, '--input', '/input/motor:wrench.force.x']) == 0
    text = capsys.readouterr().out
    heads = text.splitlines()[1].split()
    assert 'recorded: motor' in text and heads[1:4] == ["d'", 'without', 'times']
    found = json.loads(out.read_text())
    assert found['inputs'] == ['motor']
    gain = next(e for e in found['effects'] if e['name'] == 'sensor_gain')
    assert gain['detection'] > 10 * gain['without_inputs']


@pytest.mark.parametrize('given, said', [
    ('sail', "the model has no input 'sail'; it has motor, wind, idle"),
    ('idle', 'the input idle has no level in the model')])
def test_an_input_that_cannot_be_planned(given, said, tmp_path, capsys):
    """One sentence."""
    model = str(tmp_path / 'model.npz')
    save_model(MODEL, model)
    assert main(['identifiability', '--model', model, '--duration-s', '240',
                 '--input', given]) == 2
    assert said in capsys.readouterr().err
