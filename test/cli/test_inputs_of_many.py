"""Recorded inputs of a folder of bags, and on the page of one."""
import json

import pytest
from ssi_ros.cli.main import main
from ssi_ros.model import Channel, Input, modal_model, save_model

MODEL = modal_model([2.0, 5.0], 0.02, [[1.0, 0.6]], [[1.0], [0.7]], rate_hz=50.0,
                    drives=(Input('motor', 1.0),), sensors=(Channel('tip', noise_rms=0.02),))
MOTOR = '/input/motor:wrench.force.x'
WORDS = ['--effects', 'sensor_gain,mode_damping', '--no-pairs']


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder of a model and of two bags, one with a gain that only the input shows."""
    folder = tmp_path_factory.mktemp('bags')
    save_model(MODEL, folder / 'model.npz')
    gain = ['--effect', 'sensor_gain:channel=tip,scale=1.05']
    for name, more in (('plain', []), ('gain', gain)):
        assert main(['simulate', str(folder / 'bags' / name), '--model',
                     str(folder / 'model.npz'), '--duration-s', '240', '--record-input',
                     *more]) == 0
    return folder


@pytest.mark.slow
def test_every_bag_has_its_own_input(folder, tmp_path, capsys):
    """The gain is named in the bag that has it; another input is another run."""
    words = ['diagnose', '--many', str(folder / 'bags'), '--model', str(folder / 'model.npz'),
             *WORDS, '--workers', '1', '--json', str(tmp_path)]
    assert main([*words, '--input', MOTOR]) == 0
    found = {n: json.loads((tmp_path / f'{n}.json').read_text()) for n in ('plain', 'gain')}
    assert found['plain']['outcome'] == 'WITHIN_FLOOR'
    assert found['gain']['verdict']['effects'] == ['sensor_gain']
    assert main(words) == 2
    assert 'other inputs' in capsys.readouterr().err


def test_a_reference_predicts_nothing(folder, capsys):
    """One sentence, before any work."""
    assert main(['diagnose', '--many', str(folder / 'bags'), '--reference',
                 str(folder / 'bags' / 'plain'), '--input', MOTOR]) == 2
    assert '--input is predicted by a model' in capsys.readouterr().err


def test_the_page_shows_what_is_predicted(folder, tmp_path):
    """How much of the motion the input makes, and its spectrum."""
    page, text = tmp_path / 'page.html', tmp_path / 'page.md'
    assert main(['diagnose', str(folder / 'bags' / 'plain'), '--model',
                 str(folder / 'model.npz'), *WORDS, '--input', MOTOR, '--html', str(page),
                 '--markdown', str(text)]) == 0
    assert 'input_spectra' in page.read_text()
    found = text.read_text()
    assert 'The recorded input motor was used' in found and f'--input {MOTOR}' in found
    assert 'power explained by the input' in found
