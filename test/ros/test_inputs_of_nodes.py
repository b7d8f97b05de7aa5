"""The simulator publishes what it draws, and the gap node diagnoses beside it: real processes."""
import json

from geometry_msgs.msg import WrenchStamped
import numpy as np
import pytest
from ssi_ros.cli._inputs import simulated_inputs
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.model import assemble, Channel, Input, modal_model, save_model
from ssi_ros.ros.messages import stamp_of
from ssi_ros.ros.recorded_inputs import channel_of_input
from std_srvs.srv import Trigger

EFFECT, SECONDS, SEED, START_S = 'sensor_gain:channel=tip,scale=1.1', 122.0, 3, 100.0
MODEL = modal_model([2.0, 5.0], 0.02, [[1.0, 0.6]], [[1.0, 0.2], [0.7, 0.5]], rate_hz=50.0,
                    drives=(Input('motor', 1.0), Input('wind', 0.1)),
                    sensors=(Channel('tip', noise_rms=0.02),))
PATIENCE_S = 300.0
MOTOR = '/input/motor:wrench.force.x'


@pytest.fixture
def model(tmp_path):
    """Return the file of the model."""
    save_model(MODEL, tmp_path / 'model.npz')
    return str(tmp_path / 'model.npz')


def simulator(bench, model):
    """Start the simulator of a gain that only the input shows."""
    bench.processes.start('simulator', 'simulator', **{
        'config': model, 'effects': [EFFECT], 'seed': SEED, 'start_s': START_S,
        'duration_s': SECONDS, 'speed': 15.0, 'reliable': True, 'wait_for_subscribers': 1,
        'record_input': True})


def gap_node(bench, model, inputs):
    """Start the gap node beside some inputs."""
    bench.processes.start('gap', 'gap', **{
        'model': model, 'channels': ['{topic: accelerometer/tip}'], 'inputs': inputs,
        'reliable': True, 'window_s': 40.0, 'hop_s': 20.0, 'effects': ('sensor_gain',),
        'pairs': False, 'record_s': 120.0, 'lateness_s': 60.0})


@pytest.mark.slow
def test_a_gain_that_only_the_input_shows(bench, model):
    """The inputs are those of `simulate --record-input`; ~/diagnose names the gain by them."""
    sent = bench.collect(WrenchStamped, '/input/motor', 10000)
    gap_node(bench, model, [MOTOR])
    simulator(bench, model)
    assert bench.ended('simulator', PATIENCE_S) == 0
    answer = bench.node.create_client(Trigger, '/gap/diagnose')
    bench.wait(answer.service_is_ready)
    future = answer.call_async(Trigger.Request())
    bench.wait(future.done, PATIENCE_S)
    assert future.result().success, future.result().message
    found = json.loads(future.result().message)
    assert found['verdict']['effects'] == ['sensor_gain']
    setup = inject(MODEL, [parse_effect(EFFECT)], SECONDS)
    wanted = simulated_inputs(setup, assemble(MODEL).excitation, simulate_setup(setup, SEED), SEED)
    at = [round((stamp_of(m.header.stamp) * 1e-9 - START_S) * 50.0) for m in sent]
    assert len(at) > 1000
    assert [m.wrench.force.x for m in sent] == pytest.approx(
        wanted.values[at, 0], abs=1e-9 * np.abs(wanted.values).max())


@pytest.mark.slow
def test_an_input_that_does_not_come_is_said(bench, model):
    """The diagnosis is refused in one sentence that names the topic."""
    gap_node(bench, model, ['/nowhere:wrench.force.x=motor'])
    simulator(bench, model)
    assert bench.ended('simulator', PATIENCE_S) == 0
    reply = bench.call(Trigger, '/gap/diagnose', Trigger.Request())
    assert not reply.success
    assert 'no diagnosis: the input /nowhere:wrench.force.x has 0 values' in reply.message


@pytest.mark.parametrize('text, said', [
    (':wrench.force.x', 'must be /topic:field'), ('/t:mass.x', 'must be /topic:field'),
    ('/t:wrench.force.x=sail', "no input 'sail'")])
def test_entries_that_cannot_be_read(text, said):
    """One sentence each."""
    with pytest.raises(ValueError, match=said):
        channel_of_input(text, MODEL)


def test_types_of_fields():
    """A field says of which message it is; a mapping names any, as in `channels`."""
    assert channel_of_input('/input/motor', MODEL).type == 'std_msgs/msg/Float64'
    assert channel_of_input('/all:data[1]=wind', MODEL).type == 'std_msgs/msg/Float64MultiArray'
    found = channel_of_input('{topic: /motor, type: sensor_msgs/msg/JointState, '
                             'field: "effort[0]", name: motor}', MODEL)
    assert (found.name, found.field) == ('motor', 'effort[0]')
