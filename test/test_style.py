"""Style is a test: ament's flake8 and pep257, the rules of a ROS 2 Python package."""
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parent.parent
NAMES = ('ssi_ros', 'blindgen', 'test', 'validation', 'launch', 'examples', 'setup.py')
CHECKED = [str(ROOT / name) for name in NAMES]
RUFF = shutil.which('ruff', path=Path(sys.executable).parent)


@pytest.mark.skipif(not RUFF, reason='ruff is not installed')
def test_ruff():
    """Every file passes the rules of ruff.toml: those of ament, in a second."""
    ran = subprocess.run([RUFF, 'check', '--no-cache', '--output-format', 'concise', *CHECKED],
                         cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.slow
def test_flake8():
    """Every file passes ament_flake8, which also asks for an order of imports."""
    flake8 = pytest.importorskip('ament_flake8.main')
    code, errors = flake8.main_with_errors(argv=CHECKED)
    assert code == 0, '\n'.join(errors)


@pytest.mark.slow
def test_pep257():
    """Every file passes ament_pep257."""
    pep257 = pytest.importorskip('ament_pep257.main')
    assert pep257.main(argv=CHECKED) == 0
