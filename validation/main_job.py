"""
Measure the main job: losses, processor time, latency, crash safety, offline speed.

python -m validation.main_job            all of it, about 16 minutes
python -m validation.main_job --quick    the same with shorter runs, about 3 minutes

Writes docs/validation/main_job.md or main_job_quick.md.
"""
import argparse
import os
from pathlib import Path
import random
import subprocess
import sys
import tempfile
import time

import numpy as np
from ssi_ros.bag import open_bag, read_channels, recover
from ssi_ros.ros.demo import Processes, Watcher
from validation.report import write

TICKS = os.sysconf('SC_CLK_TCK')


def processor_s(pid):
    """Return user plus system time of a process [s]."""
    words = Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()
    return (int(words[11]) + int(words[12])) / TICKS


def live(folder, rate_hz, duration_s, window_s, hop_s):
    """Run simulator, identifier and recorder in real time; return a dict of what was seen."""
    config = folder / 'spacecraft.yaml'
    text = (Path(__file__).resolve().parents[1] / 'config' / 'spacecraft.yaml').read_text()
    config.write_text(text.replace('rate_hz: 100.0', f'rate_hz: {rate_hz:.1f}'))
    processes, watcher = Processes(folder / 'log'), Watcher()
    try:
        windows = watcher.listen('identifier')
        arrivals = {}
        processes.start('identifier', 'identifier', window_s=window_s, hop_s=hop_s,
                        expected_rate_hz=rate_hz)
        processes.start('recorder', 'recorder', bag=folder / 'bag')
        watcher.spin(4.0)
        processes.start('simulator', 'simulator', config=config, duration_s=duration_s,
                        wait_for_subscribers=2)
        used, began = {}, time.monotonic()
        while processes.running['simulator'].poll() is None:
            watcher.spin(0.02 if len(arrivals) < 3 else 0.5)
            for end_ns in windows:
                arrivals.setdefault(end_ns, time.time_ns())
            used.update({n: processor_s(p.pid) for n, p in processes.running.items()
                         if p.poll() is None})
        spent = time.monotonic() - began
        watcher.spin(2.0)
        processes.stop('identifier', 'recorder')
    finally:
        processes.kill()
        watcher.close()
    r = read_channels(folder / 'bag')
    lost = [round(duration_s * rate_hz) - len(s) for s in r.stamps_ns]
    words = (folder / 'log' / 'identifier.txt').read_text()
    # the simulator stamps the first sample by the whole second before it began, so latency is
    # taken against the moment at which the window's last sample was received by the recorder
    first = min(arrivals) if arrivals else 0
    got = max(int(a[np.searchsorted(s, first - 1, side='right') - 1])
              for s, a in zip(r.stamps_ns, r.arrivals_ns)) if arrivals else 0
    return {'lost': lost, 'identifier': words.split('samples received')[-1].strip(),
            'share': {n: 100.0 * u / spent for n, u in used.items()},
            'first_s': (arrivals[first] - got) * 1e-9 if arrivals else float('nan'),
            'windows': len(windows)}


def crashes(folder, count):
    """Kill the recorder `count` times at a random moment; return the losses [s]."""
    random.seed(4)
    losses = []
    for k in range(count):
        here = folder / f'crash_{k}'
        here.mkdir()
        processes = Processes(here / 'log')
        try:
            processes.start('recorder', 'recorder', bag=here / 'bag')
            processes.start('simulator', 'simulator', wait_for_subscribers=1)
            while 'joined /accelerometer/e2_b' not in (here / 'log/recorder.txt').read_text():
                time.sleep(0.05)
            time.sleep(1.5 + 3.0 * random.random())
            processes.running['recorder'].kill()
            killed_ns = time.time_ns()
            processes.running['recorder'].wait()
        finally:
            processes.kill()
        recover(here / 'bag', here / 'saved')
        r = read_channels(here / 'saved')
        losses.append((killed_ns - min(int(a[-1]) for a in r.arrivals_ns)) * 1e-9)
        open_bag(here / 'saved')
        from rosbags.highlevel import AnyReader
        with AnyReader([here / 'saved']) as reader:
            assert sum(1 for _ in reader.messages()) == open_bag(here / 'saved').message_count
    return losses


def timed(*words):
    """Run the command line in a process of its own; return the seconds it took."""
    began = time.perf_counter()
    subprocess.run([sys.executable, '-m', 'ssi_ros', *words], check=True, capture_output=True,
                   env=dict(os.environ, OMP_NUM_THREADS='1'))
    return time.perf_counter() - began


def main():
    """Measure and write the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--quick', action='store_true', help='shorter runs')
    quick = parser.parse_args().quick
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        simulate_s = min(timed('simulate', str(folder / f'b{k}'), '--duration-s', '600')
                         for k in range(3))
        words = ('identify', str(folder / 'b0'), '--window-s', '120', '--hop-s', '10')
        identify_s = min(timed(*words) for _ in range(3))
        lines = ['## Offline, whole processes, best of 3', '',
                 '| what | seconds | times real time | target |', '|---|---|---|---|',
                 f'| `simulate`, 600 s of 4 x 100 Hz to a bag | {simulate_s:.2f} | '
                 f'{600 / simulate_s:.0f} | 100 |',
                 f'| `identify`, window 120 s, hop 10 s, 49 windows | {identify_s:.2f} | '
                 f'{600 / identify_s:.0f} | 200 |', '']
        lines += ['## Live, separate processes over DDS, real time', '',
                  '| run | lost in the bag | identifier received, missing | identifier [% of a '
                  'core] | recorder | simulator | first result after the window was full [s] |',
                  '|---|---|---|---|---|---|---|']
        runs = ((100.0, 60.0 if quick else 600.0, 30.0, 1.0),
                (1000.0, 30.0 if quick else 60.0, 20.0, 1.0))
        for rate_hz, duration_s, window_s, hop_s in runs:
            here = folder / f'live_{rate_hz:g}'
            here.mkdir()
            print(f'4 x {rate_hz:g} Hz for {duration_s:g} s', flush=True)
            seen = live(here, rate_hz, duration_s, window_s, hop_s)
            share = seen['share']
            lines.append(
                f'| 4 x {rate_hz:g} Hz, {duration_s:g} s, window {window_s:g} s, hop {hop_s:g} s, '
                f'{seen["windows"]} windows | {seen["lost"]} | {seen["identifier"]} | '
                f'{share["identifier"]:.1f} | {share["recorder"]:.1f} | '
                f'{share["simulator"]:.1f} | {seen["first_s"]:.2f} |')
        losses = crashes(folder, 5 if quick else 20)
        lines += ['', '## kill -9 of the recorder at a random moment', '',
                  f'{len(losses)} times: lost {np.mean(losses):.2f} s on average, '
                  f'{max(losses):.2f} s at most (target 0.6 s); every bag recovered and read by '
                  'rosbags with all its messages.', '']
        if quick:
            write('main_job_quick', 'The main job, shorter runs', lines, seed='1, crashes 4',
                  command='main_job --quick')
        else:
            write('main_job', 'The main job', lines, seed='1, crashes 4')


if __name__ == '__main__':
    main()
