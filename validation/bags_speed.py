"""
Measure the bag layer: speeds, stalls and crashes. Prints the table of docs/validation/bags.md.

    python validation/bags_speed.py [--crashes 20] [--keep FOLDER]

--keep only writes a bag of 600 s with 100 samples missing and prints its sums, for bags_npm.mjs.
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

from ssi_ros.bag import (
    BagWriter, definition_of, encode_accel, field_reader, open_bag, read_channels, recover,
    write_samples)
from ssi_ros.records import Samples

ACCEL = 'geometry_msgs/msg/AccelStamped'
NAMES = ('e1_a', 'e1_b', 'e2_a', 'e2_b')
RECORDER = """
import sys, time
import numpy as np
from ssi_ros.bag import BagWriter, encode_accel
names = ('e1_a', 'e1_b', 'e2_a', 'e2_b')
with BagWriter(sys.argv[1]) as bag:
    for name in names:
        bag.add_topic('/' + name, 'geometry_msgs/msg/AccelStamped')
    due = time.monotonic()
    while True:
        now = time.time_ns()
        for name in names:
            raw = encode_accel(np.array([now]), np.array([1.0]), name)[0]
            bag.write('/' + name, raw, now, now)
        print(now, flush=True)
        due += 0.01
        time.sleep(max(0.0, due - time.monotonic()))
"""


def best(action, repeats=5):
    """Return the shortest of several runs [s]."""
    times = []
    for _ in range(repeats):
        before = time.perf_counter()
        action()
        times.append(time.perf_counter() - before)
    return min(times)


def speeds(folder):
    """Print the times of reading and writing 600 s of 4 x 100 Hz."""
    rng = np.random.default_rng(20160627)
    samples = Samples(rng.standard_normal((60_000, 4)), 100.0, NAMES, 1_700_000_000 * 10 ** 9)
    names = iter(range(100))
    print(f'write_samples, 240,000 messages: '
          f'{best(lambda: write_samples(folder / f"w{next(names)}", samples)):.3f} s (target 2)')
    bag = folder / 'w0'
    print(f'read_channels of it: {best(lambda: read_channels(bag)):.3f} s (target 1.0)')
    print(f'messages() of it: {best(lambda: sum(1 for _ in open_bag(bag).messages())):.3f} s')
    raw = encode_accel(samples.stamps_ns()[:1], samples.values[:1, 0], 'e1_a')[0]
    reader = field_reader(ACCEL, 'accel.linear.z', definition_of(ACCEL))
    took = best(lambda: [reader.read(raw) for _ in range(100_000)])
    print(f'FieldReader.read: {took * 10:.2f} us a message (target 1-2)')
    raws = [raw] * 240_000
    print(f'FieldReader.read_many, 240,000: {best(lambda: reader.read_many(raws)):.3f} s')
    size = (bag / 'w0_0.mcap').stat().st_size
    print(f'size: {size / 240_000:.1f} bytes a message')


def stalls(folder, rate_hz=4000, seconds=10):
    """Print how long `write` holds up its caller while the bag is flushed and synced."""
    raws = encode_accel(np.arange(rate_hz, dtype=np.int64), np.random.default_rng(1).random(
        rate_hz), 'a')
    longest, cpu = [], time.process_time()
    with BagWriter(folder / 'live') as bag:
        bag.add_topic('/a', ACCEL)
        due = time.monotonic()
        for i in range(seconds * 100):
            for k in range(rate_hz // 100):
                now = time.time_ns()
                before = time.perf_counter()
                bag.write('/a', raws[k], now, now)
                longest.append(time.perf_counter() - before)
            due += 0.01
            time.sleep(max(0.0, due - time.monotonic()))
    cpu = time.process_time() - cpu
    longest = np.array(longest) * 1e6
    print(f'live at {rate_hz}/s, {seconds} s, flush and fsync every 0.5 s: write takes '
          f'{np.median(longest):.1f} us (median), {np.percentile(longest, 99.9):.0f} us (99.9 %), '
          f'{longest.max() / 1e3:.1f} ms (longest); {100 * cpu / seconds:.1f} % of a core with '
          'the loop that feeds it')


def crashes(folder, count):
    """Print what is lost by kill -9 at random moments."""
    rng = np.random.default_rng(7)
    lost, saved = [], []
    for i in range(count):
        bag = folder / f'crash_{i}'
        with subprocess.Popen([sys.executable, '-c', RECORDER, str(bag)], text=True,
                              stdout=subprocess.PIPE) as process:
            process.stdout.readline()
            time.sleep(rng.uniform(0.7, 3.0))
            os.kill(process.pid, signal.SIGKILL)
            lines = process.stdout.read().splitlines()
        last = max(int(line) for line in lines if len(line) == 19)
        report = recover(bag, folder / f'sound_{i}')
        read = read_channels(folder / f'sound_{i}')
        assert sum(map(len, read.values)) == sum(report.saved.values()) == rosbags_count(
            folder / f'sound_{i}')
        lost.append((last - report.last_ns) / 1e9)
        saved.append(sum(report.saved.values()))
    print(f'kill -9, {count} times: lost {np.mean(lost):.2f} s on average, {max(lost):.2f} s at '
          f'most (target 0.6); all {count} recovered and read by rosbags too')


def rosbags_count(folder):
    """Return how many messages rosbags reads."""
    from rosbags.rosbag2 import Reader
    with Reader(folder) as bag:
        return sum(1 for _ in bag.messages())


def keep(folder):
    """Write the bag that bags_npm.mjs reads, and print what it should find."""
    values = np.random.default_rng(1).standard_normal((60_000, 4))
    values[100:200, 1] = np.nan
    write_samples(folder, Samples(values, 100.0, NAMES, 1_700_000_000 * 10 ** 9))
    for name, column in zip(NAMES, values.T):
        held = column[~np.isnan(column)].tolist()
        total = 0.0
        for value in held:            # in the order of the messages: the same rounding
            total += value
        print(name, len(held), 'sum', total)


def main():
    """Run all of it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--crashes', type=int, default=20)
    parser.add_argument('--keep', type=Path, metavar='FOLDER')
    args = parser.parse_args()
    if args.keep:
        keep(args.keep)
        return
    with tempfile.TemporaryDirectory() as folder:
        speeds(Path(folder))
        stalls(Path(folder))
        crashes(Path(folder), args.crashes)


if __name__ == '__main__':
    main()
