"""The bridge: a WebSocket client that gets the true messages, and layouts that fit the topics."""
import json
import os
from pathlib import Path
import re
import struct
import time
import xml.etree.ElementTree as ElementTree

import pytest

from ssi_ros.bag import definition_of, field_reader

CONFIG = Path(__file__).resolve().parents[2] / 'config'
TYPES = {'/accelerometer/': 'geometry_msgs/msg/AccelStamped', '/identifier/modes':
         'diagnostic_msgs/msg/DiagnosticArray', '/identifier/': 'std_msgs/msg/Float64MultiArray',
         '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray', '/gap/': 'std_msgs/msg/Float64'}


def type_of(topic):
    """Return the type of a topic of this package."""
    return next(t for prefix, t in TYPES.items() if topic.startswith(prefix))


class Client:
    """A client of the Foxglove WebSocket protocol, as much of it as a viewer needs."""

    def __init__(self, socket):
        self.socket, self.channels, self.messages = socket, {}, []

    def listen(self, until, patience_s=30.0):
        """Take what comes until a condition holds."""
        end = time.monotonic() + patience_s
        while not until():
            assert time.monotonic() < end, f'waited {patience_s} s in vain'
            try:
                frame = self.socket.recv(timeout=0.2)
            except TimeoutError:
                continue
            if isinstance(frame, bytes):
                if frame[0] == 1:            # message data: id of subscription, time, payload
                    self.messages.append((*struct.unpack_from('<IQ', frame, 1), frame[13:]))
                continue
            message = json.loads(frame)
            if message['op'] == 'advertise':
                self.channels.update({c['topic']: c for c in message['channels']})

    def subscribe_until_heard(self, number, topic):
        """Subscribe again and again: the server may not know yet what it has advertised."""
        end = time.monotonic() + 30.0
        while not self.messages:
            assert time.monotonic() < end, f'nothing of {topic}'
            self.subscribe(number, topic)
            again = time.monotonic() + 3.0
            self.listen(lambda: self.messages or time.monotonic() > again)

    def subscribe(self, number, topic):
        """Look at a topic."""
        self.socket.send(json.dumps({'op': 'subscribe', 'subscriptions': [
            {'id': number, 'channelId': self.channels[topic]['id']}]}))


def test_client_gets_the_true_messages(tmp_path):
    """What arrives on the WebSocket is what the simulator of that seed publishes, to the bit."""
    for name in ('rclpy', 'foxglove', 'websockets'):
        pytest.importorskip(name, reason=f'{name} is not installed')
    from ssi_ros.model import assemble, load_spacecraft, simulate
    from ssi_ros.ros.demo import Processes
    from websockets.sync.client import connect
    nodes, topic = Processes(tmp_path / 'log'), '/accelerometer/e1_b'
    try:
        nodes.start('bridge', 'bridge', port=0)
        nodes.start('simulator', 'simulator', seed=11, reliable=True)
        port = None
        end = time.monotonic() + 30.0
        while not port:
            nodes.check()
            port = re.search(r'ws://127\.0\.0\.1:(\d+)', (tmp_path / 'log/bridge.txt').read_text())
            assert time.monotonic() < end
            time.sleep(0.05)
        with connect(f'ws://127.0.0.1:{port[1]}', subprotocols=['foxglove.sdk.v1']) as socket:
            client = Client(socket)
            client.listen(lambda: topic in client.channels)
            channel = client.channels[topic]
            client.subscribe_until_heard(7, topic)
            client.listen(lambda: len(client.messages) >= 100)
        nodes.stop('bridge')
    finally:
        nodes.kill()
    assert channel['encoding'] == 'cdr' and channel['schemaEncoding'] == 'ros2msg'
    assert channel['schemaName'] == 'geometry_msgs/msg/AccelStamped'
    assert channel['schema'] == definition_of('geometry_msgs/msg/AccelStamped')
    assert {number for number, _, _ in client.messages} == {7}
    reader = field_reader(channel['schemaName'], 'accel.linear.z', channel['schema'])
    stamps, values = reader.read_many([raw for _, _, raw in client.messages])
    # the seed's own samples: where the first one that arrived lies, all others follow
    whole = simulate(assemble(load_spacecraft()), 120.0, 11).values[:, 1].tolist()
    first = min(range(len(whole)), key=lambda k: abs(whole[k] - values[0]))
    # other blocks and BLAS threads differ by rounding alone
    assert max(abs(v - w) for v, w in zip(values, whole[first:])) < 1e-10
    assert {round(s / 1e7) for s in (stamps[1:] - stamps[:-1]).tolist()} == {1}


@pytest.mark.slow
def test_a_stream_that_stops_is_told(bench):
    """A topic that came steadily ends while it is looked at: once in the log, and WARN."""
    for name in ('foxglove', 'websockets'):
        pytest.importorskip(name, reason=f'{name} is not installed')
    from diagnostic_msgs.msg import DiagnosticArray
    from node_records import newest
    from websockets.sync.client import connect
    topic, health = '/accelerometer/e1_b', bench.collect(DiagnosticArray, '/diagnostics')
    bench.processes.start('bridge', 'bridge', port=0)
    bench.processes.start('simulator', 'simulator', seed=11)
    bench.wait(lambda: 'ws://' in bench.words('bridge'))
    url = re.search(r'ws://[\d.:]+', bench.words('bridge'))[0]

    def reported():
        """Return level and message of the bridge."""
        status = newest(health, 'bridge: websocket')
        return status.level, status.message
    with connect(url, subprotocols=['foxglove.sdk.v1']) as socket:
        client = Client(socket)
        client.listen(lambda: topic in client.channels)
        client.subscribe_until_heard(7, topic)
        client.listen(lambda: len(client.messages) > 400)       # 4 s
        bench.processes.running.pop('simulator').kill()
        bench.wait(lambda: f'no message any more of {topic}' in bench.words('bridge'))
        bench.wait(lambda: f's of {topic}, which came steadily' in reported()[1])
        assert reported()[0] == b'\1'
        bench.processes.start('simulator', 'simulator', seed=11)
        bench.wait(lambda: f'messages again of {topic}' in bench.words('bridge'))
        bench.wait(lambda: reported()[0] == b'\0')
    assert bench.words('bridge').count('no message any more') == 1


def test_a_taken_port_is_told(tmp_path):
    """A port that somebody has ends the node with a line that says what to do."""
    for name in ('rclpy', 'foxglove'):
        pytest.importorskip(name, reason=f'{name} is not installed')
    import socket

    from ssi_ros.ros.demo import Processes
    nodes = Processes(tmp_path / 'log')
    with socket.socket() as other:
        other.bind(('127.0.0.1', 0))
        other.listen()
        nodes.start('bridge', 'bridge', port=other.getsockname()[1])
        try:
            assert nodes.running.pop('bridge').wait(timeout=30) == 2
        finally:
            nodes.kill()
    words = (tmp_path / 'log' / 'bridge.txt').read_text()
    assert 'give another port' in words and 'Traceback' not in words


def paths_of_foxglove():
    """Yield (topic, field) of every plotted path and shown topic of the layout."""
    layout = json.loads((CONFIG / 'foxglove_layout.json').read_text())
    shown = set(re.findall(r'"([A-Za-z]+![a-z]+)"', json.dumps(layout['layout'])))
    assert shown == set(layout['configById'])
    for panel in layout['configById'].values():
        for path in panel.get('paths', ()):
            topic, _, field = path['value'].partition('.')
            yield topic, field
        for key in ('topicPath', 'topicToRender'):
            if key in panel:
                yield panel[key], ''


def paths_of_plotjuggler():
    """Yield (topic, field) of every curve of the layout."""
    root = ElementTree.parse(CONFIG / 'plotjuggler_layout.xml').getroot()
    for splitter in root.iter('DockSplitter'):
        assert int(splitter.get('count')) == len(list(splitter))
    for curve in root.iter('curve'):
        topic, field = re.fullmatch(r'(/[a-z]+/[a-z0-9_]+)/(.*)', curve.get('name')).groups()
        yield topic, field.replace('/', '.')


@pytest.mark.parametrize('paths', [paths_of_foxglove, paths_of_plotjuggler])
def test_layouts_name_what_there_is(paths):
    """Every path of a layout is a topic of a node and a field of its message."""
    pytest.importorskip('rclpy', reason='the definitions of messages come with ROS 2')
    from ssi_ros.model import load_spacecraft
    from ssi_ros.ros.messages import SERIES
    found = list(paths())
    sensors = {f'/accelerometer/{s.name}' for s in load_spacecraft().sensors}
    assert {t for t, _ in found if t.startswith('/accelerometer/')} == sensors
    for topic, field in found:
        if topic.startswith('/identifier/') and topic != '/identifier/modes':
            assert topic.rsplit('/', 1)[1] in SERIES
        if field:
            field_reader(type_of(topic), field, definition_of(type_of(topic)))


def listening(pid):
    """Return the addresses at which a process listens."""
    inodes = {os.readlink(f).removeprefix('socket:[')[:-1]
              for f in Path(f'/proc/{pid}/fd').iterdir() if f.is_symlink()}
    found = set()
    for table in ('tcp', 'tcp6'):
        for line in Path(f'/proc/{pid}/net/{table}').read_text().splitlines()[1:]:
            place, state, inode = (line.split()[k] for k in (1, 3, 9))
            if state == '0A' and inode in inodes:
                found.add(place.split(':')[0])
    return found


def test_what_a_client_may_do(tmp_path):
    """Loopback alone; no page of another site, nothing published, junk and crowds are survived."""
    for name in ('rclpy', 'foxglove', 'websockets'):
        pytest.importorskip(name, reason=f'{name} is not installed')
    import socket

    from ssi_ros.ros.demo import Processes
    from websockets.exceptions import ConnectionClosed, InvalidStatus
    from websockets.sync.client import connect
    nodes = Processes(tmp_path / 'log')
    try:
        nodes.start('bridge', 'bridge', port=0)
        end = time.monotonic() + 30.0
        while not (port := re.search(r'ws://127\.0\.0\.1:(\d+)',
                                     (tmp_path / 'log/bridge.txt').read_text())):
            nodes.check()
            assert time.monotonic() < end
            time.sleep(0.05)
        # 127.x.y.z ends in 7F in the table, which is little-endian
        places = listening(nodes.running['bridge'].pid)
        assert len(places) == 2 and all(p.endswith('7F') for p in places), places
        url = f'ws://127.0.0.1:{port[1]}'
        for origin in ('https://evil.example', 'null', 'http://localhost.evil.example',
                       'https://app.foxglove.dev.evil.example', f'http://evil.example:{port[1]}'):
            with pytest.raises(InvalidStatus) as refused:
                connect(url, subprotocols=['foxglove.sdk.v1'], origin=origin)
            assert refused.value.response.status_code == 403
        for head in (b'\0' * 40_000, b'GET / HTTP/1.1\r\n' * 3000, b'', b'GET / HTTP/1.1\r\n\r\n'):
            with socket.create_connection(('127.0.0.1', int(port[1]))) as junk:
                junk.sendall(head)
        with connect(url, subprotocols=['foxglove.sdk.v1'],
                     origin='https://app.foxglove.dev') as viewer:
            message = json.loads(viewer.recv(timeout=10.0))
            assert message['op'] == 'serverInfo'
            # neither publishing, nor parameters, services, nor files
            assert message['capabilities'] == []
            for frame in ({'op': 'advertise', 'channels': [
                    {'id': 1, 'topic': '/x', 'encoding': 'cdr', 'schemaName': 'std_msgs/Empty'}]},
                    {'op': 'subscribe', 'subscriptions': [{'id': 1, 'channelId': 10 ** 18}]},
                    {'op': 'unsubscribe', 'subscriptionIds': [-1]}, {'op': 'x'}, []):
                viewer.send(json.dumps(frame))
            viewer.send(b'\1' + bytes(20))
            viewer.send('[' * 100_000)
            try:
                viewer.recv(timeout=1.0)
            except (TimeoutError, ConnectionClosed):
                pass
        with connect(url, subprotocols=['foxglove.sdk.v1']) as again:
            assert json.loads(again.recv(timeout=10.0))['op'] == 'serverInfo'
        nodes.stop('bridge')
    finally:
        nodes.kill()
    words = (tmp_path / 'log' / 'bridge.txt').read_text()
    assert 'https://evil.example was turned away' in words and 'Traceback' not in words
