"""
Measure the diagnosis against a reference recording on measured records, with effects injected.

    SSI_ROS_DATA=FOLDER python -m validation.gap_hardware nulls
    SSI_ROS_DATA=FOLDER python -m validation.gap_hardware effects [SETUP ...]
"""
import argparse
import time

import numpy as np
from scipy.signal import resample_poly
from ssi_ros.effects import effect_class
from ssi_ros.gap.reference import diagnose_reference
from ssi_ros.records import Samples

from validation.gap_reference import bridge, data_folder, f16
from validation.hardware_effects import CASES, Record

F16_LIVE, BRIDGE_LIVE = (2.0, 15.0), (0.2, 1.2)         # where the records live [Hz]
TURNS = 8               # segments of a record that go to either side in turn


def halves(values):
    """Return the first half and the second."""
    return values[:len(values) // 2], values[len(values) // 2:]


def thirds(values):
    """Return the first third and the last."""
    size = len(values) // 3
    return values[:size], values[-size:]


def turns(values):
    """Return every other of 2 TURNS segments, and the rest."""
    parts = np.array_split(values, 2 * TURNS)
    return np.concatenate(parts[::2]), np.concatenate(parts[1::2])


def backwards(values):
    """Return the second half, and the first."""
    return halves(values)[::-1]


def short(values):
    """Return two pieces of a tenth from the middle."""
    size = len(values) // 10
    return values[4 * size:5 * size], values[6 * size:7 * size]


SPLITS = {f.__name__: f for f in (halves, thirds, turns, backwards, short)}


def load(name, folder):
    """Return samples and the band where they live, of a name such as f16_5."""
    if name == 'bridge':
        return bridge(folder), BRIDGE_LIVE
    return f16(int(name[-1]), folder), F16_LIVE


def prepared(name, channels, slower, folder):
    """Return some channels of a record at a lower rate, and the band where it lives."""
    samples, live = load(name, folder)
    values = samples.values[:, list(channels)] if channels else samples.values
    names = [samples.channels[c] for c in channels] if channels else samples.channels
    if slower > 1:
        values = resample_poly(values, 1, slower, axis=0)
    return Samples(values, samples.rate_hz / slower, tuple(names)), live


# record, channels (all if empty), how many times slower
WAYS = {
    'f16_1': (('f16_1', (), 1), ('f16_1', (1, 2), 4), ('f16_1', (2,), 1)),
    'f16_2': (('f16_2', (), 1), ('f16_2', (), 8), ('f16_2', (0,), 4)),
    'f16_5': (('f16_5', (), 1), ('f16_5', (0, 1), 4), ('f16_5', (2,), 4)),
    'bridge': (('bridge', (), 1), ('bridge', (0, 3), 3), ('bridge', (2,), 1))}
SETUPS = {
    'f16': ('f16_1', (), 1, 'halves'),
    'bridge': ('bridge', (), 1, 'halves'),
    'wing': ('f16_5', (1,), 4, 'halves'),
    'joint': ('f16_2', (1, 2), 2, 'thirds'),
}


def nulls(*names):
    """Print what is said of two parts of one record, without an effect."""
    folder = data_folder()
    print('| record | channels | rate | split | outcome | p | named | CPU s |\n' + '|---' * 8
          + '|', flush=True)
    alarms = total = 0
    for name in names or WAYS:
        for way in WAYS[name]:
            samples, _ = prepared(*way, folder)
            for split, parts in SPLITS.items():
                pair = [Samples(v, samples.rate_hz, samples.channels)
                        for v in parts(samples.values)]
                found, took = timed(*pair)
                total += 1
                alarms += found.outcome not in ('WITHIN_FLOOR', 'TOO_LITTLE_DATA')
                print(f'| {name} | {len(samples.channels)} | {samples.rate_hz:g} | {split} | '
                      f'{found.outcome} | {found.gap["p_value"]:.2g} | '
                      f'{" + ".join(found.verdict["effects"])} | {took:.1f} |', flush=True)
    print(f'\n{alarms} alarms in {total} pairs')


def timed(one, two):
    """Return the diagnosis and the CPU seconds that it took."""
    begin = time.process_time()
    found = diagnose_reference(one, two)
    return found, time.process_time() - begin


def effects(*names):
    """Print what is said of every effect injected into the second part of every setup."""
    folder = data_folder()
    print('| setup | injected | outcome | named | probability | in class | site right | '
          'told (true) | closed | CPU s |\n' + '|---' * 10 + '|', flush=True)
    right = total = 0
    for name in names or SETUPS:
        *way, split = SETUPS[name]
        samples, live = prepared(*way, folder)
        one, rest = SPLITS[split](samples.values)
        for k, (case, (effect, sizes, change, several)) in enumerate(CASES.items()):
            if several and len(samples.channels) == 1:
                continue
            for size in sizes:
                values, truth = change(Record(rest, samples.rate_hz, live), size,
                                       np.random.default_rng(100 + k))
                try:
                    found, took = timed(*(Samples(v, samples.rate_hz, samples.channels)
                                          for v in (one, values)))
                except Exception as error:      # a row of its own; the others are still told
                    total += 1
                    print(f'| {name} | {case} {size:g} | CRASH {error!r} |', flush=True)
                    continue
                row, good = told(found, effect, truth)
                total, right = total + 1, right + good
                print(f'| {name} | {case} {size:g} | {row} | {took:.1f} |', flush=True)
    print(f'\n{right} of {total} in class')


def told(found, effect, truth):
    """Return the cells of a row, and whether the effect is in the class."""
    top = found.candidates[0]
    named = ' + '.join(found.verdict['effects'])
    good = effect in found.verdict['class']
    places = [k.split('.', 1)[1] for k in top.parameters if k.count('.') > 1]
    site = max(found.where['site'], key=found.where['site'].get) if named else ''
    values = ', '.join(
        f'{k.split(".")[1]} {v.value:.4g} ({truth[k.split(".")[1]]:.4g})'
        for k, v in top.parameters.items() if named and k.split('.')[1] in truth)
    right = effect_class(effect).site.value == site
    cells = (found.outcome, ' '.join([named, *places]) if named else '',
             f'{found.verdict["probability"]:.2f}', 'yes' if good else 'no',
             'yes' if right else site, values, f'{top.closed:.2f}')
    return ' | '.join(cells), good


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('kind', choices=('nulls', 'effects'))
    parser.add_argument('names', nargs='*', metavar='NAME',
                        help=f'records of nulls: {", ".join(WAYS)}; setups of effects: '
                             f'{", ".join(SETUPS)}; all by default')
    given = parser.parse_args()
    {'nulls': nulls, 'effects': effects}[given.kind](*given.names)
