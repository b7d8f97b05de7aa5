"""Files of other people's models, by NumPy and MATLAB."""
import sys
import zipfile

import numpy as np
import pytest
from scipy.io import savemat

from ssi_ros.effects import load_configuration, parse_effect, save_configuration
from ssi_ros.model import assemble, load_model, load_spacecraft, natural_modes, save_model
from ssi_ros.model.model_file import save_system
from ssi_ros.model.spectrum import output_spectrum

K = np.array([[200.0, -100.0], [-100.0, 100.0]])
SHARED = {'channels': ['low', 'top'], 'kinds': ['acceleration', 'angular rate'],
          'noise_rms': 1e-3, 'inputs': ['push'], 'levels': 2.0, 'rate_hz': 20.0}
MATRICES = {**SHARED, 'mass': np.eye(2), 'damping_ratios': 0.01, 'stiffness': K,
            'input': [[0.0], [1.0]], 'output': np.eye(2), 'freedoms': ['a', 'b']}
MODES = {**SHARED, 'frequencies_hz': [1.0, 2.6], 'damping_ratios': [0.01, 0.02],
         'shapes': [[1.0, 1.0], [1.6, -0.6]], 'participation': [[1.0], [0.4]]}


def write(path, given):
    """Write variables as somebody else would."""
    if path.suffix == '.npz':
        np.savez(path, **given)
    else:       # texts as a cell array, as MATLAB has them
        savemat(path, {k: np.array(v, dtype=object) if isinstance(v, list) and isinstance(
            v[0], str) else v for k, v in given.items()})
    return path


@pytest.mark.parametrize('given', [MATRICES, MODES])
@pytest.mark.parametrize('suffix', ['.npz', '.mat'])
def test_numpy_and_matlab(given, suffix, tmp_path):
    """Both give the same model, and what is written is read back as it was."""
    model, effects = load_model(write(tmp_path / f'm{suffix}', given))
    assert effects == () and model == load_model(write(tmp_path / 'n.npz', given))[0]
    assert [s.kind for s in model.sensors] == ['acceleration', 'angular_rate']
    assert model.drives[0].level == 2.0
    expected = (np.sqrt(np.linalg.eigvalsh(K)) / (2 * np.pi) if given is MATRICES else [1.0, 2.6])
    np.testing.assert_allclose(natural_modes(assemble(model)).frequencies_hz, expected)
    save_model(model, tmp_path / 'again.npz', ['sensor_gain:channel=top,scale=1.1'])
    again, effects = load_model(tmp_path / 'again.npz')
    assert again == model and effects == ('sensor_gain:channel=top,scale=1.1',)


@pytest.mark.parametrize('time', ['discrete', 'continuous'])
def test_a_state_space_is_read_and_written(time, tmp_path):
    """The part a quarter of a period behind survives a file too."""
    turn = 0.99 * np.array([[np.cos(0.4), np.sin(0.4)], [-np.sin(0.4), np.cos(0.4)]])
    a = turn if time == 'discrete' else 20 * (turn - np.eye(2)) - np.eye(2)
    given = {**SHARED, 'a': a, 'b': [[1.0], [0.3]], 'c': np.array([[1.0, 0.2], [0.1, 1.0]]),
             'd': np.array([[0.5], [0.0]]), 'time': time}
    model, _ = load_model(write(tmp_path / 'm.npz', given))
    save_model(model, tmp_path / 'n.npz')
    assert load_model(tmp_path / 'n.npz')[0] == model
    z = np.exp(2j * np.pi * 1.7 / 20)
    if time == 'discrete':
        exact = given['c'] @ np.linalg.solve(z * np.eye(2) - a, given['b']) + given['d']
        np.testing.assert_allclose(assemble(model).transfer([1.7], 20.0)[0], exact, rtol=1e-9)


def test_a_configuration_holds_effects(tmp_path):
    """What `diagnose --apply` writes, `simulate --model` reads."""
    model, _ = load_model(write(tmp_path / 'm.npz', MATRICES))
    effect = parse_effect('point_mass:freedom=b,share=0.1')
    save_configuration(model, [effect], tmp_path / 'more.npz')
    assert load_configuration(tmp_path / 'more.npz') == (model, (effect,))
    with pytest.raises(ValueError, match='must end in .npz'):
        save_configuration(model, [effect], tmp_path / 'more.yaml')


def test_a_spacecraft_as_matrices_is_the_same_model(tmp_path):
    """Written by `ssi_ros model --npz` and read as somebody else's, it has the same spectrum."""
    system = assemble(load_spacecraft())
    save_system(system, tmp_path / 'craft.npz')
    f = np.linspace(0.1, 49.0, 300)
    np.testing.assert_allclose(output_spectrum(assemble(load_model(tmp_path / 'craft.npz')[0]), f),
                               output_spectrum(system, f), rtol=1e-9, atol=1e-20)


def without(name):
    """Return the variables but one."""
    return {k: v for k, v in MATRICES.items() if k != name}


@pytest.mark.parametrize('given, words', [
    (without('channels'), 'channels is missing; give the name of every channel'),
    (without('freedoms'), 'freedoms is missing; give the name of every row of mass'),
    (without('inputs'), 'inputs is missing'), (without('levels'), 'levels is missing'),
    (without('kinds'), 'kinds is missing; give what every channel measures'),
    (without('rate_hz'), 'rate_hz is missing'), (without('output'), 'output is missing'),
    (without('damping_ratios'), 'damping is missing; give the matrix, or damping_ratios'),
    ({**MATRICES, 'kinds': ['speed', 'speed']}, "kind 'speed'; known: acceleration"),
    ({**MATRICES, 'kinds': ['strain'] * 3}, '3 kinds for 2 channels'),
    ({**MATRICES, 'noise_rms': [1, 2, 3]}, 'noise_rms holds 3 numbers for low, top'),
    ({**MATRICES, 'stifness': 1}, 'stifness is not known; did you mean stiffness'),
    ({**MATRICES, 'a': np.eye(2)}, 'give one of: mass, damping, stiffness'),
    ({**MATRICES, 'mass': np.eye(2) * 1j}, 'mass holds complex128 values'),
    (SHARED, 'give one of: mass, damping, stiffness'),
    ({**MODES, 'damping_ratios': [0.1] * 3}, 'there are 2 frequencies_hz, but 3 damping_ratios'),
    ({**MODES, 'frequencies_hz': [0.0, 1.0]}, 'leave out rigid modes')])
def test_a_file_that_is_wrong_is_refused(given, words, tmp_path):
    """One sentence with the name of the file."""
    path = write(tmp_path / 'm.npz', given)
    with pytest.raises(ValueError, match=words) as error:
        load_model(path)
    assert str(error.value).startswith(str(path))


@pytest.mark.parametrize('name', ['m.npz', 'm.mat'])
def test_what_is_no_model_at_all(name, tmp_path):
    """A text, and a file that is not there."""
    (tmp_path / name).write_text('mass: 1')
    with pytest.raises(ValueError, match='it is no'):
        load_model(tmp_path / name)
    with pytest.raises(OSError):
        load_model(tmp_path / f'no_{name}')


def test_a_matlab_file_that_crashes_its_reader_is_refused(tmp_path, monkeypatch):
    """The process that reads it ends by a signal; this one says so, and goes on."""
    python = tmp_path / 'python'
    python.write_text('#!/bin/sh\nkill -SEGV $$\n')
    python.chmod(0o755)
    monkeypatch.setattr(sys, 'executable', str(python))
    with pytest.raises(ValueError, match='crashes the reader'):
        load_model(write(tmp_path / 'm.mat', MATRICES))


def test_an_archive_that_lies_is_refused(tmp_path):
    """512 MiB of zeros in half a megabyte, Python objects: one sentence, no memory taken."""
    path = tmp_path / 'm.npz'
    np.savez(path, mass=np.array([{}], dtype=object))
    with pytest.raises(ValueError, match='mass holds neither numbers nor texts'):
        load_model(path)
    with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED) as file:
        with file.open('mass.npy', 'w') as member:
            np.lib.format.write_array_header_1_0(
                member, {'descr': '<f8', 'fortran_order': False, 'shape': (1 << 26,)})
            for _ in range(512):
                member.write(bytes(1 << 20))
    with pytest.raises(ValueError, match='a file of its size may hold'):
        load_model(path)
