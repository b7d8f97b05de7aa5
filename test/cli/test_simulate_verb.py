"""The verb `simulate`, as a user runs it."""
import numpy as np
import pytest
from ssi_ros.bag import Channel, read_channels
from ssi_ros.cli.main import main
from ssi_ros.model import assemble, load_spacecraft, simulate

TOPICS = [f'/accelerometer/{name}' for name in ('e1_a', 'e1_b', 'e2_a', 'e2_b')]


def test_the_bag_holds_the_samples(tmp_path):
    """What `simulate` computes for the seed is in the bag, bit for bit, on the same stamps."""
    assert main(['simulate', str(tmp_path / 'bag'), '--duration-s', '20', '--seed', '5',
                 '--excitation', 'torque', '--start-s', '100']) == 0
    system = assemble(load_spacecraft())
    expected = simulate(system, 20.0, 5, excitation=system.excitation[:1],
                        start_ns=100 * 10 ** 9)
    recording = read_channels(tmp_path / 'bag', [Channel(t) for t in TOPICS])
    for i in range(4):
        assert np.array_equal(recording.values[i], expected.values[:, i])
        assert np.array_equal(recording.stamps_ns[i], expected.stamps_ns())


@pytest.mark.parametrize('extra, words', [
    (['--rate-hz', '40'], '8.970 Hz'), (['--duration-s', '0'], 'duration_s=0'),
    (['--seed', '-1'], 'seed=-1'), (['--start-s', '-5'], 'start_s=-5'),
    (['--config', '/no/such/file'], 'does not exist')])
def test_mistakes_are_told(tmp_path, capsys, extra, words):
    """Exit code 2, one line, and no bag is left behind."""
    assert main(['simulate', str(tmp_path / 'bag'), '--duration-s', '5', *extra]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count('\n') == 1
    assert not (tmp_path / 'bag').exists()


def test_a_bag_is_not_overwritten(tmp_path, capsys):
    """An existing folder stays as it is."""
    (tmp_path / 'bag').mkdir()
    assert main(['simulate', str(tmp_path / 'bag'), '--duration-s', '5']) == 2
    assert 'exists' in capsys.readouterr().err
