"""Who may import whom: the layers of the package, kept by a test."""
import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / 'ssi_ros'
# what every layer may import
FREE = {'quantity', 'limits', 'array_file', 'arrays', 'fisher_scoring',
        'hermitian', 'lazy', 'past_motion', 'plain_yaml', 'scipy_later', 'size_prior',
        'structural_modification', 'tails', 'weighted_sums', 'whole_file', 'windows'}
MAY_IMPORT = {            # layer: the layers that it may import, besides itself and FREE
    'quantity': set(),
    'limits': set(),
    'array_file': {'limits'},
    'arrays': set(),
    'hermitian': set(),
    'fisher_scoring': set(),
    'past_motion': set(),
    'plain_yaml': set(),
    'size_prior': set(),
    'structural_modification': set(),
    'tails': set(),
    'weighted_sums': set(),
    'whole_file': set(),
    'windows': set(),
    'records': set(),
    'model': {'records'},
    'effects': {'records', 'model'},
    'identify': {'records'},
    'bag': {'records'},
    'integrity': {'records'},
    'open_set': {'records', 'model'},
    # parts of the diagnosis kept beside it: what a model does not know of itself, free levels of a
    # recording, single events, templates on disk
    'gap': {'records', 'model', 'effects', 'identify', 'updating', 'levels', 'events', 'regimes',
            'integrity', 'open_set', 'inputs', 'bootstrap', 'template_cache'},
    'template_cache': {'effects', 'gap', 'updating', '__version__'},
    'bootstrap': {'records', 'effects', 'events', 'gap', 'inputs', 'integrity', 'levels',
                  'open_set'},
    'inputs': {'records', 'model', 'effects', 'gap', 'integrity', 'updating'},
    'updating': {'records', 'model', 'effects', 'gap', 'integrity'},
    'levels': {'gap'},
    'events': {'effects', 'gap', 'open_set'},
    'regimes': {'effects', 'events', 'gap', 'identify', 'open_set'},
    'planning': {'model', 'effects', 'gap', 'updating', 'inputs', 'template_cache'},
    'monitor': {'records'},
    'report': {'records', 'model', 'effects', 'identify', 'gap', 'bag', '__version__'},
}
ROS = {'rclpy', 'std_msgs', 'geometry_msgs', 'sensor_msgs', 'diagnostic_msgs', 'std_srvs',
       'rosgraph_msgs', 'builtin_interfaces', 'lifecycle_msgs', 'rcl_interfaces',
       'rosidl_runtime_py', 'ament_index_python'}
FILES = sorted(PACKAGE.rglob('*.py'))


def imported(path):
    """Yield the dotted names that a file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                yield f'{node.module}.{alias.name}'


@pytest.mark.parametrize('path', FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_layers(path):
    """A layer imports only the layers below it, and only ros/ imports ROS."""
    layer = path.relative_to(PACKAGE).parts[0].removesuffix('.py')
    for name in imported(path):
        parts = name.split('.')
        if layer != 'ros':
            assert parts[0] not in ROS, f'{path.name} imports {name}: only ros/ imports ROS'
        assert parts[0] != 'blindgen', f'{path.name} imports {name}: the blind rule'
        if parts[0] == 'ssi_ros' and layer in MAY_IMPORT and len(parts) > 1:
            assert parts[1] in MAY_IMPORT[layer] | FREE | {layer}, f'{layer} may not import {name}'


def test_blindgen_is_independent():
    """The generator of withheld cases shares no code with the package."""
    for path in (ROOT / 'blindgen').rglob('*.py'):
        assert not any(n.split('.')[0] == 'ssi_ros' for n in imported(path)), path


def test_files_read_in_one_sitting():
    """No file of the package is longer than 400 lines."""
    long = {p.name: n for p in FILES if (n := len(p.read_text().splitlines())) > 400}
    assert not long, long
