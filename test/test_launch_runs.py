"""Every launch file runs: real processes with the arguments and the ends that it names."""
import os
import signal
import time

from launch_reader import Launch, ROOT
import numpy as np
import pytest
from ssi_ros.bag import open_bag, write_samples
from ssi_ros.records import Samples
import yaml

pytest.importorskip('rclpy', reason='ROS 2 is not installed')
PATIENCE_S = 90.0
NAMES = ('e1_a', 'e1_b', 'e2_a', 'e2_b')


@pytest.fixture
def launched(tmp_path):
    """Return a function that starts a launch file; all its processes end with the test."""
    running = []

    def start(name, **given):
        environment = dict(os.environ, ROS_LOG_DIR=str(tmp_path))
        launch = Launch(ROOT / 'launch' / f'{name}.launch.py', given, tmp_path, environment)
        running.append(launch)
        return launch.start()
    yield start
    for launch in running:
        launch.shut_down('end of the test')


def noise_bag(path, seconds=150.0):
    """Write a bag of white noise of four accelerometers."""
    values = np.random.default_rng(3).standard_normal((round(seconds * 100), 4))
    write_samples(path, Samples(values, 100.0, NAMES, 10 ** 18))
    return str(path)


def parameters(launch, name):
    """Return what a node of a launch gets beside its configuration file."""
    out = {}
    for path in launch.commands[name]:
        if path.startswith(str(launch.folder)):
            with open(path) as file:
                out |= yaml.safe_load(file)['/**']['ros__parameters']
    return out


@pytest.mark.parametrize('name, given, node, expected', [
    ('replay', {'bag': '7', 'rate': '10'}, 'player', {'bag': '7', 'rate': 10.0, 'loop': False}),
    ('monitor', {'speed': '8'}, 'recorder', {'use_sim_time': True, 'bag': ''}),
    ('monitor', {}, 'identifier', {'use_sim_time': False, 'reliable': True}),
    ('monitor', {'simulate': 'false'}, 'identifier', {'reliable': False}),
    ('diagnose', {}, 'gap', {'use_sim_time': False, 'reliable': False, 'lateness_s': 1.0}),
    ('diagnose', {'bag': 'b'}, 'gap', {'use_sim_time': True, 'reliable': True,
                                       'lateness_s': 60.0, 'window_s': 600.0}),
    ('diagnose', {'bag': 'b', 'reliable': 'false'}, 'gap', {'reliable': False})])
def test_arguments_become_parameters(tmp_path, name, given, node, expected):
    """An argument reaches its node with the type of the parameter, `auto` as it says."""
    launch = Launch(ROOT / 'launch' / f'{name}.launch.py', given, tmp_path)
    found = parameters(launch, node)
    assert {k: found[k] for k in expected} == expected
    assert [type(found[k]) for k in expected] == [type(v) for v in expected.values()]
    assert ('player' in launch.nodes) == ('bag' in given)
    assert ('simulator' in launch.nodes) == (name == 'monitor' and 'simulate' not in given)


def test_an_argument_without_default_is_asked_for(tmp_path):
    """Replay needs a bag."""
    with pytest.raises(RuntimeError, match="required launch argument 'bag'"):
        Launch(ROOT / 'launch' / 'replay.launch.py', {}, tmp_path)


def test_replay_ends_with_the_bag_and_loses_nothing(launched, tmp_path):
    """At 40 times real time all samples arrive; the player's end ends the identifier."""
    launch = launched('replay', bag=noise_bag(tmp_path / 'bag'), rate='40')
    assert launch.wait(PATIENCE_S) == {'player': 0, 'identifier': 0}
    assert launch.reason == 'the player has ended'
    said = (tmp_path / 'identifier.txt').read_text()
    assert 'received [15000, 15000, 15000, 15000], missing [0, 0, 0, 0]' in said


@pytest.mark.slow
def test_monitor_ends_with_the_recorder(launched, tmp_path):
    """What is simulated is recorded without a loss; without the recorder nothing goes on."""
    bag = tmp_path / 'bag'
    launch = launched('monitor', bag=str(bag), speed='20')
    with pytest.raises(TimeoutError):
        launch.wait(20.0)
    assert sorted(launch.running) == ['identifier', 'recorder', 'simulator']
    launch.running['recorder'].send_signal(signal.SIGINT)
    assert launch.wait(PATIENCE_S) == {'recorder': 0, 'identifier': 0, 'simulator': 0}
    assert launch.reason.startswith('the recorder has ended')
    counts = {t.name: t.count for t in open_bag(bag).topics
              if t.name.startswith('/accelerometer/')}
    # 20 s hold 400 s at most; a busy machine may take half of them to start
    assert len(counts) == 4 and min(counts.values()) > 1000


@pytest.mark.slow
def test_diagnose_plays_its_bag_to_both_readers(launched, tmp_path):
    """Gap node and identifier get every sample; both go on when the bag has ended."""
    launch = launched('diagnose', bag=noise_bag(tmp_path / 'bag'), rate='40', window_s='120')
    end = time.monotonic() + PATIENCE_S
    while 'player' not in launch.codes:           # it waits for the slower of the two readers
        assert launch.step() and time.monotonic() < end
        time.sleep(0.1)
    with pytest.raises(TimeoutError):
        launch.wait(3.0)
    assert launch.codes == {'player': 0} and sorted(launch.running) == ['gap', 'identifier']
    launch.shut_down('test')
    assert launch.codes == {'player': 0, 'gap': 0, 'identifier': 0}
    said = (tmp_path / 'identifier.txt').read_text()
    assert 'received [15000, 15000, 15000, 15000], missing [0, 0, 0, 0]' in said
    assert 'window 120 s' in (tmp_path / 'gap.txt').read_text()
