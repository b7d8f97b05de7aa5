"""The verb `model`, as a user runs it."""
import os
import subprocess
import sys

import numpy as np
import pytest
from ssi_ros.cli.main import main
from ssi_ros.model import assemble, load_spacecraft


def test_table_and_reach(capsys):
    """Twenty lines, six reached by the torque alone."""
    assert main(['model', '--excitation', 'torque', '--reach']) == 0
    out = capsys.readouterr().out
    assert out.count('not excited') == 14
    assert '6 of 20 modes are reached' in out and '0.6928' in out
    # less than a cycle is no length in which a mode is distinguished
    assert ' < 1.4' in out and not any(line.endswith(' 0.0') for line in out.splitlines())


def test_matrices(tmp_path):
    """The file holds the five matrices under their names."""
    assert main(['model', '--npz', str(tmp_path / 'm.npz')]) == 0
    system = assemble(load_spacecraft())
    with np.load(tmp_path / 'm.npz') as file:
        for name in ('mass', 'damping', 'stiffness', 'input', 'sensor'):
            assert np.array_equal(file[name], getattr(system, name))


@pytest.mark.parametrize('text, words', [('hub: 3', 'mapping'), ('noise_rms_m_s2: -1.0', '-1')])
def test_a_bad_file_is_told(tmp_path, capsys, text, words):
    """Exit code 2 and one line, no traceback."""
    path = tmp_path / 'craft.yaml'
    path.write_text(text)
    assert main(['model', '--config', str(path)]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count('\n') == 1


def test_a_reader_that_has_gone_is_no_error():
    """`ssi_ros model | head -1` ends without a word, though a broken pipe is an OSError."""
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([sys.executable, '-u', '-m', 'ssi_ros', 'model'], stdout=write,
                          stderr=subprocess.PIPE, text=True, timeout=60)
    os.close(write)
    assert done.returncode == 0 and not done.stderr


@pytest.mark.parametrize('verb', [['demo'], ['monitor', '--plain'], ['play', 'bag']])
def test_without_ros_it_says_so(verb, monkeypatch, capsys):
    """A machine without ROS 2 gets a line that says where to find it, no traceback."""
    for name in [n for n in sys.modules if n.startswith('ssi_ros.ros')]:
        monkeypatch.delitem(sys.modules, name)
    for name in ('rclpy', 'diagnostic_msgs', 'builtin_interfaces'):
        monkeypatch.setitem(sys.modules, name, None)
    assert main(verb) == 2
    error = capsys.readouterr().err
    assert 'needs ROS 2' in error and error.count('\n') == 1


def test_a_file_that_is_not_there_is_told(capsys):
    """The name of the file and what is wrong with it, without a number of the system."""
    assert main(['model', '--config', 'no_such.yaml']) == 2
    assert capsys.readouterr().err == (
        'ssi_ros model: no_such.yaml does not exist; give a file that does\n')
