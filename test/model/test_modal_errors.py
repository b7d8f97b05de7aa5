"""Errors of the modes of a model that somebody else has made."""
from dataclasses import replace

import numpy as np
import pytest
from scipy.io import savemat
from ssi_ros.model import (
    assemble, Channel, Input, LinearModel, load_model, modal_model, natural_modes, save_model,
    state_space_model)
from ssi_ros.model.channels import with_channels
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.model.modal_errors import basis_of, modal_uncertainty

DRIVES = Input('motor', 1.0), Input('wind', 0.5)
SENSORS = (Channel('acc', 'acceleration', 0.01), Channel('gyro', 'angular_rate', 0.01),
           Channel('laser', 'displacement', 0.01))
STDS = {'frequency': 0.01, 'damping': 0.3, 'participation': 0.03, 'shape': 0.03, 'gain': 0.001}


def matrices():
    """Return a chain of three masses by its matrices."""
    stiffness = 400.0 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1.5]])
    return LinearModel(
        np.diag([1.0, 2.0, 1.5]), 0.001 * stiffness, stiffness,
        np.array([[1.0, 0], [0, 0.5], [0, 1]]), np.array([[1.0, 0, 0], [0, 1, 0], [0, 0.5, 1]]),
        freedoms=('a', 'b', 'c'), drives=DRIVES, sensors=SENSORS, rate_hz=50.0)


def modes():
    """Return a model by its modes, not in their order."""
    return modal_model([5.0, 2.0], 0.02, [[1.0, 0.6], [0.4, -0.8], [0.2, 0.9]],
                       [[1.0, 0.3], [0.7, -0.5]], drives=DRIVES, sensors=SENSORS, rate_hz=50.0)


def states():
    """Return the second as a state space."""
    plant = assemble(modes()).plant
    return state_space_model(plant.a, plant.b, plant.c, plant.d, discrete=False, rate_hz=50.0,
                             drives=DRIVES, sensors=SENSORS)


EACH = pytest.mark.parametrize('make', [matrices, modes, states])


def wrong(model, name, value):
    """Return the system of a model with one error."""
    return assemble(replace(model, calibration=Calibration((name,), (value,))))


@EACH
def test_an_error_of_a_mode_is_of_that_mode_alone(make):
    """One per cent of a frequency, a third of a damping: the other modes stay."""
    model = make()
    plain = natural_modes(assemble(model))
    for name, of in (('frequency mode 2', 'frequencies_hz'), ('damping mode 2', 'damping_ratios')):
        found = natural_modes(wrong(model, name, 0.01))
        ratio = getattr(found, of) / getattr(plain, of)
        expected = np.where(np.arange(len(ratio)) == 1,
                            1.01 if of == 'frequencies_hz' else np.exp(0.01), 1.0)
        # damping is of viscous modes that the undamped ones describe to the square of its ratio
        assert ratio == pytest.approx(expected, abs=2e-4)


@EACH
def test_shape_participation_and_gain(make):
    """What one channel shows of one mode, what one input does to it, all that a channel shows."""
    model = make()
    basis = basis_of(model)[0]
    plain = assemble(model)
    shape = wrong(model, 'shape mode 1 gyro', 0.1).sensor @ basis
    ratio = np.where(plain.sensor @ basis == 0.0, 1.0, shape / (plain.sensor @ basis))
    wanted = np.ones(ratio.shape)
    wanted[1, 0] = 1.1
    assert ratio == pytest.approx(wanted, abs=1e-9)
    driven = basis.T @ wrong(model, 'participation mode 1 wind', 0.1).input
    wanted = np.array(basis.T @ plain.input)
    wanted[0, 1] *= 1.1
    assert driven == pytest.approx(wanted, abs=1e-9)
    assert wrong(model, 'gain laser', 0.1).chain[0].response(
        np.zeros(1), 3)[0] == pytest.approx(np.diag([1, 1, 1.1]))


@EACH
def test_a_file_keeps_what_is_declared_and_calibrated(make, tmp_path):
    """And a model without a channel is without what is said of it."""
    model = make()
    model = replace(model, uncertainty=modal_uncertainty(model, **STDS))
    names, stds = declared(model)
    model = replace(model, calibration=Calibration(
        names, 0.1 * stds, np.diag(stds ** 2), ('healthy',), ('a line',)))
    save_model(model, tmp_path / 'model.npz')
    found, _ = load_model(tmp_path / 'model.npz')
    assert found.uncertainty == model.uncertainty and found.calibration == model.calibration
    fewer = with_channels(found, ['acc', 'laser'])
    assert declared(fewer)[0] == fewer.calibration.names
    assert not any('gyro' in n for n in fewer.calibration.names)
    assemble(fewer)


@pytest.mark.parametrize('coupling, close', [(0.5, False), (4.0, True)])
def test_shapes_of_close_modes_err_as_their_frequencies_do(coupling, close):
    """Two pendulums that hardly know of each other, each softer or stiffer by 1 %."""
    def pair(one, two, joint=coupling):
        return LinearModel(
            np.eye(2), 0.1 * np.eye(2), np.diag([400.0 * one, 400.0 * two]) + (
                400.0 / joint ** 2 * np.array([[1.0, -1], [-1, 1]])), np.eye(2), np.eye(2),
            freedoms=('a', 'b'), drives=DRIVES, sensors=SENSORS[:2], rate_hz=50.0)
    given = dict(zip(*declared(replace(pair(1, 1), uncertainty=modal_uncertainty(
        pair(1, 1), frequency=0.005, shape=0.01, participation=0.0)))))
    assert (given['shape mode 1 acc'] > 0.01) == close
    rng = np.random.default_rng(3)
    found = [basis_of(pair(*(1 + 0.01 * rng.standard_normal(2))))[0] for _ in range(400)]
    # of mode 1, what the first channel shows of it
    spread = np.std([abs(shapes[0, 0]) for shapes in found]) * np.sqrt(2)
    assert given['shape mode 1 acc'] > 0.7 * spread
    assert 'participation mode 1 motor' not in given


def test_single_modes_and_a_struct_of_matlab(tmp_path):
    """One number for all, or an array with one for each; 0 is exact."""
    model = modes()
    save_model(model, tmp_path / 'model.npz')
    plain = dict(np.load(tmp_path / 'model.npz'))
    cells = {k: v.astype(object) if v.dtype.kind == 'U' else v for k, v in plain.items()
             if v.size}
    savemat(tmp_path / 'model.mat', cells | {
        'uncertainty': {'frequency': [0.02, 0.0], 'participation': [0.1, 0.0]}})
    found, _ = load_model(tmp_path / 'model.mat')
    assert declared(found)[0] == (
        'frequency mode 1', 'participation mode 1 motor', 'participation mode 1 wind')


@pytest.mark.parametrize('given, said', [
    ({'frequency': [0.01, 0.02, 0.03]}, 'uncertainty_frequency has the shape'),
    ({'shape': -0.1}, 'uncertainty_shape holds -0.1'), ({'gain': np.inf}, 'gain holds inf'),
    ({'hub_inertia': 0.1}, 'hub_inertia and sensor_place_m need the geometry'),
    ({'frequancy': 0.1}, 'frequency')])
def test_what_cannot_be_declared(given, said):
    """One sentence."""
    with pytest.raises(ValueError, match=said):
        modal_uncertainty(modes(), **given)


@pytest.mark.parametrize('name', ['frequency mode 9', 'frequency mode 0', 'shape mode 1 nose',
                                  'gain nose', 'hub_inertia x', 'frequency E1 1'])
def test_an_error_of_nothing_that_is_there(name):
    """A calibration of another model."""
    with pytest.raises(ValueError, match='is not known|not of this model'):
        wrong(modes(), name, 0.01)


def test_a_quiet_input_may_err_too():
    """A recorded input has no random level of its own, and is still wrong in the model."""
    model = modes()
    model = replace(model, uncertainty=modal_uncertainty(model, **STDS))
    quiet = replace(model, drives=(replace(DRIVES[0], level=0.0), DRIVES[1]))
    assert declared(quiet)[0] == declared(model)[0]
