"""
Drills of docs/validation/reliability.md that take too long for a test.

    python -m validation.drills kill --times 20 --seed 23
    python -m validation.drills stop --times 10
    python -m validation.drills busy --seconds 60

Each prints one line a run and a line of all; nodes run as processes on the loopback.
"""
import argparse
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
from ssi_ros.bag import read_channels, recover
from ssi_ros.ros.demo import Processes

NAMES = ('e1_a', 'e1_b', 'e2_a', 'e2_b')
TOPICS = [f'/accelerometer/{n}' for n in NAMES]
PATIENCE_S = 60.0
SPEED = 10.0                # 100 Hz of the model make 1 kHz on the wall


def words(nodes, name):
    """Return what a node has printed."""
    return (nodes.log_folder / f'{name}.txt').read_text()


def wait(condition, patience_s=PATIENCE_S):
    """Return whether a condition held in time."""
    end = time.monotonic() + patience_s
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


def recording(nodes, folder, duration_s=0.0, reliable=True):
    """Start a recorder and, once it is there, 4 x 1 kHz; return the bag."""
    bag = folder / 'bag'
    nodes.start('recorder', 'recorder', bag=bag, topics=TOPICS)
    wait(lambda: 'recording to' in words(nodes, 'recorder'))
    nodes.start('simulator', 'simulator', speed=SPEED, reliable=reliable, duration_s=duration_s,
                wait_for_subscribers=1)
    wait(lambda: words(nodes, 'recorder').count('joined') == len(TOPICS))
    return bag


def killed(folder, rng):
    """Kill the recorder after 1 to 2.5 s; return what the end of the recovered bag lacks [s]."""
    nodes = Processes(folder / 'log')
    try:
        bag = recording(nodes, folder)
        wait(lambda: any(f.stat().st_size > 50_000 for f in bag.glob('*.mcap')))
        time.sleep(rng.uniform(1.0, 2.5))
        nodes.running['recorder'].kill()
        at_ns = time.time_ns()
    finally:
        nodes.kill()
    recover(bag, folder / 'saved')
    from ssi_ros.bag import open_bag
    saved = open_bag(folder / 'saved')
    found = read_channels(folder / 'saved')
    even = all((np.diff(s) == 10_000_000).all() for s in found.stamps_ns)
    return f'lacks {(at_ns - saved.end_ns) * 1e-9:.2f} s, ' + (
        'no hole before' if even else 'WITH A HOLE BEFORE')


def stopped(folder, rng):
    """Stop the recorder for 3 s of 10, reliable; return what it wrote."""
    nodes = Processes(folder / 'log')
    try:
        recording(nodes, folder, duration_s=100.0)
        time.sleep(3.0)
        nodes.running['recorder'].send_signal(signal.SIGSTOP)
        time.sleep(3.0)
        nodes.running['recorder'].send_signal(signal.SIGCONT)
        nodes.running.pop('simulator').wait(timeout=PATIENCE_S)
        time.sleep(2.0)
        nodes.stop('recorder')
        return words(nodes, 'recorder').strip().splitlines()[-1].split(': ', 1)[-1]
    finally:
        nodes.kill()


def busy(folder, seconds, reliable):
    """Let nodes at nice 19 stand beside two busy loops; return what the identifier received."""
    nodes = Processes(folder / 'log')
    loops = []
    try:
        nodes.start('identifier', 'identifier', channels=TOPICS, reliable=reliable,
                    lateness_s=60.0 if reliable else 1.0, window_s=20.0, hop_s=1.0)
        wait(lambda: 'waiting for' in words(nodes, 'identifier'))
        nodes.start('simulator', 'simulator', duration_s=seconds, reliable=reliable,
                    wait_for_subscribers=1)
        wait(lambda: 'watching' in words(nodes, 'identifier'))
        for process in nodes.running.values():
            for task in os.listdir(f'/proc/{process.pid}/task'):
                os.setpriority(os.PRIO_PROCESS, int(task), 19)
        loops = [subprocess.Popen([sys.executable, '-c', 'while True: pass']) for _ in range(2)]
        began, before = time.monotonic(), sum(spent_s(p) for p in nodes.running.values())
        wait(lambda: time.monotonic() > began + seconds - 2.0, seconds)
        taken = sum(spent_s(p) for p in nodes.running.values()) - before
        share = taken / (time.monotonic() - began)
        loop = sum(map(spent_s, loops)) / (time.monotonic() - began)
        nodes.running.pop('simulator').wait(timeout=4 * seconds + PATIENCE_S)
        for process in loops:          # an end has 15 s
            process.kill()
        nodes.stop('identifier')
        return (words(nodes, 'identifier').strip().splitlines()[-1].split(': ', 1)[-1]
                + f' of {round(100 * seconds)}; both nodes had {100 * share:.1f} % of a core, '
                f'both loops {100 * loop:.0f} %')
    finally:
        for process in loops:
            process.kill()
            process.wait()
        nodes.kill()


def spent_s(process):
    """Return the processor time that a process has taken [s]."""
    fields = Path(f'/proc/{process.pid}/stat').read_text().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def main():
    """Run one drill."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('drill', choices=('kill', 'stop', 'busy'))
    parser.add_argument('--times', type=int, default=20)
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--seed', type=int, default=23)
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    for k in range(2 if args.drill == 'busy' else args.times):
        with tempfile.TemporaryDirectory() as folder:
            if args.drill == 'busy':
                line = f'{("best effort", "reliable")[k]}: ' + busy(
                    Path(folder), args.seconds, bool(k))
            else:
                line = (killed if args.drill == 'kill' else stopped)(Path(folder), rng)
        print(f'{args.drill} {k + 1}: {line}', flush=True)


if __name__ == '__main__':
    main()
