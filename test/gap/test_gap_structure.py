"""The shape of the gap package: sizes that one person can read, one name for each limit."""
import ast
from pathlib import Path

import pytest
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.quantity import quantities
import yaml

ROOT = Path(__file__).resolve().parents[2]
GAP = ROOT / 'ssi_ros' / 'gap'
FILES = sorted(GAP.rglob('*.py'))
FOLDERS = sorted({p.parent for p in FILES})
MOST_FILES, MOST_LINES, MOST_FUNCTION, MOST_PARAMETERS, MOST_ALL = 12, 300, 60, 7, 10_400


def name(path):
    """Return a path as it is written in the package."""
    return str(path.relative_to(GAP.parent))


@pytest.mark.parametrize('folder', FOLDERS, ids=name)
def test_a_folder_is_surveyed_at_a_glance(folder):
    """No folder holds more than twelve files."""
    assert len(list(folder.glob('*.py'))) <= MOST_FILES


@pytest.mark.parametrize('path', FILES, ids=name)
def test_files_and_functions_read_in_one_sitting(path):
    """No file over 300 lines, no function over 60 lines or 7 parameters."""
    text = path.read_text()
    assert len(text.splitlines()) <= MOST_LINES
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            arguments = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
            count = len([a for a in arguments if a.arg not in ('self', 'cls')])
            assert node.end_lineno - node.lineno < MOST_FUNCTION, node.name
            assert count <= MOST_PARAMETERS, node.name


def test_the_package_stays_small():
    """All of it together, so that what comes in makes something else go."""
    assert sum(len(p.read_text().splitlines()) for p in FILES) <= MOST_ALL


def test_the_driver_reads_from_top_to_bottom():
    """One driver of at most 150 lines, for every nominal."""
    assert len((GAP / 'driver.py').read_text().splitlines()) <= 150


def test_the_packaged_settings_are_the_defaults():
    """config/diagnosis.yaml holds every setting at its default, as it says."""
    written = yaml.safe_load((ROOT / 'config' / 'diagnosis.yaml').read_text())
    defaults = {f.name: f.default for f in quantities(DiagnosisSettings)}
    assert written == defaults
