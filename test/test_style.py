"""Style is a test: ament's flake8 and pep257, the rules of a ROS 2 Python package."""
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
NAMES = ('ssi_ros', 'blindgen', 'test', 'validation', 'launch', 'examples', 'setup.py')
CHECKED = [str(ROOT / name) for name in NAMES]


def test_flake8():
    """Every file passes ament_flake8."""
    flake8 = pytest.importorskip('ament_flake8.main')
    code, errors = flake8.main_with_errors(argv=CHECKED)
    assert code == 0, '\n'.join(errors)


def test_pep257():
    """Every file passes ament_pep257."""
    pep257 = pytest.importorskip('ament_pep257.main')
    assert pep257.main(argv=CHECKED) == 0
