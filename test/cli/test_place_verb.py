"""The verb `place`, as a user runs it."""
import re

import pytest
from ssi_ros.cli.main import main


def test_place_prints_gains(capsys):
    """The corners have gain 1, the swarm that starts from them at least as much."""
    assert main(['place', '--rounds', '1', '--modes', '2,4,8']) == 0
    gains = [float(g) for g in re.findall(r'gain ([\d.]+)', capsys.readouterr().out)]
    assert len(gains) == 3 and gains[0] == 1.0 and gains[2] >= max(gains) - 1e-4


@pytest.mark.parametrize('extra, words', [
    (['--modes', 'two'], "'two'"), (['--modes', '0'], 'numbered from 1'),
    (['--modes', '99'], 'mode 99'), (['--count', '0'], 'count=0')])
def test_mistakes_are_told(capsys, extra, words):
    """Exit code 2 and one line."""
    assert main(['place', *extra]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count('\n') == 1
