"""
Compare the identification with other packages, side by side in one run.

    make bench                                  (a quarter of an hour)
    python -m validation.bench_peers --quick    (two minutes, writes nothing)

The packages of requirements-bench.lock must be installed: `make bench` sees to it.
"""
import argparse
import os

os.environ['TQDM_DISABLE'] = '1'       # the peers' progress bars must not cost them time

import numpy as np  # noqa: E402
from ssi_ros.identify import Identification, identify, Monitor  # noqa: E402
from ssi_ros.identify.lags import Ring  # noqa: E402
from ssi_ros.identify.realise import factorise, poles_of  # noqa: E402
from ssi_ros.records import Samples  # noqa: E402
from threadpoolctl import threadpool_limits  # noqa: E402
from validation import report  # noqa: E402
from validation.bench_data import modal_record, RATE_HZ, spacecraft  # noqa: E402
from validation.bench_data import ten_modes, twin_arrays  # noqa: E402
from validation.bench_measure import accuracy, errors, peak_bytes  # noqa: E402
from validation.bench_measure import spread_ratio, summary, times  # noqa: E402
from validation.bench_methods import ACCURATE, CLASSES, CORES, koma, Poles  # noqa: E402
from validation.bench_methods import pyoma2, quiet, SPREADS  # noqa: E402

ORDERS = tuple(range(2, 61, 2))
CASES = ((60.0, 50), (60.0, 100), (600.0, 50), (600.0, 100))
CHANNELS = tuple('abcd')
OURS = 'ours, CVA'


def core_times(truth, repeats, threads):
    """Return the table of the batch core and of the public class, and the medians by case."""
    methods = {**CORES, **CLASSES}
    medians = {}
    for duration_s, rows in CASES:
        values = modal_record(truth, duration_s, 1)
        runs = {name: lambda run=run: run(values, RATE_HZ, rows, ORDERS)
                for name, (run, _) in methods.items()}
        medians[duration_s, rows] = times(runs, repeats, threads)
    lines = report.table(
        ['median [ms] (ratio to ours, CVA)', *(f'{t:g} s, i = {i}' for t, i in CASES)],
        [[name, *(f'{1e3 * m[name]:.1f} ({m[name] / m[OURS]:.2f})' for m in medians.values())]
         for name in methods])
    return lines, medians


def memories(truth):
    """Return the table of peak memories."""
    methods = {**CORES, **CLASSES}
    rows_of = []
    for duration_s, rows in CASES[1::2]:
        values = modal_record(truth, duration_s, 1)
        rows_of.append([peak_bytes(lambda: run(values, RATE_HZ, rows, ORDERS))
                        for run, _ in methods.values()])
    return report.table(
        ['peak [MB]', *(f'{t:g} s, i = {i}' for t, i in CASES[1::2])],
        [[name, *(f'{r[k] / 2 ** 20:.0f}' for r in rows_of)] for k, name in enumerate(methods)])


def sliding(truth, repeats):
    """Return the table of one update: window 600 s, hop 1 s, i = 100, order 40."""
    rows, order, window_s = 100, 40, 600
    hop = round(RATE_HZ)
    values = modal_record(truth, window_s + repeats + 2, 1)
    ring = Ring(window_s, 2 * rows, 4)
    for k in range(window_s):
        ring.push(values[k * hop:(k + 1) * hop])
    settings = Identification(window_s=window_s, hop_s=1.0, block_rows=rows)
    monitor = Monitor(CHANNELS, RATE_HZ, 0, settings)
    monitor.push(values[:window_s * hop])
    at = {'ring': window_s, 'monitor': window_s}

    def hop_of(who):
        at[who] += 1
        return values[(at[who] - 1) * hop:at[who] * hop]

    def update(weighting):
        ring.push(hop_of('ring') if weighting == 'cva' else hop_of('ring'))
        at['ring'] = window_s + (at['ring'] - window_s) % repeats
        return poles_of(factorise(ring.covariances(1.0), rows, order, weighting), order, RATE_HZ)

    whole = values[:window_s * hop]
    runs = {
        'ours, one order, CVA': lambda: update('cva'),
        'ours, one order, UPC': lambda: update('upc'),
        'ours, whole monitor: bands, all orders, spreads, labels, tracks':
            lambda: monitor.push(hop_of('monitor')),
        'koma 1.3.6 hankel': lambda: koma('none')[0](whole, RATE_HZ, rows, (order,)),
        'pyOMA2 1.4.3 cov': lambda: pyoma2('cov')[0](whole, RATE_HZ, rows, (order,)),
    }
    m = times(runs, repeats, 1)
    first, second = list(runs)[:2]
    return report.table(
        ['window 600 s, hop 1 s, i = 100, order 40', 'median [ms]', 'ratio, CVA', 'ratio, UPC'],
        [[name, f'{1e3 * s:.2f}', f'{s / m[first]:.1f}', f'{s / m[second]:.1f}']
         for name, s in m.items()]), m


def spreads(truth, seeds, repeats):
    """Return the table of the batch with spreads: 600 s, i = 50, all orders 1 to 40."""
    rows, orders, at = 50, tuple(range(1, 41)), 24
    values = modal_record(truth, 600.0, 0)
    m = times({name: lambda run=run: run(values, RATE_HZ, rows, orders)
               for name, (run, _) in SPREADS.items()}, repeats, 1)
    found = {name: [] for name in SPREADS}
    with threadpool_limits(1):
        for seed in seeds:
            values = modal_record(truth, 600.0, seed)
            for name, (run, read) in SPREADS.items():
                poles = read(quiet(lambda: run(values, RATE_HZ, rows, orders)))
                found[name] += [p for p in poles if p.order == at]
    ratios = {name: spread_ratio(p, truth) for name, p in found.items()}
    return report.table(
        ['600 s, i = 50, every order from 1 to 40', 'median [s]', 'ratio',
         'predicted / Monte Carlo, frequency', 'damping'],
        [[name, f'{m[name]:.3f}', f'{m[name] / m["ours, UPC"]:.1f}', f'{r[0]:.2f}', f'{r[1]:.2f}']
         for name, r in ratios.items()]), m, ratios


def accuracies(title, methods, truth, record, seeds, rows, orders, pick=None):
    """Return the table of one accuracy test."""
    best = accuracy(methods, truth, record, seeds, rows, orders, pick)
    f = best[OURS][1]
    return report.table(
        [title, 'order', 'rms frequency error [%]', 'ratio', 'rms damping error [%]', 'MAC',
         'missed [%]'],
        [[name, n, f'{100 * a:.4f}', f'{a / f:.3f}', f'{100 * b:.2f}', f'{c:.4f}',
          f'{100 * d:.2f}'] for name, (n, a, b, c, d) in best.items()]), best


def automatic(truth, record, seeds, window_s, pick=None):
    """Return one line on what `identify` finds when nothing is chosen."""
    pick = np.ones(len(truth.frequency_hz), dtype=bool) if pick is None else pick
    settings = Identification(window_s=window_s, hop_s=window_s / 60.0)
    tables = []
    for seed in seeds:
        modes = identify(Samples(record(seed), RATE_HZ, CHANNELS), settings)[-1].modes
        poles = Poles(0, np.array([m.frequency_hz for m in modes]),
                      np.array([m.damping_ratio for m in modes]),
                      np.array([m.shape for m in modes]).reshape(len(modes), 4))
        tables.append(errors(truth, poles)[:, pick])
    a, b, c, d = summary(tables)
    return (f'`identify` as the operator has it, nothing chosen: {100 * a:.4f} % in frequency, '
            f'{100 * b:.2f} % in damping, MAC {c:.4f}, missed {100 * d:.2f} %.')


def main():
    """Run all parts and write docs/validation/peers.md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--quick', action='store_true', help='few seeds, and write nothing')
    args = parser.parse_args()
    seeds, repeats = (range(3), 3) if args.quick else (range(20), 9)
    truth, load = ten_modes(), os.getloadavg()[0]
    one, m = core_times(truth, repeats, 1)
    many, _ = core_times(truth, repeats, None)
    slide, u = sliding(truth, 5 if args.quick else 20)
    spread, s, ratios = spreads(truth, seeds, 1 if args.quick else 3)
    lines = ['## Batch core, one thread', '', *one, '## Batch core, default threads', '', *many,
             '## Peak memory', '', *memories(truth), '## Sliding update, one thread', '', *slide,
             '## With spreads, one thread', '', *spread, '## Accuracy', '']
    ratio = {}
    for duration_s in (60.0, 600.0):
        table, best = accuracies(
            f'ten modes, {duration_s:g} s, i = 50, {len(seeds)} seeds', ACCURATE, truth,
            lambda seed: modal_record(truth, duration_s, seed), seeds, 50, ORDERS)
        ratio[duration_s] = best[OURS][1] / min(v[1] for k, v in best.items() if 'ours' not in k)
        lines += [*table, automatic(truth, lambda seed: modal_record(truth, duration_s, seed),
                                    seeds, duration_s), '']
    pair = twin_arrays()
    table, close = accuracies(f'two close pairs, 600 s, i = 50, {len(seeds)} seeds', ACCURATE,
                              pair, lambda seed: modal_record(pair, 600.0, seed), seeds, 50,
                              tuple(range(8, 41, 2)))
    craft, record = spacecraft()
    fast = craft.frequency_hz > 2.0
    lines += [*table]
    table, best = accuracies(
        f'spacecraft above 2 Hz, 600 s, i = 60, {len(seeds)} seeds', ACCURATE, craft,
        lambda seed: record(600.0, seed), seeds, 60, tuple(range(40, 81, 4)), fast)
    ratio['craft'] = best[OURS][1] / min(v[1] for k, v in best.items() if 'ours' not in k)
    lines += [*table, automatic(craft, lambda seed: record(600.0, seed), seeds, 600.0, fast), '']
    head = [f'{len(seeds)} seeds, {repeats} turns; load of the machine at the start {load:.1f}, '
            f'at the end {os.getloadavg()[0]:.1f}.', '', '## Targets', '',
            *targets(m, u, s, ratios, ratio, close)]
    if args.quick:
        print('\n'.join([*head, *lines]))
    else:
        report.write('peers', 'Comparison with other packages', [*head, *lines],
                     command='bench_peers')


def targets(m, u, s, ratios, ratio, close):
    """Return the table of what was aimed at and what came out."""
    def over(case, name, ours=OURS):
        return m[case][name] / m[case][ours]

    update = list(u)
    rows = []

    def row(what, aim, value, least=True):
        met = value >= aim if least else value <= aim
        rows.append([what, f'{">=" if least else "<="} {aim:g}', f'{value:.2f}',
                     'yes' if met else '**no**'])

    for name, aim in (('pyOMA2 1.4.3 cov', 50.0), ('koma 1.3.6 hankel', 15.0)):
        for k in (0, 1):
            row(f'update against {name}, {update[k][-3:]}', aim, u[name] / u[update[k]])
    for (duration_s, rows_i), koma_aim, cov_aim, class_aim in (
            ((60.0, 50), 2.5, 3.0, 12.0), ((600.0, 50), 4.0, 12.0, 20.0)):
        for ours in ('ours, CVA', 'ours, UPC'):
            for name, aim in (('koma 1.3.6 hankel', koma_aim), ('pyOMA2 1.4.3 cov', cov_aim),
                              ('pyOMA2 1.4.3 class SSI', class_aim)):
                row(f'batch core {duration_s:g} s, i = {rows_i}, {ours[6:]}, against {name}',
                    aim, over((duration_s, rows_i), name, ours))
    for name, aim in (('pyOMA2 1.4.3, step 1', 30.0), ('pyOMA toolbox 1.1.0', 7.0)):
        row(f'with spreads, against {name}', aim, s[name] / s['ours, UPC'])
    for k, what in enumerate(('frequency', 'damping')):
        row(f'spread of {what} over Monte Carlo', 0.8, ratios['ours, UPC'][k])
        row(f'spread of {what} over Monte Carlo', 1.25, ratios['ours, UPC'][k], False)
    for key, value in ratio.items():
        name = f'{key:g} s, ten modes' if key != 'craft' else 'spacecraft'
        row(f'rms frequency error over the best peer, {name}', 1.0, value, False)
    row('MAC of the close pairs', 0.98, close[OURS][3])
    return report.table(['measure', 'target', 'measured', 'met'], rows)


if __name__ == '__main__':
    main()
