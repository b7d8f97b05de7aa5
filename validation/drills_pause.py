"""
Stop the gap node, or the bridge, for 3 s of 20 s of 4 channels, and count what they lack.

    python -m validation.drills_pause gap [SPEED ...]
    python -m validation.drills_pause bridge [SPEED ...]

Each with the topics best effort and reliable, at 100 Hz and at 1 kHz; one line a run. Where the
simulator has not ended 60 s later, the line says how far it came and what processor time it had.
"""
import json
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import rclpy
from ssi_ros.bag import definition_of, field_reader
from ssi_ros.ros.demo import Processes

from validation.drills import NAMES, PATIENCE_S, spent_s, TOPICS, wait, words

STOPPED_S, WALL_S = 3.0, 20.0
SAMPLES = 'simulator: samples'


class Health:
    """What nodes tell on /diagnostics, newest of each name, in a thread."""

    def __init__(self):
        rclpy.init()
        self.node, self.newest, self.worst = rclpy.create_node('drill'), {}, {}
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._take, 100)
        self.thread = threading.Thread(target=rclpy.spin, args=(self.node,), daemon=True)
        self.thread.start()

    def _take(self, message):
        for s in message.status:
            self.newest[s.name] = s
            if s.level > self.worst.get(s.name, (b'\0', ''))[0]:
                self.worst[s.name] = (s.level, s.message)

    def of(self, name, key):
        """Return a value of a status."""
        return next(v.value for v in self.newest[name].values if v.key == key)

    def close(self):
        """Stop listening."""
        rclpy.try_shutdown()
        self.thread.join(timeout=5.0)


def pause(process, nodes, health):
    """Stop a process after 5 s of samples for 3 s, wait for their end; return how it went."""
    began, before = time.monotonic(), time.process_time()
    spent = {name: spent_s(p) for name, p in nodes.running.items()}
    time.sleep(5.0)
    process.send_signal(signal.SIGSTOP)
    time.sleep(STOPPED_S)
    process.send_signal(signal.SIGCONT)
    try:
        nodes.running['simulator'].wait(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        took = time.monotonic() - began
        shares = [f'{name} {(spent_s(p) - spent[name]) / took:.2f}'
                  for name, p in nodes.running.items()]
        raise TimeoutError(
            f'after {took:.0f} s the simulator has sent {health.of(SAMPLES, "samples")} samples a '
            f'channel and is {float(health.of(SAMPLES, "behind_s")):.0f} s behind its pace; of a '
            f'core had {", ".join(shares)}, this drill {(time.process_time() - before) / took:.2f}'
            f', load {os.getloadavg()[0]:.1f}') from None
    del nodes.running['simulator']
    time.sleep(3.0)
    return (f'; the simulator took {time.monotonic() - began - 3.0:.0f} s, load '
            f'{os.getloadavg()[0]:.1f}')


def simulate(nodes, speed, reliable):
    """Start the simulator for 20 s of the wall."""
    nodes.start('simulator', 'simulator', speed=speed, reliable=reliable,
                duration_s=WALL_S * speed, wait_for_subscribers=1)


def gap(folder, speed, reliable):
    """Return what the gap node has received, and what it said."""
    nodes, health = Processes(folder / 'log'), Health()
    try:
        nodes.start('gap', 'gap', channels=TOPICS, reliable=reliable, window_s=20.0, hop_s=10.0,
                    effects=['sensor_gain'], lateness_s=60.0 if reliable else 1.0)
        wait(lambda: 'gap: gap' in health.newest and 'preparing' not in
             health.newest['gap: gap'].message and 'waiting for' in words(nodes, 'gap'))
        health.worst.clear()
        simulate(nodes, speed, reliable)
        wait(lambda: 'watching' in words(nodes, 'gap'))
        took = pause(nodes.running['gap'], nodes, health)
        counts = [(health.of(f'gap: channel {n}', 'received'),
                   health.of(f'gap: channel {n}', 'missing')) for n in NAMES]
        said = [line.split(': ', 1)[1] for line in words(nodes, 'gap').splitlines()
                if 'missing in' in line or 'no sample any more' in line]
        nodes.stop('gap')
        return (f'received and missing {counts} of {round(WALL_S * speed * 100)}; '
                f'said {said[:1] or "nothing"}{took}')
    finally:
        nodes.kill()
        health.close()


def subscribe(socket, numbers):
    """Look at channels; the server may not know yet what it has advertised, and forget it."""
    socket.send(json.dumps({'op': 'subscribe', 'subscriptions': [
        {'id': n, 'channelId': n} for n in numbers]}))


def bridge(folder, speed, reliable):
    """Return what a client of the bridge got."""
    from websockets.sync.client import connect
    nodes, health = Processes(folder / 'log'), Health()
    try:
        nodes.start('bridge', 'bridge', port=0)
        wait(lambda: 'ws://' in words(nodes, 'bridge'))
        simulate(nodes, speed, reliable)
        got, numbers, end = {}, set(), threading.Event()
        url = re.search(r'ws://[\d.:]+', words(nodes, 'bridge'))[0]
        with connect(url, subprotocols=['foxglove.sdk.v1'], max_queue=None) as socket:
            def listen():
                while not end.is_set():
                    try:
                        frame = socket.recv(timeout=0.5)
                    except TimeoutError:
                        subscribe(socket, [i for i in numbers if i not in got])
                        continue
                    if isinstance(frame, bytes):
                        if frame[0] == 1:
                            number = int.from_bytes(frame[1:5], 'little')
                            got.setdefault(number, []).append(frame[13:])
                        continue
                    message = json.loads(frame)
                    new = [c['id'] for c in message.get('channels', ()) if c['topic'] in TOPICS]
                    numbers.update(new)
                    subscribe(socket, new)
            thread = threading.Thread(target=listen)
            thread.start()
            # no sample goes out before the bridge has subscribed for its client
            wait(lambda: len(got) == len(TOPICS))
            try:
                took = pause(nodes.running['bridge'], nodes, health)
                said = health.newest['bridge: websocket'].message.partition('; ')[2]
            finally:
                end.set()
                thread.join()
        nodes.stop('bridge')
        reader = field_reader('geometry_msgs/msg/AccelStamped', 'accel.linear.z',
                              definition_of('geometry_msgs/msg/AccelStamped'))
        stamps = [np.asarray(reader.read_many(raws)[0]) for raws in got.values()]
        lacks = [round((s[-1] - s[0]) * 1e-7) + 1 - len(s) for s in stamps]
        return (f'{sum(map(len, stamps))} messages, {lacks} lacking between the first and the '
                f'last of each topic, {round(4 * WALL_S * speed * 100)} were sent; said: '
                f'{said or "nothing"}{took}')
    finally:
        nodes.kill()
        health.close()


def main(what, *speeds):
    """Run four drills."""
    for speed in map(float, speeds or (1, 10)):
        for reliable in (False, True):
            with tempfile.TemporaryDirectory() as folder:
                try:
                    line = {'gap': gap, 'bridge': bridge}[what](Path(folder), speed, reliable)
                except TimeoutError as error:
                    line = f'no answer: {error}'
            print(f'{what}, {100 * speed:g} Hz, {"reliable" if reliable else "best effort"}: '
                  f'{line}', flush=True)


if __name__ == '__main__':
    main(*sys.argv[1:])
