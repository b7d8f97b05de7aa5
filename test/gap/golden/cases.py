"""
Short diagnoses whose answers are pinned, and what of an answer is pinned.

    python test/gap/golden/cases.py --write [CASE ...]

writes the answers of today as JSON beside this file; the tolerances are in test_golden.py. All
records are simulated from fixed seeds. Whoever changes an answer on purpose writes it anew and
says in the commit why it changed.
"""
import argparse
from dataclasses import dataclass, replace
import json
import math
from pathlib import Path
import sys
import time

import numpy as np
from ssi_ros.effects import inject, parse_effect, simulate_setup
# The two entry points: the only lines here that depend on how ssi_ros.gap is arranged.
from ssi_ros.gap.driver import diagnose
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / 'reference'))
from reference_records import chain, diagnose_reference, shaken, slipping       # noqa: E402, I100

SECONDS = 200.0         # of a spacecraft record: all share the templates of one length
LEAST_P = 1e-30         # p-values below are not compared
FIRST = 3               # candidates that are pinned


def exact_spacecraft():
    """Return the packaged spacecraft as a model that is declared exact."""
    return replace(load_spacecraft(), uncertainty=EXACT)


@dataclass(frozen=True)
class Case:
    """A diagnosis to repeat: `run` makes the records and returns the Diagnosis."""

    name: str
    description: str
    run: object
    arbitrary: tuple = ()   # of 'strongest', or 'candidates' but the first: round-off decides

    def answer(self):
        """Return what is pinned of this case."""
        found = summary(self.run())
        for key in self.arbitrary:
            if key == 'candidates':
                found[key] = found[key][:1]
            else:
                del found['strongest'][key]
        return found


def craft_record(*texts, seed, change=None):
    """
    Return a record of the default spacecraft.

    Parameters
    ----------
    texts : str
        Effects as on the command line.
    seed : int
        Of the excitation and the noise.
    change : callable, optional
        Takes and returns the Setup, for what no effect of the library can do.

    """
    setup = inject(load_spacecraft(), [parse_effect(t) for t in texts], SECONDS)
    return simulate_setup(change(setup) if change else setup, seed)


def stiffer_mode(dof, factor):
    """Return a change of a Setup: one clamped mode of one array has another stiffness."""
    def change(setup):
        stiffness = setup.system.stiffness.copy()
        row = setup.system.dofs.index(dof)
        stiffness[row, row] *= factor
        return replace(setup, system=replace(setup.system, stiffness=stiffness))
    return change


def against_model(name, description, *texts, seed, change=None, arbitrary=()):
    """Return a case of a spacecraft record against its model."""
    def run():
        return diagnose(exact_spacecraft(), craft_record(*texts, seed=seed, change=change))
    return Case(name, description, run, arbitrary)


def against_reference(name, description, records, arbitrary=()):
    """Return a case of two recordings; `records` makes the healthy one and the other."""
    return Case(name, description, lambda: diagnose_reference(*records()), arbitrary)


def modulated(t):
    """Return a level that is modulated by 10 % with a period of 31 s."""
    return 1 + 0.1 * np.sin(2 * np.pi * t / 31.0)


CASES = {case.name: case for case in (
    against_model('model_null', 'the record is of the model itself', seed=21),
    against_model('model_array_asymmetry', 'array E2 is 2 % softer than modelled',
                  'array_asymmetry:array=E2,scale=0.98', seed=22),
    against_model('model_sensor_gain', 'channel e2_b reads 4 % too much',
                  'sensor_gain:channel=e2_b,scale=1.04', seed=23),
    against_model('model_harmonic_disturbance', 'a torque of one frequency',
                  'harmonic_disturbance:frequency_hz=12.345,torque_n_m=0.15', seed=31),
    against_model('model_impulsive_events', 'six impulses of torque a minute',
                  'impulsive_events:rate_per_min=6,impulse_n_m_s=0.1', seed=24),
    against_model('model_pair', 'a sensor gain and a larger hub inertia at once',
                  'sensor_gain:channel=e2_b,scale=1.04', 'hub_inertia:scale=1.3', seed=25),
    against_model('model_hinge_friction', 'the root hinge of E1 rubs (nonlinear)',
                  'hinge_friction:array=E1,torque_n_m=0.05,stiffness_n_m_rad=1e5', seed=36),
    against_model('model_unknown', 'clamped mode 4 of E2 alone is 1.5 % stiffer, which no effect '
                  'of the library does', seed=27, change=stiffer_mode('E2_eta4', 1.015)),
    # Neither effect has an expected spectrum, so shares of what their fit changes are round-off
    # over round-off: they differ with the number of threads of BLAS.
    against_model('model_clipping_and_missing', 'clipped at 0.08 m/s^2 and 3 % of samples missing',
                  'saturation:limit_m_s2=0.08', 'dropped_samples:fraction=0.03', seed=28,
                  arbitrary=('band', 'mode')),
    against_reference('reference_null', 'the same structure at a level 1.4 times higher',
                      lambda: (chain(21), chain(22, level=1.4))),
    against_reference('reference_stiffness', 'the second mode has 4 % less stiffness',
                      lambda: (chain(25), chain(26, scale=(1.0, 0.96, 1.0)))),
    against_reference('reference_sensor_gain', 'spacecraft records, channel e2_a reads 5 % too '
                      'much', lambda: (craft_record(seed=29), craft_record(
                          'sensor_gain:channel=e2_a,scale=1.05', seed=30))),
    against_reference('reference_clock', 'periodic excitation, a clock that is 1 % slow',
                      lambda: (shaken(15), shaken(16, ppm=-10_000.0))),
    against_reference('reference_modulation', 'periodic excitation, amplitude-modulated by 10 %, '
                      'begun elsewhere in its period',
                      lambda: (shaken(26), shaken(27, begin=250.0, level=modulated)),
                      arbitrary=('sensor', 'candidates')),
    against_reference('reference_slipping', 'a Jenkins joint at 3 times the level',
                      lambda: (slipping(33, 0.1), slipping(34, 0.3))))}


def summary(diagnosis):
    """
    Return what is pinned of a diagnosis, as plain data.

    All knowledge of the names in `Diagnosis.to_json` is in this function. No text is pinned: of
    the detections, which are texts, only their number is.
    """
    plain = diagnosis.to_json()
    where, gap, first = plain['where'], plain['gap'], plain['candidates'][0]
    p_value = gap['p_value']
    return {
        'outcome': plain['outcome'],
        'effects': sorted(plain['verdict']['effects']),
        'class': sorted(plain['verdict']['class']),
        'probability': plain['verdict']['probability'],
        'gap': {'value': gap['before'], 'floor': gap['floor'], 'floor_std': gap['floor_std'],
                'log10_p': None if p_value is None else math.log10(max(p_value, LEAST_P))},
        'candidates': [candidate(c) for c in plain['candidates'][:FIRST]],
        'closed': {'share': first['closed'], 'low90': first['closed_low90'],
                   'high90': first['closed_high90']},
        'strongest': {
            'sensor': strongest(where['sensors'], lambda s: s['name']),
            'band': strongest(where['bands'],
                              lambda b: f'{b["low_hz"]:.2f} to {b["high_hz"]:.2f} Hz'),
            'mode': strongest(where['modes'],
                              lambda m: f'{m["name"]} at {m["frequency_hz"]:.2f} Hz')},
        'detections': len(plain['signs'])}


def candidate(plain):
    """Return effects, values and standard deviations of a candidate."""
    return {'effects': plain['effects'],
            'parameters': {k: {'value': v['value'], 'std': v['std']}
                           for k, v in sorted(plain['parameters'].items())}}


def strongest(entries, name):
    """Return name and share of the entry with the largest share; None without entries."""
    if not entries:
        return None
    entry = max(entries, key=lambda e: e['share'])
    return {'name': name(entry), 'share': entry['share']}


def path_of(name):
    """Return the file of a case."""
    return HERE / f'{name}.json'


def main():
    """Run the cases and print what they take; write their answers if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--write', action='store_true', help='write the answers as JSON')
    parser.add_argument('names', nargs='*', metavar='CASE', help='all by default')
    args = parser.parse_args()
    for name in args.names or CASES:
        if name not in CASES:
            parser.error(f'there is no case {name}; choose from {", ".join(CASES)}')
        begin = time.perf_counter()
        found = {'description': CASES[name].description, **CASES[name].answer()}
        print(f'{name}: {time.perf_counter() - begin:.1f} s, {found["outcome"]} '
              f'{" + ".join(found["effects"])} {found["probability"]:.3f}', flush=True)
        if args.write:
            path_of(name).write_text(json.dumps(found, indent=1, allow_nan=False) + '\n')


if __name__ == '__main__':
    main()
