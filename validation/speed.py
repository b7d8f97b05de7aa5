"""
Measure what the verbs cost: processor time and peak memory of fresh processes.

    python -m validation.speed [PART ...] [--beside FOLDER] [--only PATTERN] [--again]

Parts are start, diagnosis, length, size, verbs and live; all by default. With `--beside`, another
checkout of this repository, every command runs in that tree as well, right before it runs in this
one. Results of earlier runs are kept in build/speed.json until `--again`; the page is written of
all that there are. `--only` is a regular expression of the names of commands.
"""
import argparse
from dataclasses import dataclass, replace
import json
import os
from pathlib import Path
import re
import resource
import subprocess
import sys

import numpy as np
from ssi_ros.effects import save_configuration
from ssi_ros.model import load_spacecraft
from ssi_ros.model.spacecraft import Sensor
from ssi_ros.model.uncertainty import EXACT

from validation.report import figure, ROOT, table, write

KEPT = ROOT / 'build' / 'speed.json'
FOLDER = ROOT / 'build' / 'speed'           # models, bags and the cache of templates
LIMIT_S, LIMIT_BYTES = 900, 12 << 30        # of one command; what needs more is stopped
EFFECTS = (
    'sensor_gain:channel=e1_a,scale=1.04', 'array_asymmetry:array=E2,scale=0.98',
    'stiffness_scale:scale=0.99', 'damping_scale:scale=1.5', 'hub_inertia:scale=1.2',
    'channel_delay:channel=e1_b,delay_s=0.001', 'clock_rate:ppm=3000',
    'excitation_colour:corner_hz=30', 'harmonic_disturbance:frequency_hz=12.3,torque_n_m=0.15',
    'hinge_freeplay:array=E1,gap_rad=1e-5,stiffness_n_m_rad=1e5',
    'hinge_friction:array=E1,torque_n_m=0.05,stiffness_n_m_rad=1e5',
    'sensor_noise:channel=e2_a,scale=3', 'quantisation:step_m_s2=0.01',
    'saturation:limit_m_s2=0.08', 'dropped_samples:fraction=0.03',
    'impulsive_events:rate_per_min=6,impulse_n_m_s=0.1',
    'sensor_crosstalk:source=e1_a,channel=e1_b,gain=0.05',
    'added_mass:mass_kg=1.0', 'stiffness_drift:change=0.02',
    'nonstationary_excitation:depth=0.3,period_s=60')
UNKNOWN = 'sensor_gain:channel=e1_a,scale=1.2', 'hub_inertia:scale=1.3', 'damping_scale:scale=3'
HOURS = 1, 3, 24
CHANNELS, MODES = (4, 16, 64), (20, 100)
TARGETS = {'import': 0.3, '--help': 0.3, 'no gap': 0.7, '1 h': 6, '24 h': 60,
           'report --model': 8, 'identify --plot': 6, 'place': 20, 'identifiability': 3}


@dataclass(frozen=True)
class Cost:
    """What one process took; NaN where it was stopped."""

    cpu_s: float
    peak_mb: float
    said: str = ''


def cost(tree, *argv, python=False):
    """
    Run the command line of a tree, or its Python, in a fresh process of one thread.

    Parameters
    ----------
    tree : Path
        Checkout whose code runs.
    argv : str
        Words of the command line.
    python : bool
        Whether they are those of the interpreter.

    Returns
    -------
    Cost

    """
    def limited():
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))
        resource.setrlimit(resource.RLIMIT_AS, (LIMIT_BYTES, LIMIT_BYTES))
    environment = {**os.environ, 'PYTHONPATH': str(tree), 'OMP_NUM_THREADS': '1',
                   'XDG_CACHE_HOME': str(FOLDER / f'cache_{tree.name}'),
                   'PYTHONPYCACHEPREFIX': str(FOLDER / f'bytecode_{tree.name}')}
    environment.pop('PYTHONDONTWRITEBYTECODE', None)    # a second start has compiled modules
    words = [sys.executable, *(() if python else ('-m', 'ssi_ros')), *map(str, argv)]
    with subprocess.Popen(words, cwd=tree, env=environment, text=True, preexec_fn=limited,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as process:
        said = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = code = os.waitstatus_to_exitcode(status)
    if code not in (0, 1) or 'Traceback' in said:       # 1 is an answer: not explained
        print(f'{" ".join(words[1:])}: exit code {code}\n{said[-600:]}', flush=True)
        return Cost(float('nan'), used.ru_maxrss / 1024, said)
    return Cost(used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, said)


def bag(name, *words):
    """Return a function that returns a bag, simulated by this tree where it is not there yet."""
    def made():
        path = FOLDER / name
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            cost(ROOT, 'simulate', path, *words)
        return path
    return made


def exact(name, channels=4, modes=20):
    """Return the file of the packaged spacecraft, exact, of so many channels and modes."""
    path, craft = FOLDER / f'{name}.yaml', load_spacecraft()
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        each = channels // 4
        places = [(n, a, s * (0.9 if k % 2 else 0.5), 8.0 * (k + 1) / each - 0.1)
                  for n, a in enumerate(('E1', 'E2')) for s in (1, -1) for k in range(each)]
        sensors = craft.sensors if channels == 4 else tuple(
            Sensor(f's{i:02d}', a, along_m=x, lateral_m=y)
            for i, (_, a, y, x) in enumerate(places))
        # many modes need a finer mesh, and softer plates to stay below half the rate
        finer = 1 if modes == 20 else 2
        arrays = tuple(replace(a, modes=modes // 2, plate=replace(
            a.plate, elements_along=16 * finer, elements_across=4 * finer,
            stiffness_n_m=a.plate.stiffness_n_m * min(1.0, (20 / modes) ** 2)))
            for a in craft.arrays)
        save_configuration(replace(craft, uncertainty=EXACT, sensors=sensors, arrays=arrays),
                           (), path)
    return path


def start():
    """Yield the commands of importing and helping."""
    yield 'import', ('-c', 'import ssi_ros'), True
    yield '--help', ('--help',), False
    yield 'diagnose --help', ('diagnose', '--help'), False
    yield 'import of the diagnosis', ('-c', 'import ssi_ros.gap.driver'), True


def diagnosis():
    """Yield the diagnoses of ten minutes beside an exact model, the first start of all first."""
    model = exact('exact')

    def of(name, *effects, seed):
        words = [w for e in effects for w in ('--effect', e)]
        return ('diagnose', bag(name, '--seed', seed, *words), '--model', model), False
    yield 'first start', *of('null_1', seed=1)
    for seed in (1, 2, 3):
        yield f'no gap, seed {seed}', *of(f'null_{seed}', seed=seed)
    for i, text in enumerate(EFFECTS):
        yield text, *of(f'effect_{i}', text, seed=100 + i)
    yield 'three at once, UNEXPLAINED', *of('unknown', *UNKNOWN, seed=200)


def length():
    """Yield the diagnoses of long records, without a gap and with one."""
    for hours in HOURS:
        words = '--duration-s', 3600 * hours, '--seed'
        quiet = bag(f'null_{hours}h', *words, 5)
        other = bag(f'softer_{hours}h', *words, 6, '--effect', EFFECTS[1])
        yield f'{hours} h', ('diagnose', quiet, '--model', exact('exact')), False
        yield f'{hours} h, an array 2 % softer', ('diagnose', other, '--model',
                                                  exact('exact')), False


def size():
    """Yield the diagnoses of more channels, modes and effects; the first start is in it."""
    for channels, modes in [(c, MODES[0]) for c in CHANNELS] + [(CHANNELS[0], MODES[1])]:
        name = f'exact_{channels}_{modes}'
        model = exact(name, channels, modes)
        record = bag(f'bag_{channels}_{modes}', '--model', model, '--seed', 7)
        for text in (f'{channels} channels, {modes} modes, first', f'{channels} channels, '
                     f'{modes} modes'):
            yield text, ('diagnose', record, '--model', model), False
    for names in ('sensor_gain', 'sensor_gain,array_asymmetry,hub_inertia,damping_scale'):
        yield f'effects {names.count(",") + 1}', (
            'diagnose', bag('null_1', '--seed', 1), '--model', exact('exact'), '--effects',
            names), False


def verbs():
    """Yield the other verbs."""
    record, model = bag('null_1', '--seed', 1), exact('exact')
    page = FOLDER / 'page.html'
    yield 'identify', ('identify', record), False
    yield 'identify --plot', ('identify', record, '--plot', FOLDER / 'plots'), False
    yield 'report', ('report', record, '--output', page), False
    yield 'report --model', ('report', record, '--model', model, '--output', page), False
    yield 'place', ('place',), False
    yield 'identifiability', ('identifiability', '--duration-s', 600), False
    calibrated = FOLDER / 'calibrated.yaml'
    yield 'calibrate', ('calibrate', record, '--output', calibrated), False
    other = bag('unknown', '--seed', 200, *(w for e in UNKNOWN for w in ('--effect', e)))
    yield 'calibrated, three at once', ('diagnose', other, '--model', calibrated), False


def live():
    """Yield the meter of the gap node; it says itself what an update takes."""
    yield 'meter', ('-m', 'validation.gap_live', 'cost'), True


PARTS = {f.__name__: f for f in (start, diagnosis, length, size, verbs, live)}


def measure(part, trees, only, kept):
    """Run the commands of a part in every tree; enter and keep {command: [Cost, ...]}."""
    found = kept.setdefault(part, {})
    for name, words, python in PARTS[part]():
        if not re.search(only, name):
            continue
        words = [w() if callable(w) else w for w in words]
        found[name] = [vars(cost(t, *words, python=python)) for t in trees]
        print(part, name, *(f'{c["cpu_s"]:.2f} s {c["peak_mb"]:.0f} MB' for c in found[name]),
              flush=True)
        KEPT.parent.mkdir(exist_ok=True)
        KEPT.write_text(json.dumps(kept))


def number(value, digits=2):
    """Return a number as text; what was stopped says so."""
    return f'{value:.{digits}f}' if np.isfinite(value) else 'stopped'


def rows_of(found):
    """Yield the rows of a table: every command, now, before, ratio, memory, target."""
    for name, costs in found.items():
        now, before = costs[-1], costs[0] if len(costs) > 1 else None
        yield [name, number(now['cpu_s']), number(before['cpu_s']) if before else '-',
               number(now['cpu_s'] / before['cpu_s']) if before else '-',
               f'{now["peak_mb"]:.0f}', f'{before["peak_mb"]:.0f}' if before else '-',
               next((t for n, t in TARGETS.items() if re.fullmatch(f'{n}(, seed .)?', name)),
                    '-')]


def summary(found):
    """Return the lines on single effects: median, 95 %, worst."""
    lines = []
    for at, word in ((-1, 'now'), (0, 'before')):
        if at == -1 or len(next(iter(found.values()))) > 1:
            times = [found[e][at]['cpu_s'] for e in EFFECTS if e in found]
            every = max(c[at]['cpu_s'] for c in found.values())
            lines.append(f'Single effects, {word}: median {np.median(times):.1f} s (target 1.5), '
                         f'95 % {np.quantile(times, 0.95):.1f} s (4), worst {max(times):.1f} s; '
                         f'with the unexplained one {every:.1f} s (15).')
    return [*lines, '']


def draw(kept):
    """Draw cost over length and over channels."""
    shape, save = figure('speed.png')
    parts = [p for p in (('length', r'(\d+) h$', 'length [h]'), (
        'size', r'(\d+) channels, 20 modes$', 'channels')) if p[0] in kept]
    for axes, (part, pattern, label) in zip(np.ravel(shape.subplots(1, len(parts))), parts):
        found = sorted((int(m[1]), c) for n, c in kept[part].items()
                       if (m := re.match(pattern, n)))
        for word, style, points in (
                ('now', 'o-', [(x, c[-1]['cpu_s']) for x, c in found]),
                ('before', 's--', [(x, c[0]['cpu_s']) for x, c in found if len(c) > 1])):
            if points:
                axes.loglog(*zip(*points), style, label=word)
        axes.set(xlabel=label, ylabel='processor time [s]', xticks=[x for x, _ in found],
                 xticklabels=[x for x, _ in found])
        axes.minorticks_off()
        axes.legend()
    save()


def page(kept, beside):
    """Write docs/validation/speed.md of all that was measured."""
    words = {'start': 'Import and help', 'diagnosis': 'Ten minutes of 4 channels at 100 Hz',
             'length': 'Length', 'size': 'Channels, modes, effects', 'verbs': 'Other verbs',
             'live': 'The meter of the gap node'}
    lines = ['Processor time and peak memory of a fresh process of one thread, start of Python '
             'and reading of the bag included. "Before" is '
             + (f'commit {beside}, measured in turns with this one.' if beside else 'not there.'),
             'Targets in seconds are those that were set, not those that are met.', '']
    for part, title in words.items():
        if part not in kept:
            continue
        lines += [f'## {title}', '']
        if part == 'live':
            lines += ['```', *kept[part]['meter'][-1]['said'].strip().splitlines(), '```',
                      'The target is 2 % of a core.', '']
            continue
        if part == 'diagnosis':
            lines += summary(kept[part])
        lines += table(['what', 'now [s]', 'before [s]', 'ratio', 'now [MB]', 'before [MB]',
                        'target [s]'], rows_of(kept[part]))
        if part == 'length':
            draw(kept)
            lines += ['![cost over length and channels](../figures/speed.png)', '']
    write('speed', 'Speed', lines)


def main():
    """Measure, keep, write the page."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('parts', nargs='*', metavar='PART', help=', '.join(PARTS))
    parser.add_argument('--beside', type=Path, help='another checkout, to compare with')
    parser.add_argument('--only', default='', help='commands that are measured')
    parser.add_argument('--again', action='store_true', help='forget what was measured before')
    args = parser.parse_args()
    kept = {} if args.again or not KEPT.exists() else json.loads(KEPT.read_text())
    trees = [t.resolve() for t in (args.beside, ROOT) if t]
    for part in args.parts or PARTS:
        measure(part, trees, args.only, kept)
    beside = args.beside and subprocess.run(
        ['git', 'rev-parse', '--short', 'HEAD'], cwd=args.beside, text=True,
        capture_output=True).stdout.strip()
    page(kept, beside)


if __name__ == '__main__':
    main()
