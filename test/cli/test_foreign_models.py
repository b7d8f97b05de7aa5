"""The verbs on a model of somebody else, as a user runs them."""
import json
from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest
from ssi_ros.cli.main import main

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope='module')
def building(tmp_path_factory):
    """Return the file that the example writes."""
    path = tmp_path_factory.mktemp('models') / 'building.npz'
    subprocess.run([sys.executable, 'examples/shear_building.py', str(path)], cwd=ROOT, check=True,
                   timeout=60)
    return str(path)


@pytest.fixture(scope='module')
def bag(building, tmp_path_factory):
    """Return a bag of the building with a storey that is softer."""
    path = str(tmp_path_factory.mktemp('bags') / 'bag')
    assert main(['simulate', path, '--model', building, '--duration-s', '1800', '--effect',
                 'connection_stiffness:freedom=floor_2,to=floor_3,share=-0.08', '--quiet']) == 0
    return path


def test_model_shows_modes_and_points(building, capsys):
    """Frequencies, what is left out, and the stiffness that effects are shares of."""
    assert main(['model', building]) == 0
    out = capsys.readouterr().out
    assert '5 of 5 modes are reached' in out and '0.4999' in out
    assert 'no geometry, so that 11 effects were left out' in out
    assert [w for w in out.splitlines() if w.startswith('floor_2') and 'floor_3' in w][0].split(
        )[2:] == ['5.523e+06', '2.268e+04']
    assert main(['model', building, '--config', building]) == 2
    assert 'name two models; give one' in capsys.readouterr().err


def test_diagnose_names_the_storey_and_applies_it(building, bag, tmp_path, capsys):
    """Exit code 0, the place in the answer, and a model with the effect that is read again."""
    more = str(tmp_path / 'more.npz')
    words = ['diagnose', bag, '--model', building, '--effects',
             'connection_stiffness,point_mass,sensor_gain', '--no-pairs']
    assert main([*words, '--apply', more, '--html', str(tmp_path / 'page.html')]) == 0
    out = capsys.readouterr().out
    assert 'connection_stiffness: share of freedom floor_2 and to floor_3' in out
    assert main(['model', more]) == 0
    assert 'without the effects of the file: connection_stiffness:freedom=floor_2' in (
        capsys.readouterr().out)
    topics = [w for t in ('acc_1', 'acc_3', 'acc_5', 'gnss') for w in (
        '--channel', f'/ssi_ros/{t}:accel.linear.z')]
    bad = main([*words, *topics[:2]])
    assert bad == 2 and 'give one for each, in this order' in capsys.readouterr().err


def test_identifiability_and_report(building, bag, tmp_path, capsys):
    """A table of what the record would show, and a page without a spacecraft to draw."""
    path = tmp_path / 'table.json'
    assert main(['identifiability', '--model', building, '--duration-s', '300', '--json',
                 str(path)]) == 0
    names = {e['name'] for e in json.loads(path.read_text())['effects']}
    assert {'connection_friction', 'mode_damping', 'sensor_gain'} <= names
    assert 'hub_inertia' not in names
    page = tmp_path / 'page.html'
    assert main(['report', bag, '--model', building, '--no-diagnosis', '--output',
                 str(page)]) == 0
    assert 'Which shapes have the modes?' in page.read_text()


@pytest.mark.parametrize('words, said', [
    (['simulate', 'x', '--excitation', 'torque', '--model'], 'excitation torque is one of a'),
    (['place', '--config'], 'has no geometry to place sensors on'),
    (['diagnose', 'x', '--effects', 'added_mass', '--model'], 'does not exist')])
def test_what_a_model_of_matrices_cannot(words, said, building, tmp_path, monkeypatch, capsys):
    """One line, no traceback."""
    monkeypatch.chdir(tmp_path)
    assert main([*words, building]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count('\n') == 1


def test_a_broken_file_is_said(tmp_path, capsys):
    """The name of the file and what is missing."""
    np.savez(tmp_path / 'm.npz', mass=np.eye(2), stiffness=np.eye(2))
    assert main(['model', str(tmp_path / 'm.npz')]) == 2
    assert 'm.npz: inputs is missing; give the name of every input' in capsys.readouterr().err
