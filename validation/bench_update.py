"""
Time of the whole chain: a record on sliding windows, one update of a live monitor, and the core.

    python validation/bench_update.py
"""
import os
import time

os.environ.setdefault('OMP_NUM_THREADS', '1')
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

from ssi_ros.identify import Identification, identify, Monitor, SlidingSsiCov  # noqa: E402
from ssi_ros.identify.ssi_cov import ssi_cov  # noqa: E402
from ssi_ros.model import assemble, load_spacecraft, simulate  # noqa: E402


def best(run, times=5):
    """Return the least time of several runs [s]."""
    seconds = []
    for _ in range(times):
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def main():
    """Print one line a measure."""
    samples = simulate(assemble(load_spacecraft()), 660.0, 1)
    ten_minutes = samples.between(0.0, 600.0)
    settings = Identification(window_s=120.0, hop_s=10.0)
    print(f'600 s, window 120 s, hop 10 s: {best(lambda: identify(ten_minutes, settings)):.2f} s')
    for window_s in (120.0, 600.0):
        monitor = Monitor(samples.channels, samples.rate_hz, 0,
                          Identification(window_s=window_s, hop_s=1.0))
        first = round(window_s * samples.rate_hz)
        monitor.push(samples.values[:first])
        times = []
        for hop in range(40):
            rows = samples.values[first + 100 * hop:first + 100 * (hop + 1)]
            start = time.perf_counter()
            monitor.push(rows)
            times.append(time.perf_counter() - start)
        print(f'one update, window {window_s:g} s, hop 1 s: {1e3 * min(times):.1f} ms least, '
              f'{1e3 * sorted(times)[20]:.1f} ms median')
    for window_s in (60.0, 600.0):
        values = samples.values[:round(window_s * samples.rate_hz)]
        seconds = best(lambda: ssi_cov(values, samples.rate_hz))
        print(f'core, {window_s:g} s, i = 50, orders 2 to 60: {1e3 * seconds:.1f} ms')
    for weighting in ('cva', 'upc'):
        core = SlidingSsiCov(4, samples.rate_hz, 600.0, 1.0, 100, 40, weighting)
        core.push(samples.values[:60000])
        times = []
        for hop in range(40):
            start = time.perf_counter()
            core.push(samples.values[60000 + 100 * hop:60100 + 100 * hop])
            times.append(time.perf_counter() - start)
        print(f'one update of the core, window 600 s, hop 1 s, i = 100, order 40, {weighting}: '
              f'{1e3 * min(times):.1f} ms least, {1e3 * sorted(times)[20]:.1f} ms median, '
              f'{core.warm} of {core.warm + core.whole} windows warm')


if __name__ == '__main__':
    main()
