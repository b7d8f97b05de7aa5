"""
Measure the diagnosis against a healthy recording where every level of excitation differs.

    python -m validation.gap_levels [--seeds 0 1] [--cases null gain ...] [--seconds 600]

The spacecraft of both recordings is not the model: its component modes, couplings and sensor
shapes are off by amounts drawn from the seed, the same in both. Torque about x, torque about y
and process noise of the record are each 3 to 6 dB above or below those of the reference.
"""
import argparse
from dataclasses import replace
import time

import numpy as np
from ssi_ros.effects import effect_class, inject, parse_effect, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.model import load_spacecraft

from validation.report import table

STIFFNESS, DAMPING, COUPLING, SHAPE = (0.003, 0.006), 0.3, 0.009, 0.009   # errors, relative
DECIBELS = 3.0, 6.0
TORQUE_N_M = (0.1, 0.05, 0.0)       # of the reference, about x, y, z
CASES = {
    'null': '', 'null 2': '', 'null 3': '',
    'gain 6 %': 'sensor_gain:channel=e2_a,scale=1.06',
    'gain 1 %': 'sensor_gain:channel=e1_b,scale=1.01',
    'noise 6': 'sensor_noise:channel=e1_b,scale=6',
    'noise 1.8': 'sensor_noise:channel=e2_b,scale=1.8',
    'slosh': 'fuel_slosh:mass_kg=40,frequency_hz=2.5,damping_ratio=0.02,arm_m=1',
    'delay 0.4 ms': 'channel_delay:channel=e1_a,delay_s=0.0004',
    'clock 1500': 'clock_rate:ppm=1500',
    'drift 0.6 %': 'stiffness_drift:change=0.006', 'drift 3 %': 'stiffness_drift:change=0.03',
    'damping': 'damping_scale:scale=1.4',
    'array': 'array_asymmetry:array=E2,scale=0.99',
    'mass': 'added_mass:array=E1,mass_kg=0.2,along_m=6,lateral_m=0.5',
    'displaced': 'sensor_misplacement:channel=e1_b,along_m=-0.3,lateral_m=0.1',
    'delay 4 ms': 'channel_delay:channel=e1_a,delay_s=0.004',
    'clock 12000': 'clock_rate:ppm=12000'}


def mistaken(setup, seed):
    """Return a setup whose structure and sensors are off, by the seed, whatever is injected."""
    rng, system = np.random.default_rng(seed), setup.system
    mass, damping, stiffness, sensor = (np.array(m) for m in (
        system.mass, system.damping, system.stiffness, system.sensor))
    for dof in inject(load_spacecraft()).system.dofs:
        i = system.dofs.index(dof)
        stiff, lossy = rng.uniform(*STIFFNESS) * rng.choice([-1, 1]), np.exp(
            DAMPING * rng.standard_normal())
        coupled, shaped = (1 + s * rng.standard_normal(n) for s, n in (
            (COUPLING, 3), (SHAPE, len(sensor))))
        if '_eta' in dof:
            stiffness[i, i] *= 1 + stiff
            damping[i, i] *= lossy
            mass[i, :3] *= coupled
            mass[:3, i] = mass[i, :3]
            sensor[:, i] *= shaped
    return replace(setup, system=replace(
        system, mass=mass, damping=damping, stiffness=stiffness, sensor=sensor))


def levelled(setup, decibels):
    """Return a setup whose torque about x, about y and process noise are at levels [dB]."""
    x, y, process = 10 ** (np.array(decibels) / 20)
    torque, noise, *others = setup.system.excitation
    rms = tuple(t * k for t, k in zip(TORQUE_N_M, (x, y, 1.0)))
    return replace(setup, system=replace(setup.system, excitation=(
        replace(torque, rms=rms), replace(noise, rms=tuple(process * r for r in noise.rms)),
        *others)))


def pair(effect, seed, number, seconds):
    """Return a healthy recording and a record with an effect, and the levels of the latter."""
    rng = np.random.default_rng([seed, number])
    decibels = rng.uniform(*DECIBELS, 3) * rng.choice([-1, 1], 3)
    setups = [mistaken(inject(load_spacecraft(), e, seconds), seed)
              for e in ((), [effect] if effect else ())]
    return [simulate_setup(levelled(s, d), 1000 * (seed + 1) + 2 * number + k)
            for k, (s, d) in enumerate(zip(setups, (np.zeros(3), decibels)))], decibels


def judged(found, effect):
    """Return what an answer is worth: right, in class, silent, right place, or wrong."""
    quiet = found.outcome == 'WITHIN_FLOOR'
    if effect is None:
        return 'right' if quiet else 'false alarm'
    verdict = found.verdict
    site = max(found.where.site, key=found.where.site.get)
    if quiet:
        return 'silent'
    if effect.name in verdict['effects'] and found.outcome == 'EXPLAINED':
        return 'right'
    if effect.name in verdict['class']:
        return 'in class'
    if found.outcome == 'UNEXPLAINED':
        return 'unexplained, right site' if site == effect_class(effect.name).site.value else (
            'unexplained, other site')
    return 'wrong'


def row(name, seed, seconds):
    """Return a row of the table: a case of a seed, diagnosed."""
    effect = parse_effect(CASES[name]) if CASES[name] else None
    (one, two), decibels = pair(effect, seed, list(CASES).index(name), seconds)
    begin = time.process_time()
    found = diagnose(RecordedNominal(one), two)
    took, verdict = time.process_time() - begin, found.verdict
    site = max(found.where.site, key=found.where.site.get)
    place = [k.split('.', 1)[1] for k in found.candidates[0].parameters if k.count('.') > 1]
    return (name, seed, ' '.join(f'{d:+.1f}' for d in decibels), judged(found, effect),
            found.outcome, ' + '.join(verdict['effects']) + ' ' + ' '.join(place[:2]),
            f'{verdict["probability"]:.4f}', site, f'{found.gap["p_value"]:.2g}',
            f'{(found.gap["before"] - found.gap["floor"]) / found.gap["floor_std"]:.1f}',
            f'{took:.1f}')


def main():
    """Print a row for every case and seed, then how many are of which worth."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--seeds', nargs='*', type=int, default=[0, 1])
    parser.add_argument('--cases', nargs='*', choices=list(CASES), default=list(CASES))
    parser.add_argument('--seconds', type=float, default=600.0)
    given, worth = parser.parse_args(), {}
    head = ('case', 'seed', 'levels [dB]', 'answer', 'outcome', 'named', 'probability', 'site',
            'p', 'gap [sd]', 'CPU s')
    print('\n'.join(table(head, [])[:2]), flush=True)
    for seed in given.seeds:
        for name in given.cases:
            cells = row(name, seed, given.seconds)
            sure = cells[3] in ('wrong', 'false alarm') and float(cells[6]) > 0.9
            worth.setdefault(cells[3] + ' above 0.9' * sure, []).append(f'{name}/{seed}')
            print('| ' + ' | '.join(map(str, cells)) + ' |', flush=True)
    print()
    for word, names in worth.items():
        print(f'* {word}: {len(names)} ({", ".join(names)})')


if __name__ == '__main__':
    main()
