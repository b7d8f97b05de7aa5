"""How packages are measured: time side by side, peak memory in a child, accuracy over seeds."""
import os
from pathlib import Path
import time

import numpy as np
from threadpoolctl import threadpool_limits

from validation.bench_data import GATE, mac, match, RATE_HZ
from validation.bench_methods import quiet


def times(runs, repeats, threads=None):
    """
    Return the median time of every run [s], all runs taking turns.

    Parameters
    ----------
    runs : dict of str to callable
        The runs; each is called once before, so that no import is timed.
    repeats : int
        Turns.
    threads : int, optional
        Threads of the linear algebra library; without it as many as it likes. The time of one
        thread is processor time, which other work on the machine disturbs least; that of several
        is time on the wall.

    Returns
    -------
    dict of str to float

    """
    seconds = {name: [] for name in runs}
    clock = time.process_time if threads == 1 else time.perf_counter
    with threadpool_limits(threads):
        for name, run in runs.items():
            quiet(run)
        for _ in range(repeats):
            for name, run in runs.items():
                start = clock()
                quiet(run)
                seconds[name].append(clock() - start)
    return {name: float(np.median(s)) for name, s in seconds.items()}


def peak_bytes(run):
    """Return how far a run raises the resident memory, in a forked child (Linux)."""
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            Path('/proc/self/clear_refs').write_text('5')      # the peak starts anew
            before = _status('VmRSS')
            quiet(run)
            os.write(write_end, str(_status('VmHWM') - before).encode())
        finally:
            os._exit(0)
    os.close(write_end)
    with os.fdopen(read_end) as pipe:
        text = pipe.read()
    os.waitpid(child, 0)
    return float(text) if text else float('nan')


def _status(word):
    for line in Path('/proc/self/status').read_text().splitlines():
        if line.startswith(word + ':'):
            return 1024 * int(line.split()[1])
    raise OSError(f'/proc/self/status has no {word}')


def accuracy(methods, truth, record, seeds, rows, orders, pick=None):
    """
    Return how close every method comes at its own best order.

    A missed mode counts as an error of `GATE` in frequency and 1 in damping. The order is the one
    of least rms frequency error, chosen for every method on its own: what a user with the truth
    at hand would pick.

    Parameters
    ----------
    methods : dict of str to (callable, callable)
        As in `bench_methods`.
    truth : Truth
        What the record was made of.
    record : callable
        (seed) -> values.
    seeds : sequence of int
        Seeds.
    rows : int
        Block rows.
    orders : sequence of int
        Orders.
    pick : ndarray of bool, optional
        The modes that count.

    Returns
    -------
    dict of str to (order, frequency, damping, likeness, missed)
        rms relative errors [1], mean MAC of the found, share of missed modes.

    """
    pick = np.ones(len(truth.frequency_hz), dtype=bool) if pick is None else pick
    sums = {name: {n: [] for n in orders} for name in methods}
    with threadpool_limits(1):
        for seed in seeds:
            values = record(seed)
            for name, (run, read) in methods.items():
                for p in read(quiet(lambda: run(values, RATE_HZ, rows, orders))):
                    if p.order in sums[name]:       # pyOMA2 begins at its step
                        sums[name][p.order].append(errors(truth, p)[:, pick])
    best = {}
    for name, tables in sums.items():
        scores = {n: summary(t) for n, t in tables.items() if t}
        n = min(scores, key=lambda n: scores[n][0])
        best[name] = (n, *scores[n])
    return best


def errors(truth, poles):
    """Return (frequency error, damping error, MAC, missed) of every true mode, shape (4, p)."""
    found = match(truth, poles.frequency_hz, poles.shapes)
    table = np.array([[GATE, 1.0, np.nan, 1.0]] * len(found)).T
    for a, b in enumerate(found):
        if b >= 0:
            table[:, a] = (poles.frequency_hz[b] / truth.frequency_hz[a] - 1.0,
                           poles.damping_ratio[b] / truth.damping_ratio[a] - 1.0,
                           mac(truth.shapes[a:a + 1].astype(complex),
                               poles.shapes[b:b + 1])[0, 0], 0.0)
    return table


def summary(tables):
    """Return rms frequency error, rms damping error, mean MAC and share missed."""
    table = np.array(tables)
    rms = np.sqrt((np.clip(table[:, :2], -1.0, 1.0) ** 2).mean(axis=(0, 2)))
    return float(rms[0]), float(rms[1]), float(np.nanmean(table[:, 2])), float(table[:, 3].mean())


def spread_ratio(poles_of_seeds, truth):
    """
    Return predicted over empirical standard deviation, (frequency, damping), median over modes.

    Parameters
    ----------
    poles_of_seeds : sequence of Poles
        Of one order, one a seed.
    truth : Truth
        What the records were made of.

    """
    table = np.full((len(poles_of_seeds), len(truth.frequency_hz), 4), np.nan)
    for s, p in enumerate(poles_of_seeds):
        for a, b in enumerate(match(truth, p.frequency_hz, p.shapes)):
            if b >= 0:
                table[s, a] = (p.frequency_hz[b], p.damping_ratio[b], p.frequency_std_hz[b],
                               p.damping_ratio_std[b])
    empirical = np.nanstd(table[..., :2], axis=0, ddof=1)
    predicted = np.sqrt(np.nanmean(table[..., 2:] ** 2, axis=0))
    return np.nanmedian(predicted / empirical, axis=0)
