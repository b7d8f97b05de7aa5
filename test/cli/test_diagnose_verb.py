"""The verb diagnose on bags: the loop from a bag to a corrected simulator and back."""
import json

from ssi_ros.cli.main import main

FEW = 'sensor_gain,array_asymmetry,sensor_noise'


def test_loop_closes(tmp_path, capsys):
    """The effect is found, written to a configuration, and the corrected model is quiet."""
    bag, fixed, out = (str(tmp_path / n) for n in ('bag', 'corrected.yaml', 'd.json'))
    assert main(['simulate', bag, '--duration-s', '120', '--effect',
                 'sensor_gain:channel=e1_b,scale=1.08']) == 0
    assert main(['diagnose', bag, '--effects', FEW, '--json', out, '--apply', fixed]) == 0
    text = capsys.readouterr().out
    assert 'EXPLAINED: sensor_gain: scale of channel e1_b is 1.0' in text
    assert json.loads((tmp_path / 'd.json').read_text())['verdict']['effects'] == ['sensor_gain']
    again = str(tmp_path / 'again')
    assert main(['simulate', again, '--config', fixed, '--duration-s', '120', '--seed', '5']) == 0
    assert main(['diagnose', bag, '--effects', FEW, '--model', fixed]) == 0
    assert main(['diagnose', again, '--effects', FEW, '--model', fixed]) == 0
    assert capsys.readouterr().out.count('WITHIN_FLOOR') == 2


def test_user_mistakes(tmp_path, capsys):
    """No bag, no such effect: one line each, exit code 2."""
    assert main(['diagnose', str(tmp_path / 'nothing')]) == 2
    bag = str(tmp_path / 'bag')
    assert main(['simulate', bag, '--duration-s', '20']) == 0
    assert main(['diagnose', bag, '--effects', 'sensor_gian']) == 2
    assert 'did you mean sensor_gain' in capsys.readouterr().err


def test_a_short_record_prints_no_empty_numbers(tmp_path, capsys):
    """Too little data: the reason alone, no gap of nan."""
    bag = str(tmp_path / 'bag')
    assert main(['simulate', bag, '--duration-s', '3']) == 0
    capsys.readouterr()
    assert main(['diagnose', bag, '--effects', FEW]) == 1
    said = capsys.readouterr().out
    assert said.startswith('TOO_LITTLE_DATA: ') and 'nan' not in said and 'unknown' not in said


def test_a_diagnosis_that_needs_more_memory_than_there_is_says_so(tmp_path, capsys, monkeypatch):
    """Templates go as the square of the channels: one line before the work, exit code 2."""
    bag = str(tmp_path / 'bag')
    assert main(['simulate', bag, '--duration-s', '200']) == 0
    monkeypatch.setattr('ssi_ros.cli._memory.available', lambda: 5e7)
    assert main(['diagnose', bag]) == 2
    said = capsys.readouterr().err
    assert 'on 4 channels' in said and 'needs about' in said and '--effects' in said
