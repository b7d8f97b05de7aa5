"""
Measure the diagnosis against a reference recording on measured records, with effects injected.

    SSI_ROS_DATA=FOLDER python -m validation.gap_hardware nulls
    SSI_ROS_DATA=FOLDER python -m validation.gap_hardware effects [SETUP ...]
    SSI_ROS_DATA=FOLDER python -m validation.gap_hardware other_nulls
    SSI_ROS_DATA=FOLDER python -m validation.gap_hardware other_effects [SETUP ...]
"""
import argparse
from functools import partial
import time

import numpy as np
from scipy.signal import resample_poly
from ssi_ros.effects import effect_class
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal
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


def parts(first, second):
    """Return a split into two parts, each from one share of a record to another."""
    def split(values):
        return tuple(values[int(len(values) * low):int(len(values) * high)]
                     for low, high in (first, second))
    return split


def in_turns(count):
    """Return a split into every other of so many segments, and the rest."""
    def split(values):
        segments = np.array_split(values, count)
        return np.concatenate(segments[::2]), np.concatenate(segments[1::2])
    return split


OTHER_SPLITS = {
    'third 1, 2': parts((0, 1 / 3), (1 / 3, 2 / 3)),
    'third 2, 3': parts((1 / 3, 2 / 3), (2 / 3, 1)),
    'third 3, 1': parts((2 / 3, 1), (0, 1 / 3)), 'quarter 1, 4': parts((0, 0.25), (0.75, 1)),
    'quarter 2, 3': parts((0.25, 0.5), (0.5, 0.75)), 'quarter, rest': parts((0, 0.25), (0.25, 1)),
    'rest, quarter': parts((0.25, 1), (0, 0.25)), 'turns of 4': in_turns(4),
    'turns of 40': in_turns(40), 'unequal': parts((0.03, 0.41), (0.47, 0.99))}


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
# nothing was set by these
OTHER_WAYS = {
    'f16_1': (('f16_1', (0, 1), 1), ('f16_1', (0,), 2), ('f16_1', (1,), 8), ('f16_1', (), 5)),
    'f16_2': (('f16_2', (1, 2), 1), ('f16_2', (2,), 2), ('f16_2', (1,), 10), ('f16_2', (), 3)),
    'f16_5': (('f16_5', (1, 2), 1), ('f16_5', (0,), 8), ('f16_5', (1,), 2), ('f16_5', (), 5),
              ('f16_5', (), 10)),
    'bridge': (('bridge', (1,), 1), ('bridge', (4,), 3), ('bridge', (0, 1), 1),
               ('bridge', (1, 3, 4), 2), ('bridge', (), 4))}
OTHER_SETUPS = {
    'a': ('f16_1', (0,), 8, 'halves'), 'b': ('f16_5', (0, 2), 5, 'third 1, 2'),
    'c': ('f16_2', (), 4, 'third 2, 3'), 'd': ('bridge', (1,), 1, 'halves'),
    'e': ('bridge', (0, 2), 2, 'halves'), 'f': ('bridge', (1, 3, 4), 1, 'third 1, 2'),
    'g': ('f16_1', (1, 2), 4, 'unequal'), 'h': ('f16_2', (1,), 10, 'halves'),
    'i': ('f16_5', (), 5, 'halves')}


def nulls(*names, ways=WAYS, splits=SPLITS):
    """Print what is said of two parts of one record, without an effect."""
    folder = data_folder()
    print('| record | channels | rate | split | outcome | p | named | CPU s |\n' + '|---' * 8
          + '|', flush=True)
    alarms = total = 0
    for name in names or ways:
        for way in ways[name]:
            samples, _ = prepared(*way, folder)
            for split, both in splits.items():
                pair = [Samples(v, samples.rate_hz, samples.channels)
                        for v in both(samples.values)]
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
    found = diagnose(RecordedNominal(one), two)
    return found, time.process_time() - begin


def effects(*names, setups=SETUPS, seed=100):
    """Print what is said of every effect injected into the second part of every setup."""
    folder = data_folder()
    print('| setup | injected | outcome | named | probability | in class | site right | '
          'found (true) | closed | CPU s |\n' + '|---' * 10 + '|', flush=True)
    right = total = 0
    for name in names or setups:
        *way, split = setups[name]
        samples, live = prepared(*way, folder)
        one, rest = (SPLITS | OTHER_SPLITS)[split](samples.values)
        for k, (case, (effect, sizes, change, several)) in enumerate(CASES.items()):
            if several and len(samples.channels) == 1:
                continue
            for size in sizes:
                if case.startswith('low-pass') and size * live[1] > 0.49 * samples.rate_hz:
                    continue
                values, truth = change(Record(rest, samples.rate_hz, live), size,
                                       np.random.default_rng(seed + k))
                try:
                    found, took = timed(*(Samples(v, samples.rate_hz, samples.channels)
                                          for v in (one, values)))
                except Exception as error:      # a row of its own; the others still follow
                    total += 1
                    print(f'| {name} | {case} {size:g} | CRASH {error!r} |', flush=True)
                    continue
                row, good = row_of(found, effect, truth)
                total, right = total + 1, right + good
                print(f'| {name} | {case} {size:g} | {row} | {took:.1f} |', flush=True)
    print(f'\n{right} of {total} in class')


def row_of(found, effect, truth):
    """Return the cells of a row, and whether the effect is in the class."""
    top = found.candidates[0]
    named = ' + '.join(found.verdict['effects'])
    good = effect in found.verdict['class']
    places = [k.split('.', 1)[1] for k in top.parameters if k.count('.') > 1]
    site = max(found.where.site, key=found.where.site.get) if named else ''
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
    parser.add_argument('kind', choices=('nulls', 'effects', 'other_nulls', 'other_effects'))
    parser.add_argument('names', nargs='*', metavar='NAME',
                        help=f'records of nulls: {", ".join(WAYS)}; setups of effects: '
                             f'{", ".join(SETUPS)}; all by default')
    given = parser.parse_args()
    {'nulls': nulls, 'effects': effects,
     'other_nulls': partial(nulls, ways=OTHER_WAYS, splits=OTHER_SPLITS),
     'other_effects': partial(effects, setups=OTHER_SETUPS, seed=900)}[given.kind](*given.names)
