"""
Memory and open files of every node over a long run, at many times real time.

    python -m validation.live_long --minutes 60 --speed 10

Simulator (4 channels at 100 Hz), identifier, gap node, recorder and bridge run as processes on the
loopback, all reliable; a client looks at the topics of the bridge, and comes anew every minute;
`~/diagnose` is called now and then, so that the processes it begins count too. Once a minute a
line for each node; at the end a table with the slope of its memory over the last two thirds.
"""
import argparse
import json
import os
from pathlib import Path
import re
import subprocess
import sys
import tempfile
import time

import numpy as np
from ssi_ros.ros.demo import LATENESS_S, Processes

from validation.drills import TOPICS, wait, words

NODES = ('simulator', 'identifier', 'gap', 'recorder', 'bridge')
PAGE = os.sysconf('SC_PAGE_SIZE')
DIAGNOSE_S = 900.0            # of the wall, between two calls of ~/diagnose
VIEW = """
import json, sys, time
from websockets.sync.client import connect
end = time.monotonic() + 50.0
with connect(sys.argv[1], subprotocols=['foxglove.sdk.v1']) as socket:
    known, count = set(), 0
    while time.monotonic() < end:
        try:
            frame = socket.recv(timeout=1.0)
        except TimeoutError:
            continue
        if isinstance(frame, bytes):
            count += frame[0] == 1
            continue
        message = json.loads(frame)
        if message['op'] == 'advertise':
            new = [c['id'] for c in message['channels'] if c['id'] not in known]
            known |= set(new)
            socket.send(json.dumps({'op': 'subscribe', 'subscriptions': [
                {'id': i, 'channelId': i} for i in new]}))
print(count)
"""
CALL = """
import rclpy, sys
from std_srvs.srv import Trigger
rclpy.init()
node = rclpy.create_node('caller')
client = node.create_client(Trigger, '/gap/diagnose')
client.wait_for_service(30.0)
future = client.call_async(Trigger.Request())
rclpy.spin_until_future_complete(node, future, timeout_sec=800.0)
answer = future.result()
print(answer and (answer.message if not answer.success else answer.message[:60]))
"""


def look(pid):
    """Return resident memory [MB], open files, threads and processor time [s] of a process."""
    folder = Path(f'/proc/{pid}')
    resident = int((folder / 'statm').read_text().split()[1]) * PAGE / 1e6
    fields = (folder / 'stat').read_text().rsplit(')', 1)[1].split()
    spent_s = (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')
    return (resident, len(os.listdir(folder / 'fd')), len(os.listdir(folder / 'task')), spent_s)


def start(nodes, folder, speed, seed):
    """Start all nodes, the simulator last; return the address of the bridge."""
    rate_hz = 100.0 * speed
    settings = {'reliable': True, 'lateness_s': LATENESS_S, 'expected_rate_hz': rate_hz}
    nodes.start('identifier', 'identifier', channels=TOPICS, **settings)
    nodes.start('gap', 'gap', channels=TOPICS, **settings)
    nodes.start('recorder', 'recorder', bag=folder / 'bag', split_bytes=50_000_000)
    nodes.start('bridge', 'bridge', port=0)
    for name in ('identifier', 'gap'):
        wait(lambda n=name: 'waiting for' in words(nodes, n))
    wait(lambda: 'ws://' in words(nodes, 'bridge'))
    # of every accelerometer topic: identifier, gap node and recorder
    nodes.start('simulator', 'simulator', seed=seed, speed=speed, reliable=True,
                wait_for_subscribers=3)
    return re.search(r'ws://[\d.:]+', words(nodes, 'bridge'))[0]


def table(rows, speed):
    """Print memory and handles of every node, rows of (minute, node, *look)."""
    print('\n| node | MB at the first third | MB at the end | most MB | slope, MB an hour of '
          'the wall | open files, first third and end | threads | CPU of a core |\n'
          + '|---' * 8 + '|')
    for node in NODES:
        own = np.array([(r[0], *r[2:]) for r in rows if r[1] == node])
        late = own[own[:, 0] >= own[-1, 0] / 3]
        slope = 60.0 * np.polyfit(late[:, 0], late[:, 1], 1)[0] if len(late) > 2 else np.nan
        core = (own[-1, 4] - own[0, 4]) / (60.0 * (own[-1, 0] - own[0, 0]))
        print(f'| {node} | {late[0, 1]:.1f} | {late[-1, 1]:.1f} | {own[:, 1].max():.1f} | '
              f'{slope:+.2f} | {late[0, 2]:.0f}, {late[-1, 2]:.0f} | {late[-1, 3]:.0f} | '
              f'{100 * core:.0f} % |')
    minutes = rows[-1][0]
    print(f'\n{minutes:.0f} min of the wall, {minutes * speed / 60:.1f} h of samples at that '
          'pace', flush=True)


def main():
    """Run, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--minutes', type=float, default=60.0)
    parser.add_argument('--speed', type=float, default=10.0)
    parser.add_argument('--seed', type=int, default=23)
    args = parser.parse_args()
    rows, helpers = [], []
    with tempfile.TemporaryDirectory() as folder:
        nodes = Processes(Path(folder) / 'log')
        try:
            address = start(nodes, Path(folder), args.speed, args.seed)
            began, called = time.monotonic(), time.monotonic()
            minute = 0
            while minute < args.minutes:
                time.sleep(max(0.0, began + 60.0 * (minute + 1) - time.monotonic()))
                minute += 1
                nodes.check()
                found = [(minute, n, *look(nodes.running[n].pid)) for n in NODES]
                rows += found
                print(f'{minute} min: ' + '; '.join(
                    f'{n} {mb:.1f} MB, {files} files, {threads} threads'
                    for _, n, mb, files, threads, _ in found), flush=True)
                helpers.append(subprocess.Popen([sys.executable, '-c', VIEW, address],
                                                stdout=subprocess.PIPE, text=True))
                if time.monotonic() > called + DIAGNOSE_S:
                    called = time.monotonic()
                    helpers.append(subprocess.Popen([sys.executable, '-c', CALL],
                                                    stdout=subprocess.PIPE, text=True))
                for helper in [h for h in helpers if h.poll() is not None]:
                    helpers.remove(helper)
                    print(f'  said to its client: {helper.communicate()[0].strip()}', flush=True)
            table(rows, args.speed)
            nodes.stop('simulator')
            nodes.stop('identifier', 'gap', 'recorder', 'bridge')
            for name in NODES:
                lines = words(nodes, name).strip().splitlines()
                print(json.dumps({name: lines[-6:], 'lines': len(lines)}, indent=1))
        finally:
            for helper in helpers:
                helper.kill()
            nodes.kill()


if __name__ == '__main__':
    main()
