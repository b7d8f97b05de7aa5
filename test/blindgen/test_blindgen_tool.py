"""Six cases from scratch with the real tool, by its command line alone."""
from pathlib import Path
import sys

from blindgen.__main__ import main
from blindgen.campaign import answers_of, labels_of
from blindgen.seal import read_json
import pytest

COMMAND = Path(sys.executable).with_name('ssi_ros')
MODEL = Path(__file__).parent.parent.parent / 'config' / 'spacecraft.yaml'


@pytest.mark.skipif(not COMMAND.exists(), reason=f'{COMMAND} is not installed')
def test_six_cases_with_the_real_tool(tmp_path):
    """
    The tool reads the bags of another writer and answers in the schema that is scored.

    A minute of record and three candidates are too few to judge how well: no share is asserted.
    It runs on a Dask cluster of two workers.
    """
    folder = tmp_path / 'public'
    code = main(['campaign', '--cases', '6', '--duration', '60', '--nonce', 'real', '--commit',
                 '0' * 40, '--folder', str(folder), '--rounds', '0', '--tool',
                 f'{COMMAND} diagnose {{bag}} --model {MODEL} --no-pairs --effects '
                 'sensor_gain,stiffness_scale,harmonic_disturbance --json {json}'])
    assert code == 0
    answers = answers_of(folder)
    assert set(answers) == set(labels_of(folder)) and len(answers) == 6
    assert 'NO_ANSWER' not in {a.outcome for a in answers.values()}
    scores = read_json(folder / 'scores.json')
    assert scores['cases'] == 6 and scores['seconds']['total'] == 6
    assert (folder / 'curves.png').stat().st_size > 0
