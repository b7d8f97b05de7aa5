"""Launch files and package metadata, checked as far as that goes without launch_ros."""
import ast
from pathlib import Path
import re
import xml.etree.ElementTree as ElementTree

import pytest
import yaml

ROOT = Path(__file__).resolve().parent.parent
LAUNCH = sorted((ROOT / 'launch').glob('*.launch.py'))
SETUP = (ROOT / 'setup.py').read_text()


def calls(tree, name):
    """Return the calls of a function in a syntax tree."""
    return [n for n in ast.walk(tree) if isinstance(n, ast.Call)
            and isinstance(n.func, ast.Name) and n.func.id == name]


@pytest.mark.parametrize('path', LAUNCH, ids=lambda p: p.name)
def test_launch_file(path):
    """It compiles, declares what it uses, and starts nodes that setup.py installs."""
    tree = ast.parse(path.read_text())
    compile(tree, str(path), 'exec')
    assert any(isinstance(n, ast.FunctionDef) and n.name == 'generate_launch_description'
               for n in tree.body)
    declared = {c.args[0].value for c in calls(tree, 'DeclareLaunchArgument')}
    used = {c.args[0].value for name in ('LaunchConfiguration', 'value', 'chosen')
            for c in calls(tree, name) if isinstance(c.args[0], ast.Constant)}
    assert declared == used
    nodes = re.search(r'nodes = \((.*?)\)', SETUP)[1]
    for call in calls(tree, 'Node'):
        keywords = {k.arg: k.value for k in call.keywords}
        assert keywords['package'].value == 'ssi_ros'
        if isinstance(keywords['executable'], ast.Constant):
            assert f"'{keywords['executable'].value.removesuffix('_node')}'" in nodes
    for call in calls(tree, 'node'):
        assert f"'{call.args[0].value}'" in nodes


@pytest.mark.parametrize('path', LAUNCH, ids=lambda p: p.name)
def test_launch_parameters_exist(path):
    """Every parameter that a launch file sets is one of a node, an argument of its very type."""
    known = {'use_sim_time': False}
    for p in (ROOT / 'config').glob('*.yaml'):
        for node in (yaml.safe_load(p.read_text()) or {}).values():
            known |= node.get('ros__parameters', {}) if isinstance(node, dict) else {}
    for n in ast.walk(ast.parse(path.read_text())):
        for key, value in zip(n.keys, n.values) if isinstance(n, ast.Dict) else ():
            default = known[key.value]
            if isinstance(value, ast.Call):
                # without a type launch guesses one: a rate of 10 an integer, a bag 7 a number
                types = {'value': lambda c: c.args[1].id, 'chosen': lambda c: 'bool',
                         'ParameterValue': lambda c: c.keywords[0].value.id}
                assert types[value.func.id](value) == type(default).__name__
            else:
                assert type(ast.literal_eval(value)) is type(default), key.value


@pytest.mark.parametrize('path', LAUNCH, ids=lambda p: p.name)
def test_launch_arguments_show_readable_defaults(path):
    """`ros2 launch ... --show-args` prints a default as it stands: a text, no object of launch."""
    for call in calls(ast.parse(path.read_text()), 'DeclareLaunchArgument'):
        keywords = {k.arg: k.value for k in call.keywords}
        assert keywords['description'].value
        assert isinstance(keywords.get('default_value', ast.Constant('')), ast.Constant)


def nodes_of(name):
    """Return the nodes of a launch file: its keywords and its parameters, by name."""
    out = {}
    tree = ast.parse((ROOT / 'launch' / name).read_text())
    for call in (*calls(tree, 'Node'), *calls(tree, 'node')):
        keywords = {k.arg: k.value for k in call.keywords}
        if call.args:
            out[call.args[0].value] = keywords, ast.unparse(ast.List(call.args[1:]))
        elif isinstance(keywords['name'], ast.Constant):
            out[keywords['name'].value] = keywords, ast.unparse(keywords['parameters'])
    return out


def test_a_launch_ends_with_its_main_node():
    """When the recorder ends, or the player has, the launch shuts down."""
    recorder, _ = nodes_of('monitor.launch.py')['recorder']
    assert recorder['on_exit'].func.id == 'Shutdown'
    player, _ = nodes_of('replay.launch.py')['player']
    assert player['on_exit'].func.id == 'TimerAction' and 'Shutdown(' in ast.unparse(
        player['on_exit'])


def test_launch_files_lose_nothing():
    """A bag, and what is simulated, is published reliable to readers that wait for it."""
    nodes = nodes_of('replay.launch.py')
    assert all("'reliable': True" in parameters for _, parameters in nodes.values())
    nodes = nodes_of('diagnose.launch.py')
    assert "'reliable': True" in nodes['player'][1]
    assert "'wait_for_subscribers': 2" in nodes['player'][1]
    assert all('source' in nodes[n][1] for n in ('gap', 'identifier'))
    nodes = nodes_of('monitor.launch.py')
    assert "'reliable': True" in nodes['simulator'][1]
    assert "'wait_for_subscribers': 2" in nodes['simulator'][1]
    assert 'from_simulator' in nodes['identifier'][1]


def test_versions_agree():
    """package.xml, setup.py and the package say the same version, and the changelog has it."""
    from ssi_ros import __version__
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    assert package.get('format') == '3' and package.find('version').text == __version__
    assert f"version='{__version__}'" in SETUP
    text = (ROOT / 'CHANGELOG.rst').read_text()
    assert 'Forthcoming\n' in text or f'{__version__} (' in text


def required():
    """Return the names that setup.py requires, without their versions."""
    listed = re.search(r'install_requires=\[(.*?)\]', SETUP, re.S)[1]
    return re.findall(r"'([\w-]+)[^']*'", listed)


def test_lock_names_no_address():
    """The lock holds names, versions and hashes, and every requirement of the package."""
    lock = (ROOT / 'requirements.lock').read_text()
    assert '://' not in lock and '--index' not in lock
    names = required()
    for name in names:
        assert re.search(rf'^{name}==', lock, re.MULTILINE), name


@pytest.mark.parametrize('page', ['README.md', 'docs/how-to/robot.md'])
def test_a_robot_gets_every_library(page):
    """What rosdep does not install of the requirements, the page's pip line does."""
    names = required()
    by_pip = re.search(r'^pip install (.*)$', (ROOT / page).read_text(), re.M)[1].split()
    package = (ROOT / 'package.xml').read_text()
    for name in names:
        key = 'yaml' if name == 'pyyaml' else name
        assert name in by_pip or f'<exec_depend>python3-{key}<' in package, name
