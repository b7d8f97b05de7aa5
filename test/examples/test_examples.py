"""Every example runs as it stands, and says what it should."""
from pathlib import Path
import re
import subprocess
import sys

import pytest

from ssi_ros.cli.main import main
from ssi_ros.model import load_model

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted(p.name for p in (ROOT / 'examples').glob('*.py'))


def run(name, *words):
    """Run an example from the root of the repository, as its first line says; return its words."""
    done = subprocess.run([sys.executable, f'examples/{name}.py', *map(str, words)], cwd=ROOT,
                          capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def test_all_are_here():
    """There is a test below for every example."""
    assert EXAMPLES == ['add_an_effect.py', 'diagnose_a_bag.py', 'footbridge.py',
                        'identify_a_bag.py', 'robot_arm.py', 'shear_building.py',
                        'tune_a_window.py']


@pytest.mark.parametrize('name', ['identify_a_bag', 'diagnose_a_bag'])
def test_ten_lines(name):
    """What is promised as ten lines is about ten: without imports and the first words."""
    code = (ROOT / 'examples' / f'{name}.py').read_text().split('\n\n', 2)[2]
    assert sum(1 for line in code.splitlines() if line.strip()) <= 10


def test_identify():
    """The last window of the bag has the twenty modes of the spacecraft."""
    last = re.split(r'^\d+ modes', run('identify_a_bag'), flags=re.M)[-1]
    f = [float(x) for x in re.findall(r'^ +([\d.]+) \+- [\d.]+ Hz', last, re.M)]
    # 120 s hold 43 cycles of the lowest mode: its frequency is known to about 1 %
    assert len(f) == 20 and abs(f[0] / 0.361 - 1) < 0.03 and abs(f[-1] / 31.03 - 1) < 0.01


def test_diagnose(tmp_path):
    """A gain of 5 % on one channel is found in 120 s, and the page is written."""
    bag, page = tmp_path / 'real', tmp_path / 'page.html'
    assert main(['simulate', str(bag), '--duration-s', '120', '--seed', '5', '--effect',
                 'sensor_gain:channel=e1_a,scale=1.05']) == 0
    out = run('diagnose_a_bag', bag, page)
    first = re.search(r'^  (.*): probability ([\d.]+)', out, re.M)
    assert 'sensor_gain' in first[1] and float(first[2]) > 0.5
    assert 'How far does it shrink?' in page.read_text()


def test_own_effect():
    """The cable raises the lowest frequencies, and the diagnosis names it with its stiffness."""
    out = run('add_an_effect')
    nominal, cable = (
        [float(x) for x in re.search(rf'^{n}: (.*)$', out, re.M)[1].split()]
        for n in ('nominal', 'with the cable'))
    assert cable[0] > 1.005 * nominal[0]
    value, std = map(float, re.search(r'stiffness_n_m = ([\d.e+-]+) N/m, standard deviation '
                                      r'([\d.e+-]+)', out).groups())
    assert abs(value - 4.0) < 3 * std       # three spreads: a chance of 0.3 % at most
    assert re.match(r'(EXPLAINED|TIED)', out.splitlines()[2])


@pytest.mark.parametrize('name, modes', [('shear_building', 5), ('footbridge', 5),
                                         ('robot_arm', 3)])
def test_models_of_other_people(name, modes, tmp_path):
    """Each writes a model that is read back with all its modes."""
    if name == 'robot_arm':
        pytest.importorskip('mujoco')
    run(name, tmp_path / 'model.npz')
    model, effects = load_model(tmp_path / 'model.npz')
    assert model.vibrating == modes and effects == ()


def test_a_bag_of_the_arm(tmp_path):
    """With changes it also writes a bag, with the channels of the model."""
    pytest.importorskip('mujoco')
    run('robot_arm', tmp_path / 'model.npz', tmp_path / 'real', 'elbow.stiffness=0.94')
    assert main(['info', str(tmp_path / 'real')]) == 0


def test_tune():
    """Longer windows find more modes and know them better."""
    rows = [list(map(float, line.split())) for line in run('tune_a_window').splitlines()[1:]]
    window, modes, off, spread, _, lowest = zip(*rows)
    assert window == (15.0, 30.0, 60.0, 140.0)
    assert modes[0] < modes[-1] and lowest[-1] < lowest[0]
    assert spread[-1] < spread[0] and off[-1] < off[0]
