"""
Long runs: constant memory over a day, and identities over two days of drifting frequencies.

    python -m validation.identification_long memory --hours 24
    python -m validation.identification_long drift --hours 48
    python -m validation.identification_long report
"""
import argparse
import json
import os
from pathlib import Path
import tempfile

import numba
import numpy as np
from scipy.optimize import linear_sum_assignment
from ssi_ros.identify import Identification, Monitor
from ssi_ros.identify.grid import Grid
from ssi_ros.identify.shapes import mac
from ssi_ros.identify.stamped import SegmentMonitor
from ssi_ros.model import assemble, load_spacecraft, natural_modes
from validation import report

RATE_HZ = 100.0
ORBIT_S = 5400.0
DRIFT = 0.01            # amplitude: all frequencies move by 2 % from peak to peak
CHANNELS = ('e1_a', 'e1_b', 'e2_a', 'e2_b')
NEAR = 0.01             # a mode further than that from every true one is false
LASTING = 2.0           # window lengths on another mode that are called a swap
KEPT = Path(tempfile.gettempdir()) / 'ssi_ros_long_run.json'


@numba.njit
def _step(state, mu, factor, force, shapes, values):
    """Step every mode by its pole of the moment; a pole moves on its own spiral."""
    for t in range(len(values)):
        for j in range(len(state)):
            state[j] = mu[j] ** factor[t] * state[j] + force[t, j]
            for c in range(values.shape[1]):
                values[t, c] += shapes[j, c] * state[j].real


class Drifting:
    """
    The spacecraft's twenty modes, equally strong, with frequencies that drift over the orbit.

    Every pole is raised to the power 1 + drift sin(2 pi t / orbit): frequency and decay change
    together and the damping ratio stays. Made in pieces, so that days fit into memory.
    """

    def __init__(self, drift, seed):
        modes = natural_modes(assemble(load_spacecraft()))
        pick = (modes.frequencies_hz > 0.1) & (modes.frequencies_hz < 32.0)
        self.frequency_hz = modes.frequencies_hz[pick]
        self.damping_ratio = modes.damping_ratios[pick]
        self.shapes = np.ascontiguousarray(modes.shapes.T[pick].real)
        self.drift, self.rng = drift, np.random.default_rng(seed)
        self.mu = np.exp(2.0 * np.pi / RATE_HZ * self.frequency_hz * (
            -self.damping_ratio + 1j * np.sqrt(1.0 - self.damping_ratio ** 2)))
        self.strength = np.sqrt(1.0 - np.abs(self.mu) ** 2)      # unit power for every mode
        self.state = self._white(1)[0] / np.sqrt(1.0 - np.abs(self.mu) ** 2) * self.strength
        self.row = 0

    def _white(self, count):
        shape = (count, len(self.mu))
        return self.rng.standard_normal(shape) + 1j * self.rng.standard_normal(shape)

    def factor(self, time_s):
        """Return the frequencies over their mean at times [s]."""
        return 1.0 + self.drift * np.sin(2.0 * np.pi * np.asarray(time_s) / ORBIT_S)

    def rows(self, count):
        """Return the next rows, shape (count, 4)."""
        values = np.zeros((count, 4))
        times = (self.row + np.arange(count)) / RATE_HZ
        _step(self.state, self.mu, self.factor(times), self.strength * self._white(count),
              self.shapes, values)
        self.row += count
        return values + 0.05 * self.rng.standard_normal(values.shape)


def resident_mb():
    """Return the resident memory of this process [MB]."""
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 2 ** 20


def memory(hours, window_s, hop_s, seed=1):
    """Stream stamped samples through grid and monitor; return (hour, MB) pairs."""
    source = Drifting(0.0, seed)
    grid = Grid(CHANNELS, RATE_HZ)
    follow = SegmentMonitor(CHANNELS, Identification(window_s=window_s, hop_s=hop_s))
    found, size = [], 1000
    for piece in range(round(hours * 3600.0 * RATE_HZ / size)):
        stamps = ((piece * size + np.arange(size)) * 1e9 / RATE_HZ).astype(np.int64)
        values = source.rows(size)
        for c in range(4):
            grid.push(c, stamps, values[:, c])
        for rows in grid.rows():
            follow.push(rows)
        hour = (piece + 1) * size / RATE_HZ / 3600.0
        if hour >= 0.5 and (hour * 2.0) % 1.0 < 1e-9 + size / RATE_HZ / 1800.0 / 1.001:
            found.append((round(hour, 2), round(resident_mb(), 1)))
    return found


class Follower:
    """Book on which true mode every identity sits, window by window, and how far off it is."""

    def __init__(self, source, window_s, hop_s):
        self.source, self.window_s = source, window_s
        self.lasting = round(LASTING * window_s / hop_s)
        self.seen = {}              # identity: list of true modes
        self.off = [[] for _ in source.frequency_hz]    # (error, damping error) over spreads
        self.windows = self.false = self.births = 0

    def book(self, window):
        """Take one window."""
        self.windows += 1
        self.births += len(window.births)
        inside = window.end_ns * 1e-9 - self.window_s + np.linspace(0.0, self.window_s, 25)
        true_hz = self.source.frequency_hz * self.source.factor(inside).mean()
        if not window.modes:
            return
        f = np.array([m.frequency_hz for m in window.modes])
        step = np.abs(f[:, None] / true_hz - 1.0)
        self.false += int((step.min(axis=1) > NEAR).sum())
        # a shape that is wholly wrong weighs as much as 1 % of frequency: pairs differ in shape
        cost = step / NEAR + 1.0 - mac(np.array([m.shape for m in window.modes]),
                                       self.source.shapes.astype(complex))
        cost[step > NEAR] = 1e3
        for k, j in zip(*linear_sum_assignment(cost)):
            mode = window.modes[k]
            if cost[k, j] < 1e3:
                self.seen.setdefault(mode.identity, []).append(int(j))
                self.off[j].append(
                    ((f[k] - true_hz[j]) / mode.frequency_std_hz,
                     (mode.damping_ratio - self.source.damping_ratio[j])
                     / mode.damping_ratio_std, f[k] / true_hz[j] - 1.0))

    def summary(self):
        """Return the numbers of the report as plain data."""
        away = total = 0
        swapped = []
        for truths in self.seen.values():
            truths = np.array(truths)
            own = np.bincount(truths).argmax()
            other = truths != own
            away, total = away + int(other.sum()), total + len(truths)
            runs = np.diff(np.flatnonzero(np.diff(np.concatenate(([0], other, [0])))))[::2]
            if (runs >= self.lasting).any():
                swapped.append(sorted(set(truths[other].tolist()) | {int(own)}))
        lives = np.zeros(len(self.off), dtype=int)
        for truths in self.seen.values():
            lives[np.bincount(truths).argmax()] += 1
        modes = []
        for f, life, off in zip(self.source.frequency_hz, lives, self.off):
            table = np.array(off).reshape(-1, 3)
            table = table[np.isfinite(table).all(axis=1)]
            z, x, step = table.T if len(table) else np.full((3, 1), np.nan)
            modes.append([round(float(f), 3), round(100.0 * len(off) / self.windows, 2), int(life),
                          round(float(np.sqrt((z ** 2).mean())), 2),
                          round(100.0 * float((np.abs(z) < 2.0).mean()), 1),
                          round(100.0 * float(np.sqrt((step ** 2).mean())), 3),
                          round(float(np.sqrt((x ** 2).mean())), 2)])
        return {'windows': self.windows, 'identities': len(self.seen), 'births': self.births,
                'swapped': swapped, 'away': away, 'placed': total, 'false': self.false,
                'modes': modes}


def drift(hours, window_s, hop_s, seed=2, amplitude=DRIFT, report=None):
    """Identify a drifting record; return the summary of a `Follower`."""
    source = Drifting(amplitude, seed)
    monitor = Monitor(CHANNELS, RATE_HZ, 0, Identification(window_s=window_s, hop_s=hop_s))
    follower = Follower(source, window_s, hop_s)
    for minutes in range(10, round(hours * 60.0) + 1, 10):
        for window in monitor.push(source.rows(round(600.0 * RATE_HZ))):
            follower.book(window)
        if report and minutes % 60 == 0:
            report({'hours': minutes / 60.0, **follower.summary()})
    return follower.summary()


def main():
    """Run one part, or write the report of what was run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('part', choices=('memory', 'drift', 'report'))
    parser.add_argument('--hours', type=float, default=24.0)
    parser.add_argument('--window-s', type=float, default=120.0)
    parser.add_argument('--hop-s', type=float, default=12.0)
    args = parser.parse_args()
    if args.part == 'report':
        write(json.loads(KEPT.read_text()))
        return

    def keep(result):
        kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
        kept[args.part] = {'window_s': args.window_s, 'hop_s': args.hop_s, **result}
        KEPT.write_text(json.dumps(kept))
        print({k: v for k, v in result.items() if k != 'modes'}, flush=True)

    if args.part == 'memory':
        keep({'hours': args.hours, 'table': memory(args.hours, args.window_s, args.hop_s)})
    else:
        drift(args.hours, args.window_s, args.hop_s, report=keep)


def write(kept):
    """Write docs/validation/long_run.md."""
    lines = []
    if 'memory' in kept:
        m = kept['memory']
        table = m['table']
        late = [mb for hour, mb in table if hour >= 1.0]
        shown = table[::max(1, len(table) // 8)]
        lines += ['## Memory', '', f'{m["hours"]:g} h of stamped samples, 4 channels at 100 Hz, '
                  f'window {m["window_s"]:g} s, hop {m["hop_s"]:g} s, through grid and monitor. '
                  f'Resident memory from the first hour on: {min(late):.1f} to {max(late):.1f} '
                  'MB. Target: constant.', '',
                  *report.table(['hour', 'MB'], shown)]
    if 'drift' in kept:
        d = kept['drift']
        lines += ['## Drift', '', f'{d["hours"]:g} h, all frequencies times 1 + {DRIFT:g} '
                  f'sin(2 pi t / {ORBIT_S:g} s), twenty equally strong modes, 5 % noise, window '
                  f'{d["window_s"]:g} s, hop {d["hop_s"]:g} s: {d["windows"]} windows.', '',
                  f'* Identities that sat on another mode for {LASTING:g} window lengths or more '
                  f'(a swap): {len(d["swapped"])}. Target: none.',
                  f'* Single placements on another mode than the identity\'s own: {d["away"]} of '
                  f'{d["placed"]}.',
                  f'* Identities in all: {d["identities"]}; births {d["births"]}. One life a mode '
                  'would be 20.',
                  f'* Modes further than 1 % from every true one: {d["false"]} in '
                  f'{d["windows"]} windows.', '',
                  'The error is against the mean frequency of the window, over the spread that '
                  'was given; 1 and 95 % are right.', '',
                  *report.table(['f [Hz]', 'found [%]', 'lives', 'rms error / spread',
                                 'within 2 spreads [%]', 'rms error [%]',
                                 'damping: rms error / spread'], d['modes'])]
    report.write('long_run', 'Long runs', lines, seed='1 (memory), 2 (drift)',
                 command='identification_long report')


if __name__ == '__main__':
    main()
