"""The package as ROS 2 tools see it: built by colcon, described by package.xml and changelog."""
import ast
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest

ROOT = Path(__file__).resolve().parent.parent
# rosdep has no key for these: the pip line of docs/how-to/robot.md names them
BY_PIP = {'mcap', 'numba', 'zstandard', 'threadpoolctl', 'plotly', 'textual', 'foxglove', 'dask',
          'pyuff'}
# what Ubuntu 24.04, that of ROS 2 Jazzy, has in versions that serve: it has no numba, and a
# Textual of 2022. rosdep has keys for both all the same, at which it stops
UBUNTU = {'argcomplete', 'matplotlib', 'numpy', 'pytest', 'scipy', 'tqdm', 'yaml'}
# modules that come with another package
WITH = {'rich': 'textual', 'lz4': 'mcap'}
ROS = ('_msgs', '_interfaces', '_srvs')


@pytest.fixture(scope='module')
def installed(tmp_path_factory):
    """Return a workspace that colcon has built the package in."""
    colcon = shutil.which('colcon', path=os.pathsep.join(
        (str(Path(sys.executable).parent), os.environ.get('PATH', ''))))
    if colcon is None:
        pytest.skip('colcon is not installed')
    workspace = tmp_path_factory.mktemp('workspace')
    done = subprocess.run([colcon, 'build', '--base-paths', str(ROOT), '--packages-select',
                           'ssi_ros'], cwd=workspace, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return workspace


def sourced(workspace, command):
    """Return what a command prints in a shell that has sourced the workspace and nothing else."""
    path = os.pathsep.join((str(Path(sys.executable).parent), '/usr/bin', '/bin'))
    environment = {k: v for k, v in os.environ.items() if k != 'PYTHONPATH'}
    done = subprocess.run(['bash', '-c', f'. install/setup.bash && {command}'], cwd=workspace,
                          capture_output=True, text=True, timeout=120,
                          env={**environment, 'PATH': path})
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_the_command_is_on_the_path(installed):
    """After `source install/setup.bash`, `ssi_ros` is that of the workspace, and it runs."""
    assert sourced(installed, 'command -v ssi_ros') == str(
        installed / 'install' / 'ssi_ros' / 'bin' / 'ssi_ros')
    assert sourced(installed, 'ssi_ros --version').startswith('ssi_ros ')
    where = sourced(installed, 'cd / && python3 -c "import ssi_ros; print(ssi_ros.__file__)"')
    assert where.startswith(str(installed / 'install'))


def test_ros2_run_finds_the_nodes(installed):
    """Every node is an executable in lib/ssi_ros, where `ros2 run` and launch look."""
    folder = installed / 'install' / 'ssi_ros' / 'lib' / 'ssi_ros'
    for node in ('simulator', 'identifier', 'recorder', 'player', 'bridge', 'gap'):
        assert os.access(folder / f'{node}_node', os.X_OK), node


def imported():
    """Return the packages that the code and the launch files import."""
    names = set()
    for path in (*(ROOT / 'ssi_ros').rglob('*.py'), *(ROOT / 'launch').glob('*.py')):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names |= {a.name.split('.')[0] for a in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names.add(node.module.split('.')[0])
    return names - set(sys.stdlib_module_names) - {'ssi_ros'}


def test_package_xml_names_what_is_imported():
    """Every package that is imported is a dependency that rosdep installs, or by pip."""
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    named = {e.text for e in package.findall('exec_depend')}
    for name in {WITH.get(n, n) for n in imported()} - BY_PIP:
        ros = name.endswith(ROS) or name in ('rclpy', 'launch', 'launch_ros')
        assert (name if ros else f'python3-{name}') in named, name
    assert 'ros2launch' in named              # `ros2 launch` itself
    keys = {e.text for e in package.iter() if (e.text or '').startswith('python3-')}
    assert keys <= {f'python3-{name}' for name in UBUNTU}
    lines = re.findall(r'^pip install (.*)$', (ROOT / 'docs/how-to/robot.md').read_text(), re.M)
    for name in BY_PIP:
        assert re.search(rf'\b{name}\b', ' '.join(lines)), name


def test_release_tools_read_package_and_changelog():
    """What catkin_pkg, which bloom uses, demands of package.xml and CHANGELOG.rst."""
    pytest.importorskip('catkin_pkg')
    from catkin_pkg.package import parse_package
    from catkin_pkg.package_version import get_forthcoming_label
    package = parse_package(str(ROOT))
    package.validate()
    assert package.urls and package.maintainers and package.licenses == ['Apache-2.0']
    # what is not released yet stands under this title, which the release renames
    assert get_forthcoming_label((ROOT / 'CHANGELOG.rst').read_text()) == 'Forthcoming'
