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
from dataclasses import dataclass

import numpy as np

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import add_stage, mix
from ssi_ros.effects.registry import detects, modal_form
from ssi_ros.gap.comparison import Detection
from ssi_ros.model.sensors import Stage
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


@modal_form('array_gain')
def array_gain_forms(nominal):
    """Yield no form yet."""
    yield from ()


@dataclass(frozen=True)
class Digits(Stage):
    """Rounding to so many digits."""

    count: float
    name = 'digits'

    def begin(self, rate_hz, generator):
        """Return the function that rounds."""
        return lambda values: rounded(values, int(self.count))


def rounded(values, count):
    """Return values of so many digits."""
    unit = 10.0 ** (np.floor(np.log10(np.maximum(np.abs(values), 1e-300))) + 1 - count)
    return np.round(values / unit) * unit


@effect
class FewDigits(Effect):
    """The recorder writes numbers of few digits."""

    name = 'few_digits'
    site = Site.SENSOR
    size = 'digits'
    reference = 'ours'
    starts = {'digits': (4.0,)}
    spectral = False
    patterns = (ModalPattern.SAMPLE_VALUES,)

    digits: float = quantity(float('inf'), low=1.0, doc='digits of a number')

    def apply(self, setup):
        """Return the setup with the rounding at the end of the chain."""
        return add_stage(setup, Digits(self.digits))


@detects('few_digits', of='samples')
def detect_digits(effect, samples):
    """Detect that all values have so few digits."""
    for count in range(1, 9):
        if np.allclose(rounded(samples.values, count), samples.values, rtol=1e-12, atol=0.0):
            return Detection.of_effect(effect(digits=count), 0.0, f'Numbers of {count} digits.')
    return None
'''
CHECK = """
from ssi_ros.effects import applicable, library
from ssi_ros.effects.registry import detectors, modal_forms, showing
import ssi_ros.gap.detectors
sources = 'samples', 'input', 'spectrum', 'recordings', 'periods'
for name, effect in library().items():
    if name not in applicable(None):
        continue
    detected = {of for of in sources if name in detectors(of)}
    shown = [p for p in effect.patterns if name in showing(p)]
    with_a_model = effect.spectral or detected & {'samples', 'input', 'spectrum'}
    without_geometry = name in modal_forms() or detected or shown
    print(name, bool(with_a_model), bool(without_geometry))
"""


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

    def verb(*words, program=('-m', 'ssi_ros')):
        return subprocess.run([sys.executable, *program, *words], text=True,
                              capture_output=True, env=dict(os.environ, PYTHONPATH=path))
    return verb


def test_it_is_listed(run):
    """`ssi_ros effects` shows it with its quantity, beside the package's own."""
    listed = run('effects')
    assert listed.returncode == 0, listed.stderr
    assert 'array_gain (sensor): Both sensors of array E1 read too much.' in listed.stdout
    assert 'gain of the amplifier of E1; null 1, 0.1 to 10' in listed.stdout
    assert 'sensor_gain (sensor)' in listed.stdout


@pytest.mark.slow
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


@pytest.mark.slow
def test_its_detector_is_asked(run, tmp_path):
    """An effect that no spectrum shows is found by the detector in its own file."""
    bag, out = str(tmp_path / 'bag'), tmp_path / 'd.json'
    made = run('simulate', bag, '--duration-s', '120', '--effect', 'few_digits:digits=5')
    assert made.returncode == 0, made.stderr
    found = run('diagnose', bag, '--effects', 'few_digits,sensor_noise', '--no-pairs', '--json',
                str(out))
    assert found.returncode == 0, found.stderr + found.stdout
    first = json.loads(out.read_text())['candidates'][0]
    assert first['effects'] == ['few_digits']
    assert first['parameters']['few_digits.digits']['value'] == 5.0


def test_every_effect_can_be_shown(run):
    """Beside a model and beside a recording, ours and those of the library."""
    found = run(CHECK, program=('-c',))
    assert found.returncode == 0, found.stderr
    lines = found.stdout.splitlines()
    assert {'few_digits True True', 'array_gain True True'} <= set(lines)
    assert [line for line in lines if not line.endswith('True True')] == []


def test_its_mistakes_are_refused(run, tmp_path):
    """Range and near names are those of its own declaration."""
    bag = str(tmp_path / 'bag')
    assert 'outside 0.1 to 10' in run('simulate', bag, '--effect', 'array_gain:scale=99').stderr
    assert 'did you mean scale' in run('simulate', bag, '--effect', 'array_gain:scal=1').stderr
