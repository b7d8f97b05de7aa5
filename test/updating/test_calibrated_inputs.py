"""Calibration on recordings whose input was recorded: what it makes of them is predicted."""
from dataclasses import replace

import craft
import numpy as np
import pytest
from ssi_ros.bag import write_samples
from ssi_ros.cli._inputs import simulated_inputs
from ssi_ros.cli.main import main
from ssi_ros.effects import inject, parse_effect, save_configuration, simulate_setup
from ssi_ros.model import assemble
from ssi_ros.updating.calibrate import calibrate

TORQUE = '/input/torque_x:wrench.torque.x'


def shaken(spacecraft):
    """Return a spacecraft under a torque that makes half of its motion."""
    return replace(spacecraft, excitation=replace(
        spacecraft.excitation, torque_rms_n_m=(2.0, 0.0, 0.0)))


def recorded(seed, *texts):
    """Return a record of the twin under the torque, and the torque."""
    twin = shaken(craft.twin())
    setup = inject(twin, [parse_effect(t) for t in texts], craft.SECONDS)
    samples = simulate_setup(setup, seed)
    return samples, simulated_inputs(setup, assemble(twin).excitation, samples, seed)


@pytest.mark.slow
def test_a_recorded_torque_tells_more_of_the_model():
    """Damping and shapes are known better, within what is said of them."""
    samples, inputs = recorded(10)
    model, truth = shaken(craft.model()), np.array(craft.twin().calibration.values)
    plain, beside = (calibrate(model, [samples], inputs=i) for i in ((), (inputs,)))
    known = [np.sqrt(np.diag(c.fit.covariance)) for c in (plain, beside)]
    kinds = np.array([n.split()[0] for n in beside.fit.names])
    for kind, less in (('damping', 0.95), ('shape', 0.85)):
        at = kinds == kind
        assert known[1][at].mean() < less * known[0][at].mean()
    z = (beside.fit.values - truth) / known[1]
    assert np.sqrt(np.mean(z ** 2)) < 1.4 and beside.explains
    assert model.excitation == beside.spacecraft.excitation     # its levels are kept


def test_a_wrong_sign_of_the_input_is_not_calibrated_upon():
    """One sentence, and no model."""
    samples, inputs = recorded(10)
    with pytest.raises(ValueError, match='torque_x has a wrong sign.*Nothing is calibrated'):
        calibrate(shaken(craft.model()), [samples],
                  inputs=[replace(inputs, values=-inputs.values)])


@pytest.mark.slow
def test_verbs_calibrate_beside_the_input(tmp_path, capsys):
    """`calibrate --input`, then `diagnose`, and both at once with --reference."""
    model, out = tmp_path / 'model.yaml', tmp_path / 'calibrated.yaml'
    save_configuration(shaken(craft.model()), (), model)
    for name, more in (('healthy', ()), ('heavy', ('hub_inertia:scale=1.1',))):
        samples, inputs = recorded(10 if not more else 11, *more)
        write_samples(tmp_path / name, samples, inputs=inputs)
    healthy, heavy = str(tmp_path / 'healthy'), str(tmp_path / 'heavy')
    assert main(['calibrate', healthy, '--model', str(model), '--output', str(out),
                 '--input', TORQUE]) == 0
    assert 'the calibrated model explains' in capsys.readouterr().out
    words = ['--effects', 'hub_inertia,sensor_gain', '--no-pairs', '--input', TORQUE]
    assert main(['diagnose', heavy, '--model', str(out), *words]) == 0
    one = capsys.readouterr().out
    assert main(['diagnose', heavy, '--model', str(model), '--reference', healthy, *words]) == 0
    assert one == capsys.readouterr().out and 'hub_inertia: scale' in one


def test_a_healthy_bag_without_the_input_is_named(tmp_path, capsys):
    """The sentence says which of the two bags lacks it."""
    model = tmp_path / 'model.yaml'
    save_configuration(shaken(craft.model()), (), model)
    samples, inputs = recorded(10)
    write_samples(tmp_path / 'record', samples, inputs=inputs)
    write_samples(tmp_path / 'healthy', samples)
    assert main(['diagnose', str(tmp_path / 'record'), '--model', str(model), '--reference',
                 str(tmp_path / 'healthy'), '--input', TORQUE]) == 2
    err = capsys.readouterr().err
    assert 'healthy: ' in err and '/input/torque_x' in err and 'Traceback' not in err
