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
from ssi_ros.identify import Identification, identify, Monitor, SlidingSsiCov  # noqa: E402
from ssi_ros.records import Samples  # noqa: E402
from threadpoolctl import threadpool_limits  # noqa: E402
from validation import report  # noqa: E402
from validation.bench_data import modal_record, RATE_HZ, spacecraft  # noqa: E402
from validation.bench_data import ten_modes, twin_arrays  # noqa: E402
from validation.bench_measure import accuracy, errors, peak_bytes  # noqa: E402
from validation.bench_measure import spread_ratio, summary, times  # noqa: E402
from validation.bench_methods import ACCURATE, CLASSES, CORES, koma  # noqa: E402
from validation.bench_methods import Poles, pyoma2, quiet, SPREADS  # noqa: E402

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
    rows, order, window_s, hop = 100, 40, 600.0, round(RATE_HZ)
    values = modal_record(truth, window_s + repeats + 2, 1)
    whole = values[:round(window_s * RATE_HZ)]

    def updates(stream):
        """Return a function that pushes the next hop, the record behind it already taken in."""
        stream.push(whole)
        hops = iter(np.split(values[len(whole):], range(hop, len(values) - len(whole), hop)))
        return lambda: stream.push(next(hops))

    monitor = Monitor(CHANNELS, RATE_HZ, 0, Identification(window_s=window_s, hop_s=1.0))
    warm = {w: SlidingSsiCov(4, RATE_HZ, window_s, 1.0, rows, order, w) for w in ('cva', 'upc')}
    runs = {
        'ours, one order, CVA': updates(warm['cva']),
        'ours, one order, UPC': updates(warm['upc']),
        'ours, whole monitor: bands, all orders, spreads, labels, tracks': updates(monitor),
        'koma 1.3.6 hankel': lambda: koma('none')[0](whole, RATE_HZ, rows, (order,)),
        'pyOMA2 1.4.3 cov': lambda: pyoma2('cov')[0](whole, RATE_HZ, rows, (order,)),
    }
    m = times(runs, repeats, 1)
    first, second = list(runs)[:2]
    lines = report.table(
        ['window 600 s, hop 1 s, i = 100, order 40', 'median [ms]', 'ratio, CVA', 'ratio, UPC'],
        [[name, f'{1e3 * s:.2f}', f'{s / m[first]:.1f}', f'{s / m[second]:.1f}']
         for name, s in m.items()])
    for w, stream in warm.items():
        lines += [f'{w.upper()}: {stream.warm} of {stream.warm + stream.whole} windows were '
                  'renewed from the one before, the others decomposed as a whole.', '']
    return lines, m


def spreads(truth, seeds, repeats):
    """Return the table of the batch with spreads: 600 s, i = 50, all orders 1 to 40."""
    rows, orders, at = 50, tuple(range(1, 41)), 24      # pyOMA2 is wrong for a step of 2
    values = modal_record(truth, 600.0, 0)
    m = times({name: lambda run=run: run(values, RATE_HZ, rows, orders)
               for name, (run, _) in SPREADS.items()}, repeats, 1)
    found = {name: [] for name in SPREADS}
    few = orders[:at + 1]
    with threadpool_limits(1):
        for seed in seeds:
            values = modal_record(truth, 600.0, seed)
            for name, (run, read) in SPREADS.items():
                poles = read(quiet(lambda: run(values, RATE_HZ, rows, few)))
                found[name] += [p for p in poles if p.order == at]
    ratios = {name: spread_ratio(p, truth) for name, p in found.items()}
    return report.table(
        ['600 s, i = 50, every order from 1 to 40', 'median [s]', 'ratio',
         'predicted / Monte Carlo, frequency', 'damping'],
        [[name, f'{m[name]:.3f}', f'{m[name] / m[OURS]:.1f}', f'{r[0]:.2f}', f'{r[1]:.2f}']
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


def precision(seeds, results):
    """Return the tables of all accuracy tests; keep the ratios to the best peer in `results`."""
    ten, pair, (craft, record) = ten_modes(), twin_arrays(), spacecraft()
    cases = [(f'ten modes, {t:g} s, i = 50', ten, 50, ORDERS, t, None,
              lambda seed, t=t: modal_record(ten, t, seed)) for t in (60.0, 600.0)]
    cases += [('two close pairs, 600 s, i = 50', pair, 50, tuple(range(8, 41, 2)), 600.0, None,
               lambda seed: modal_record(pair, 600.0, seed, common=0.7)),
              ('spacecraft above 2 Hz, 600 s, i = 60', craft, 60, tuple(range(40, 81, 4)), 600.0,
               craft.frequency_hz > 2.0, lambda seed: record(600.0, seed))]
    lines = []
    for title, truth, rows, orders, window_s, pick, make in cases:
        table, best = accuracies(f'{title}, {len(seeds)} seeds', ACCURATE, truth, make, seeds,
                                 rows, orders, pick)
        lines += [*table, automatic(truth, make, seeds, window_s, pick), '']
        results['accuracy'][title] = best
        print('\n'.join(lines[-len(table) - 2:]), flush=True)
    return lines


def main():
    """Run all parts and write docs/validation/peers.md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--quick', action='store_true', help='little of all, and write nothing')
    parser.add_argument('--seeds', type=int, default=20)
    parser.add_argument('--repeats', type=int, default=9)
    args = parser.parse_args()
    if args.quick:
        args.seeds, args.repeats = 3, 3
    truth, seeds, load = ten_modes(), range(args.seeds), os.getloadavg()[0]
    results = {'accuracy': {}}
    lines = []

    def part(title, table):
        lines.extend([f'## {title}', '', *table])
        print('\n'.join(lines[-len(table) - 2:]), flush=True)

    table, results['core'] = core_times(truth, args.repeats, 1)
    part('Batch core, one thread, processor time', table)
    table, results['update'] = sliding(truth, 3 * args.repeats)
    part('Sliding update, one thread, processor time', table)
    table, results['spreads'], results['ratios'] = spreads(truth, seeds, 1 + args.repeats // 4)
    part('With spreads, one thread, processor time', table)
    part('Accuracy, each method at its own best order', precision(seeds, results))
    part('Batch core, default threads, time on the wall', core_times(truth, args.repeats, None)[0])
    part('Peak memory', memories(truth))
    head = [f'{len(seeds)} seeds, {args.repeats} turns; load of the machine at the start '
            f'{load:.1f}, at the end {os.getloadavg()[0]:.1f}.', '', '## Targets', '',
            *targets(results), *lines]
    if args.quick:
        print('\n'.join(head))
    else:
        report.write('peers', 'Comparison with other packages', head,
                     command=f'bench_peers --seeds {args.seeds} --repeats {args.repeats}')


def targets(results):
    """Return the table of what was aimed at and what came out."""
    rows = []

    def row(what, aim, value, least=True):
        met = value >= aim if least else value <= aim
        rows.append([what, f'{">=" if least else "<="} {aim:g}', f'{value:.2f}',
                     'yes' if met else '**no**'])

    u, s, ratios = results['update'], results['spreads'], results['ratios']
    for name, aim in (('pyOMA2 1.4.3 cov', 50.0), ('koma 1.3.6 hankel', 15.0)):
        for own in list(u)[:2]:
            row(f'update against {name}, {own[-3:]}', aim, u[name] / u[own])
    for case, aims in (((60.0, 50), (2.5, 3.0, 12.0)), ((600.0, 50), (4.0, 12.0, 20.0))):
        m = results['core'][case]
        for own in ('ours, CVA', 'ours, UPC'):
            for name, aim in zip(('koma 1.3.6 hankel', 'pyOMA2 1.4.3 cov',
                                  'pyOMA2 1.4.3 class SSI'), aims):
                row(f'batch core {case[0]:g} s, i = {case[1]}, {own[6:]}, against {name}', aim,
                    m[name] / m[own])
    for name, aim in (('pyOMA2 1.4.3, step 1', 30.0), ('pyOMA toolbox 1.1.0', 7.0)):
        row(f'with spreads, against {name}', aim, s[name] / s[OURS])
    for k, what in enumerate(('frequency', 'damping')):
        row(f'spread of {what} over Monte Carlo', 0.8, ratios[OURS][k])
        row(f'spread of {what} over Monte Carlo', 1.25, ratios[OURS][k], False)
    for title, best in results['accuracy'].items():
        peer = min(v[1] for k, v in best.items() if 'ours' not in k)
        row(f'rms frequency error over the best peer, {title}', 1.0, best[OURS][1] / peer, False)
        if 'pairs' in title:
            row(f'MAC, {title}', 0.98, best[OURS][3])
    return report.table(['measure', 'target', 'measured', 'met'], rows)


if __name__ == '__main__':
    main()
