"""`ssi_ros doctor` on graphs of real nodes: what is right is ok, each fault has a fix."""
import json
import os
import subprocess
import sys
import time

from geometry_msgs.msg import AccelStamped
from node_records import LISTEN
import pytest
from rclpy.qos import QoSProfile
from ssi_ros.ros.doctor import machine
from ssi_ros.ros.messages import time_of


def doctor(*words, **environment):
    """Run the verb in a process of its own; return its exit code and its findings."""
    done = subprocess.run(
        [sys.executable, '-m', 'ssi_ros', 'doctor', '--json', '--seconds', '2', *words],
        capture_output=True, text=True, timeout=60, env={**os.environ, **environment})
    assert not done.stderr, done.stderr
    return done.returncode, [(f['level'], f['what'], f['text'], f['fix'])
                             for f in json.loads(done.stdout)]


def with_words(findings, level, words):
    """Return the findings of a level with these words; each that is not ok has a fix."""
    assert all(fix for found, _, _, fix in findings if found != 'ok')
    return [text for found, _, text, _ in findings if found == level and words in text]


def test_a_right_set_up_is_ok(bench, tmp_path):
    """Simulator, identifier and recorder as they come: no error, rates and pairs are named."""
    bench.processes.start('identifier', 'identifier')
    bench.processes.start('recorder', 'recorder', bag=tmp_path / 'bag')
    # reliable: a busy machine loses nothing
    bench.processes.start('simulator', 'simulator', wait_for_subscribers=2, reliable=True)
    got = bench.collect(AccelStamped, '/accelerometer/e1_a', LISTEN)
    bench.wait(lambda: len(got) > 50)
    code, findings = doctor('--folder', str(tmp_path))
    assert code == 0, findings
    assert len(with_words(findings, 'ok', '100.00 Hz by its stamps')) == 4, findings
    assert with_words(findings, 'ok', 'each name once') and with_words(findings, 'ok', 'jazzy')
    assert with_words(findings, 'ok', 'MB/s, synced')


def test_faults_are_named_with_a_fix(bench):
    """Two nodes of one name, a QoS that never connects, a clock that nobody publishes."""
    bench.processes.start('identifier', 'identifier', reliable=True)
    bench.processes.start('twin', 'identifier', remaps=['__node:=identifier'], channels=['/a'],
                          use_sim_time=True)
    bench.processes.start('simulator', 'simulator')
    got = bench.collect(AccelStamped, '/accelerometer/e1_a', LISTEN)
    bench.wait(lambda: len(got) > 50
               and bench.node.count_subscribers('/accelerometer/e1_a') > 1)
    bench.wait(lambda: bench.node.get_node_names().count('identifier') == 2)
    code, findings = doctor()
    assert code == 1, findings
    assert with_words(findings, 'error', 'more than one node is named /identifier')
    assert with_words(findings, 'error', '/accelerometer/e1_a: simulator and identifier never '
                      'connect (Best effort publisher and reliable subscription)')


@pytest.mark.slow
def test_clocks_are_compared(bench):
    """Simulated time that nobody publishes is an error, a node that does not use it a warning."""
    bench.processes.start('waiting', 'identifier', use_sim_time=True)
    bench.wait(lambda: 'waiting for 4' in bench.words('waiting'))
    _, findings = doctor()
    assert with_words(findings, 'error', '/waiting wait for simulated time, and nobody publishes')
    bench.processes.start('simulator', 'simulator', publish_clock=True)
    bench.processes.start('identifier', 'identifier')
    bench.wait(lambda: 'watching' in bench.words('identifier'))
    _, findings = doctor()
    assert with_words(findings, 'warn', 'simulator publishes /clock, but')
    assert '/identifier' in with_words(findings, 'warn', 'publishes /clock, but')[0]
    # stamps of simulated time are no fault of the clocks
    assert len(with_words(findings, 'ok', 'by its stamps, in simulated time')) == 4, findings


def test_samples_that_are_missing_or_badly_stamped(bench):
    """A tenth of the samples missing, stamps of 0, stamps an hour ago: each topic says its own."""
    publishers = {n: bench.node.create_publisher(AccelStamped, f'/{n}', QoSProfile(depth=1000))
                  for n in ('lossy', 'empty', 'old')}
    process = subprocess.Popen([sys.executable, '-m', 'ssi_ros', 'doctor', '--seconds', '3'],
                               stdout=subprocess.PIPE, text=True)
    k, began = 0, time.time_ns()
    while process.poll() is None:
        now = began + k * 20_000_000
        for name, publisher in publishers.items():
            message = AccelStamped()
            message.header.stamp = time_of({'lossy': now, 'empty': 0,
                                            'old': now - 3600 * 10 ** 9}[name])
            if name != 'lossy' or k % 10:
                publisher.publish(message)
        k += 1
        bench.executor.spin_once(timeout_sec=0.0)
        time.sleep(max(0.0, (now + 20_000_000 - time.time_ns()) * 1e-9))
    text = process.stdout.read()
    lines = {line.split()[2].rstrip(':'): line for line in text.splitlines() if 'samples' in line}
    assert lines['/lossy'].startswith('warn') and 'missing' in lines['/lossy']
    assert 'no header stamps' in lines['/empty'], text
    assert ', stamped 3600' in lines['/old'] and 's ago' in lines['/old'], text
    assert '\033' not in text                      # a pipe gets no colour


def test_machine_that_cannot_record(tmp_path, monkeypatch):
    """No folder is refused; another distribution of ROS and a missing extra are warned of."""
    with pytest.raises(ValueError, match='is no folder'):
        machine(tmp_path / 'no')
    monkeypatch.setenv('ROS_DISTRO', 'humble')
    monkeypatch.delenv('FASTDDS_BUILTIN_TRANSPORTS', raising=False)
    monkeypatch.delenv('FASTRTPS_DEFAULT_PROFILES_FILE', raising=False)
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    found = {f.what: f for f in machine(tmp_path)}
    assert found['ROS 2'].level == 'warn' and 'jazzy/setup.bash' in found['ROS 2'].fix
    assert found['middleware'].level == 'warn' and 'UDPv4' in found['middleware'].fix
    monkeypatch.setenv('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')
    assert {f.what: f for f in machine(tmp_path)}['middleware'].level == 'ok'
    # this range adds shared memory whatever the other variable says
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    found |= {f.what: f for f in machine(tmp_path)}
    assert found['middleware'].level == 'warn' and 'loopback_udp.xml' in found['middleware'].fix
    assert found['write speed'].level in ('ok', 'warn') and not list(tmp_path.iterdir())
