"""A small case with the real tool, by its command line alone."""
from pathlib import Path
import sys

from blindgen.__main__ import main
from blindgen.cases.draw import SMALL
from blindgen.cases.make import write_case
from blindgen.proof.seal import read_json, write_json
from blindgen.run.campaign import Run, run
import pytest

COMMAND = Path(sys.executable).with_name('ssi_ros')
# what is declared uncertain is left out, so that a tool without `calibrate` reads the model too
PLAIN = ('import sys, yaml; model = yaml.safe_load(open(sys.argv[1])); '
         'model.pop("uncertainty"); yaml.safe_dump(model, open(sys.argv[2], "w"))')


@pytest.mark.skipif(not COMMAND.exists(), reason=f'{COMMAND} is not installed')
def test_the_real_tool_reads_what_is_written_and_answers(tmp_path):
    """
    The tool reads bags of another writer with spacecraft of any shape, and answers in the schema.

    A minute of record and two candidates are too few to judge how well: no share is asserted. Of
    two channels and one healthy recording, so that it is soon made.
    """
    folder = tmp_path / 'public'
    gain = {'name': 'sensor_gain', 'parameters': {'channel': 'e1_a', 'scale': 1.2}}
    name, hashed = write_case(folder, 'case_a', {'kind': 'single', 'effects': [gain], 'seed': 2},
                              SMALL)
    write_json(folder / 'commitment.json', {'cases': {name: hashed}})
    trouble = run(folder, Run((f"{sys.executable} -c '{PLAIN}' {{model}} {{calibrated}}",
                               f'{COMMAND} diagnose {{bag}} --model {{calibrated}} --no-pairs '
                               '--effects sensor_gain,stiffness_scale --json {json}')))
    assert trouble == {name: ''}
    assert read_json(folder / 'answers' / f'{name}.json')['schema'] == 'ssi_ros/diagnosis/1'
    assert main(['lock', '--folder', str(folder)]) == 0
