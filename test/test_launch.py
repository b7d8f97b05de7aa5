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
    used = {c.args[0].value for name in ('LaunchConfiguration', 'value')
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
                assert value.func.id == 'value' and value.args[1].id == type(default).__name__
            else:
                assert type(ast.literal_eval(value)) is type(default), key.value


def test_versions_agree():
    """package.xml, setup.py and the package say the same version, and the changelog has it."""
    from ssi_ros import __version__
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    assert package.get('format') == '3' and package.find('version').text == __version__
    assert f"version='{__version__}'" in SETUP
    assert f'## {__version__}' in (ROOT / 'CHANGELOG.md').read_text()


def test_lock_names_no_address():
    """The lock holds names, versions and hashes, and every requirement of the package."""
    lock = (ROOT / 'requirements.lock').read_text()
    assert '://' not in lock and '--index' not in lock
    names = re.findall(r"'([\w-]+)'", re.search(r'install_requires=\[(.*?)\]', SETUP, re.S)[1])
    for name in names:
        assert re.search(rf'^{name}==', lock, re.MULTILINE), name


@pytest.mark.parametrize('page', ['README.md', 'docs/how-to/robot.md'])
def test_a_robot_gets_every_library(page):
    """What rosdep does not install of the requirements, the page's pip line does."""
    names = re.findall(r"'([\w-]+)'", re.search(r'install_requires=\[(.*?)\]', SETUP, re.S)[1])
    by_pip = re.search(r'^pip install (.*)$', (ROOT / page).read_text(), re.M)[1].split()
    package = (ROOT / 'package.xml').read_text()
    for name in names:
        key = 'yaml' if name == 'pyyaml' else name
        assert name in by_pip or f'<exec_depend>python3-{key}<' in package, name
