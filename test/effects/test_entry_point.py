"""An effect of another package: installed by pip, found by its entry point, used like ours."""
import json
import os
import subprocess
import sys

import pytest

PYPROJECT = """
[build-system]
requires = ["setuptools"]
build-backend = "setuptools.build_meta"
[project]
name = "our-effects"
version = "1.0"
[project.entry-points."ssi_ros.effects"]
ours = "our_effects"
[tool.setuptools]
py-modules = ["our_effects"]
"""
MODULE = '''"""Effects of our own."""
import numpy as np

from ssi_ros.effects.base import Effect, effect, Site
from ssi_ros.effects.edits import mix
from ssi_ros.quantity import quantity


@effect
class ArrayGain(Effect):
    """Both sensors of array E1 read too much."""

    name = 'array_gain'
    site = Site.SENSOR
    size = 'scale'
    reference = 'ours'
    starts = {'scale': (0.95, 1.05)}

    scale: float = quantity(1.0, low=0.1, high=10.0, doc='gain of the amplifier of E1')

    def apply(self, setup):
        """Return the setup with the gains."""
        gains = [self.scale if c.startswith('e1') else 1.0 for c in setup.system.channels]
        return mix(setup, np.diag(gains))
'''


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    """Install the package into a folder of its own; return a runner of verbs that sees it."""
    source, target = (tmp_path_factory.mktemp(n) for n in ('source', 'target'))
    (source / 'pyproject.toml').write_text(PYPROJECT)
    (source / 'our_effects.py').write_text(MODULE)
    pip = subprocess.run(
        [sys.executable, '-m', 'pip', 'install', '--quiet', '--no-deps', '--no-index',
         '--no-build-isolation', '--disable-pip-version-check', '--target', str(target),
         str(source)], capture_output=True, text=True)
    if pip.returncode:
        pytest.skip(f'pip cannot build a package here: {pip.stderr[-300:]}')
    path = os.pathsep.join(filter(None, [str(target), os.environ.get('PYTHONPATH')]))

    def verb(*words):
        return subprocess.run([sys.executable, '-m', 'ssi_ros', *words], text=True,
                              capture_output=True, env=dict(os.environ, PYTHONPATH=path))
    return verb


def test_it_is_listed(run):
    """`ssi_ros effects` shows it with its quantity, beside the package's own."""
    listed = run('effects')
    assert listed.returncode == 0, listed.stderr
    assert 'array_gain (sensor): Both sensors of array E1 read too much.' in listed.stdout
    assert 'gain of the amplifier of E1; null 1, 0.1 to 10' in listed.stdout
    assert 'sensor_gain (sensor)' in listed.stdout


def test_it_is_injected_and_diagnosed(run, tmp_path):
    """A record with it is explained by it, not by the near effects of the library."""
    bag, out = str(tmp_path / 'bag'), tmp_path / 'd.json'
    made = run('simulate', bag, '--duration-s', '120', '--effect', 'array_gain:scale=1.1')
    assert made.returncode == 0, made.stderr
    found = run('diagnose', bag, '--effects', 'array_gain,sensor_gain,array_asymmetry',
                '--no-pairs', '--json', str(out))
    assert found.returncode == 0, found.stderr + found.stdout
    verdict = json.loads(out.read_text())
    assert verdict['verdict']['effects'] == ['array_gain']
    value = verdict['candidates'][0]['parameters']['array_gain.scale']
    # five standard deviations: the size is found, not only the name
    assert abs(value['value'] - 1.1) < 5 * value['std']


def test_its_mistakes_are_told(run, tmp_path):
    """Range and near names are those of its own declaration."""
    bag = str(tmp_path / 'bag')
    assert 'outside 0.1 to 10' in run('simulate', bag, '--effect', 'array_gain:scale=99').stderr
    assert 'did you mean scale' in run('simulate', bag, '--effect', 'array_gain:scal=1').stderr
