"""The gap node as a process: live, replayed and offline agree; alarm, diagnosis, bad starts."""
import json
import signal

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.srv import GetState
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from ssi_ros.bag import write_samples
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.online.calibration import LiveSettings, prepare
from ssi_ros.gap.online.stream import LiveStream
from ssi_ros.identify.grid import Grid
from ssi_ros.model import load_spacecraft
from ssi_ros.ros.gap_messages import numbers_of
from ssi_ros.ros.messages import stamp_of
from std_msgs.msg import Bool, Float64, String
from std_srvs.srv import Trigger

EFFECT = 'sensor_gain:channel=e1_b,scale=1.1'
WATCHED = ('sensor_gain', 'damping_scale')
SECONDS, SEED, START_S = 61.0, 6, 100.0
SETTINGS = LiveSettings(window_s=30.0, hop_s=10.0)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PREPARED_S = 300.0          # the templates are made at the start, on a machine that may be busy


@pytest.fixture(scope='module')
def record():
    """Return the record that the simulator publishes for the seed."""
    setup = inject(load_spacecraft(), [parse_effect(EFFECT)], SECONDS)
    return simulate_setup(setup, SEED, start_ns=round(START_S * 1e9))


@pytest.fixture(scope='module')
def offline(record):
    """Return the updates of the record by their end, computed without nodes."""
    model = prepare(load_spacecraft(), SETTINGS, effects=WATCHED)
    grid, stream = Grid(record.channels, record.rate_hz), LiveStream(
        model, record.channels, SETTINGS)
    for c in range(len(record.channels)):
        grid.push(c, record.stamps_ns(), record.values[:, c])
    return {u.end_ns: u for rows in grid.rows(flush=True) for u in stream.push(rows)}


def gap_node(bench, **more):
    """Start a gap node on the simulator's channels; return its results as they come."""
    where = bench.collect(DiagnosticArray, '/gap/where')
    bench.processes.start('gap', 'gap', **{
        'reliable': True, 'window_s': SETTINGS.window_s, 'hop_s': SETTINGS.hop_s,
        'effects': WATCHED, 'expected_rate_hz': 4000.0, 'pairs': False,
        'lateness_s': 60.0, **more})
    return where


def simulator(bench, **more):
    """Start the simulator of the record."""
    bench.processes.start('simulator', 'simulator', **{
        'effects': [EFFECT], 'seed': SEED, 'start_s': START_S, 'duration_s': SECONDS,
        'speed': 10.0, 'reliable': True, 'wait_for_subscribers': 1, **more})


def compare(messages, offline):
    """Compare what the node published with the offline updates."""
    assert [stamp_of(m.header.stamp) for m in messages] == list(offline)
    # a starved machine loses samples over DDS, reliable or not: then there is nothing to compare
    lost = [r for m in messages if 'misses' in (r := numbers_of(m)['window']['reason'])]
    assert not lost, f'samples were lost on the way: {lost}'
    for message, update in zip(messages, offline.values()):
        told = numbers_of(message)
        # a record in blocks differs by 1e-12 of itself, the fit of the levels stops within 1e-6
        for name, value in (('gap', update.value), ('floor', update.floor),
                            ('deviations', update.deviations)):
            assert float(told['window'][name]) == pytest.approx(value, rel=1e-5)
        assert {s: float(v) for s, v in told['site'].items()} == pytest.approx(
            update.sites, abs=1e-4)
        assert told['leading effect']['effect'] == update.leading
        assert float(told['leading effect']['z']) == pytest.approx(update.leading_z, rel=1e-4)
        assert int(told['alarm']['raised_ns']) == (update.raised_ns or -1)


def test_live_is_offline_with_alarm(bench, offline):
    """The simulator's samples give the offline updates; the alarm is latched until it is reset."""
    gaps = bench.collect(Float64, '/gap/gap')
    health = bench.collect(DiagnosticArray, '/diagnostics')
    where = gap_node(bench)
    simulator(bench)
    bench.wait(lambda: len(where) == len(offline), PREPARED_S)
    compare(where, offline)
    last = offline[max(offline)]
    assert last.raised_ns is not None and last.leading == 'sensor_gain'
    assert gaps[-1].data == pytest.approx(last.value, rel=1e-5)          # as above
    late = bench.collect(Bool, '/gap/alarm', LATCHED)
    bench.wait(lambda: late and late[-1].data)
    health.clear()

    def said(name):
        return next((s for m in health for s in m.status if s.name == f'gap: {name}'), None)
    bench.wait(lambda: said('alarm') is not None)
    assert said('alarm').message.startswith('raised at 1') and said('channel e1_a') is not None
    assert 'sd above the floor' in said('gap').message
    assert bench.call(Trigger, '/gap/reset_alarm', Trigger.Request()).success
    bench.wait(lambda: not late[-1].data)
    assert not bench.call(Trigger, '/gap/reset_alarm', Trigger.Request()).success


@pytest.mark.slow
def test_replay_is_offline(bench, tmp_path, record, offline):
    """A bag of the record, played by the player node, gives the same updates."""
    write_samples(tmp_path / 'bag', record)
    where = gap_node(bench)
    bench.processes.start('player', 'player', bag=tmp_path / 'bag', rate=10.0, reliable=True,
                          wait_for_subscribers=1, topics=['/accelerometer/.*'])
    bench.wait(lambda: len(where) == len(offline), PREPARED_S)
    compare(where, offline)


def test_diagnose_answers_and_the_node_goes_on(bench):
    """The verdict comes in the reply and on the topic; meanwhile other calls are answered."""
    gap_node(bench, record_s=30.0, hop_s=30.0)
    refused = bench.call(Trigger, '/gap/diagnose', Trigger.Request())
    assert not refused.success and 'no samples yet' in refused.message
    simulator(bench, duration_s=35.0)
    assert bench.ended('simulator', PREPARED_S) == 0
    client = bench.node.create_client(Trigger, '/gap/diagnose')
    bench.wait(client.service_is_ready)
    answer = client.call_async(Trigger.Request())
    # a request may arrive long after it was sent, when the server has learnt of its client
    health = bench.collect(DiagnosticArray, '/diagnostics')
    bench.wait(lambda: answer.done() or any(
        v.key == 'diagnosis' and v.value != 'none'
        for m in health for s in m.status for v in s.values), what='for the diagnosis to begin')
    state = bench.call(GetState, '/gap/get_state', GetState.Request())
    assert state.current_state.label == 'active'
    second = bench.call(Trigger, '/gap/diagnose', Trigger.Request())
    if not answer.done():
        assert not second.success and 'a diagnosis runs' in second.message
    bench.wait(answer.done, PREPARED_S)
    reply = answer.result()
    assert reply.success, reply.message
    found = json.loads(reply.message)
    assert found['schema'] == 'ssi_ros/diagnosis/1'
    assert found['verdict']['effects'] == ['sensor_gain']
    latched = bench.collect(String, '/gap/diagnosis', LATCHED)
    bench.wait(lambda: latched)
    assert json.loads(latched[0].data) == found


def test_it_ends_while_it_prepares(bench):
    """SIGINT in the midst of the preparation: a clean end, soon."""
    gap_node(bench, effects=[''])
    health = bench.collect(DiagnosticArray, '/diagnostics')
    bench.wait(lambda: any('preparing' in s.message for m in health for s in m.status),
               PREPARED_S)
    bench.processes.running['gap'].send_signal(signal.SIGINT)
    assert bench.ended('gap') == 0                 # within the bench's patience of 30 s
    assert 'Traceback' not in bench.words('gap')


@pytest.mark.parametrize('settings, words', [
    ({'channels': ['/a', '/b']}, 'the model also has e1_a, e1_b, e2_a, e2_b'),
    ({'effects': ['sensor_gian']}, 'did you mean sensor_gain'),
    ({'model': '/no/such.yaml'}, 'No such file'),
    ({'diagnosis': '/no/such.yaml'}, 'No such file'),
    ({'window_s': 20.0, 'hop_s': 30.0}, 'window_s=20 is shorter than hop_s=30')])
def test_bad_start_is_told(bench, settings, words):
    """A wrong parameter ends the node at once with exit code 2 and no traceback."""
    gap_node(bench, **settings)
    assert bench.ended('gap', PREPARED_S) == 2
    assert words in bench.words('gap') and 'Traceback' not in bench.words('gap')
