"""No code outside effects and detectors knows an effect by its name."""
import ast
from pathlib import Path

import pytest
from ssi_ros.effects import library

ROOT = Path(__file__).resolve().parents[2]
NAMES = frozenset(library())
GAP = ROOT / 'ssi_ros' / 'gap'
# still to be mended; a path is taken away here when its files are free of names
ALLOWED = ('nominal/', 'detectors/recorded_', 'selection/recorded_')


def names_in(source):
    """Yield the line and the name of every effect that a source names outside of decorators."""
    nodes = [ast.parse(source)]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.Constant) and node.value in NAMES:
            yield node.lineno, node.value
        decorators = getattr(node, 'decorator_list', ())
        nodes += [n for n in ast.iter_child_nodes(node) if n not in decorators]


@pytest.mark.parametrize('path', sorted(GAP.rglob('*.py')), ids=lambda p: str(p.relative_to(GAP)))
def test_no_effect_is_named(path):
    """A diagnosis asks effects for their attributes, and registries for functions."""
    found = list(names_in(path.read_text()))
    if not str(path.relative_to(GAP)).startswith(ALLOWED):
        assert found == []


def test_names_are_found_and_decorators_are_not_counted():
    """One literal, in a tuple, of two; a word that contains a name is none."""
    source = """
@detects('saturation', of='samples')
def detect(effect, samples):
    return samples.name in ('sensor_gain', 'sensor_gain_2')
"""
    assert list(names_in(source)) == [(4, 'sensor_gain')]
