"""
Measure the diagnosis on the package's own simulator, with nuisances on every record.

    python -m validation.gap_campaign null 400 --out null.jsonl
    python -m validation.gap_campaign singles 90 --out singles.jsonl
    python -m validation.gap_campaign singles 16 --only hinge_compliance --out hinges.jsonl
    python -m validation.gap_campaign pairs 20 --out pairs.jsonl
    python -m validation.gap_campaign summary singles.jsonl

The model declares that it is exact. Every record: level +-3 dB, noise +-20 %, gain of each channel
+-0.02 %, stiffness of each array +-0.01 %, all uniform. Sizes are in units
of d', the deviations by which an oracle would see them.
"""
import argparse
from dataclasses import replace
import json
import time

import numpy as np

from ssi_ros.effects import (
    applicable, effect_class, inject, parse_effect, places, simulate_setup)
from ssi_ros.effects.sizes import at_size
from ssi_ros.gap.detectors.input_reconstruction import reconstruct
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.score_test import make_templates, score
from ssi_ros.gap.inference.whittle import Evidence
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.selection.cross_validation import reduction, validated
from ssi_ros.gap.selection.evidence import Ranked
from ssi_ros.gap.selection.thresholds import SELECTION
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame, spectra
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT
from ssi_ros.updating.model_uncertainty import no_uncertainty
from validation.gap_reference import at_decibel

SECONDS = 600.0
DETECTION = (2.0, 4.0, 8.0, 16.0)
STARTS = 4              # drawn, for one from which a size is found
ROUNDS = 16             # in which a size is found
TOLERANCE = 0.08        # of the logarithm of d'
MOST_ABOVE = 1.5        # of the deviations that are asked for
SURE = 4.0              # d' from which a diagnosis is asked to be right


class Oracle:
    """What an effect of a size would add to a record, before the record exists."""

    def __init__(self, spacecraft):
        self.spacecraft, self.settings = spacecraft, DiagnosisSettings()
        rows = round(SECONDS * spacecraft.rate_hz)
        self.frame = make_frame(rows, spacecraft.rate_hz, self.settings)
        self.simulator = Simulator(spacecraft, self.frame, SECONDS)
        samples = simulate_setup(inject(spacecraft, (), SECONDS), 1)
        self.samples = samples
        self.evidence = Evidence(self.frame, spectra(samples, self.frame),
                                 tuple(range(self.frame.segments)))
        self.nominal = fit(self.simulator, self.evidence)
        self.torque = reconstruct(self.simulator, self.nominal, samples, self.settings)
        self.free = no_uncertainty(self.frame, len(spacecraft.sensors))

    def detection(self, effect):
        """Return d' of an effect; ValueError if no spectrum comes with it."""
        templates = make_templates(self.simulator, [effect])
        found = score(templates, self.nominal, self.evidence, self.free).detection
        if not len(found):
            raise ValueError(f'{effect.text()} has no spectrum beside this model')
        return float(found[0])

    def gain_at(self, frequency_hz):
        """Return what a unit torque at a frequency adds to the whitened torque."""
        bins = self.torque.first + np.arange(len(self.torque.gain))
        return np.interp(frequency_hz, bins * self.torque.rate_hz / self.torque.rows,
                         self.torque.gain)


def draw(rng, oracle, name, detection):
    """Return an effect with random place and numbers at a size of so many deviations."""
    cls = effect_class(name)
    place = list(places(cls, oracle.spacecraft))
    place = place[rng.integers(len(place))] if place else {}
    coherent = np.sum(oracle.torque.taper)
    if name == 'harmonic_disturbance':
        f = rng.uniform(0.8, 40.0)
        return cls(frequency_hz=f,
                   torque_n_m=np.sqrt(2) * detection / oracle.gain_at(f) / coherent)
    if name == 'wheel_speed_sweep':
        start, end = rng.uniform(1.0, 30.0, 2)
        mean = np.sqrt(np.mean(oracle.gain_at(np.linspace(start, end, 200)) ** 2))
        return cls(start_hz=start, end_hz=end, torque_n_m=np.sqrt(2) * detection / mean / coherent)
    if name == 'impulsive_events':
        rate = rng.uniform(1.0, 8.0)
        through = np.sqrt(2 * np.sum(oracle.torque.gain ** 2)) * oracle.torque.taper.max()
        height = max(detection, 4.0)
        return cls(rate_per_min=rate, impulse_n_m_s=height / through / oracle.torque.rate_hz)
    if name == 'nonstationary_excitation':
        return cls(period_s=np.exp(rng.uniform(np.log(20), np.log(600))),
                   depth=detection / np.sqrt(SECONDS * oracle.spacecraft.rate_hz) * 1.0)
    if name == 'quantisation':
        return cls(step_m_s2=10 ** rng.uniform(-3.7, -2.7))
    if name == 'saturation':
        # each clipped sample is evident by itself: as many as the square of the deviations
        return cls(limit_m_s2=float(np.sort(np.abs(oracle.samples.values), axis=None)[
            -round(detection ** 2)]))
    if name == 'dropped_samples':
        return cls(fraction=10 ** rng.uniform(-3, -1.3))
    for _ in range(STARTS):
        low = {k: (v[rng.integers(len(v))] if k == cls.size else _around(rng, v))
               for k, v in cls.starts.items()}
        if name in ('hinge_freeplay', 'hinge_friction', 'cubic_stiffness'):
            return hinge(rng, cls, place, detection)
        try:
            return sized(cls(**place, **low), oracle, detection)
        except ValueError as error:     # noise that falls cannot fall enough, for one
            why = error
    raise why


def sized(effect, oracle, detection):
    """
    Return an effect at the size that an oracle sees so well; ValueError if there is none.

    Errors of the model take up a small effect and not a large one, with a jump between where modes
    change places: the least size that is seen as well, and not much better, will do there.
    """
    if not _size(effect):           # such as a sensor that is displaced to the side alone
        raise ValueError(f'{effect.text()} has no size that could be another')
    small = large = None            # effects on both sides
    for _ in range(ROUNDS):
        found = oracle.detection(effect)
        ratio = detection / max(found, 1e-9)
        if abs(np.log(ratio)) < TOLERANCE:
            return effect
        if ratio > 1:
            small = effect
        else:
            large, above = effect, found
        if small and large:
            share = _size(large) / _size(small)
            effect = at_size(small, share ** (small.power / 2))
        else:
            effect = at_size(effect, ratio)
    if large and above < MOST_ABOVE * detection:
        return large
    raise ValueError(f'{effect.text()} has no size of {detection:g} deviations')


def _size(effect):
    """Return how far the size of an effect is from none."""
    f = next(f for f in effect.numbers() if f.name == effect.size)
    value = getattr(effect, f.name)
    return abs(value - f.default) if np.isfinite(f.default) else value


def _around(rng, starts):
    """Return a number from the range of starting values; around a single one by up to 3."""
    if len(starts) == 1:
        return starts[0] * 3.0 ** rng.uniform(-1.0, 1.0)
    return rng.uniform(min(starts), max(starts))


def hinge(rng, cls, place, detection):
    """Return a nonlinear hinge, sized by its give over that of the clamp."""
    stiffness = 10 ** rng.uniform(5.0, 6.0)
    give = detection / 16
    size = {'gap_rad': 3e-6, 'torque_n_m': 0.1, 'k3_n_m_rad3': 1e14}[cls.size] * give
    return cls(**place, stiffness_n_m_rad=stiffness, **{cls.size: size * 1e5 / stiffness})


def record(rng, oracle, effects, seed):
    """Simulate effects with the nuisances of the head of this file."""
    craft = at_decibel(oracle.spacecraft, rng.uniform(-3, 3), rng.uniform(0.8, 1.2))
    gain, stiff = effect_class('sensor_gain'), effect_class('array_asymmetry')
    small = [gain(channel=s.name, scale=1 + rng.uniform(-2e-4, 2e-4)) for s in craft.sensors]
    small += [stiff(array=a.name, scale=1 + rng.uniform(-1e-4, 1e-4)) for a in craft.arrays]
    return simulate_setup(inject(craft, [*small, *effects], SECONDS), seed)


def closed_by_truth(oracle, samples, effects):
    """Return the share of the gap that the effects at their true sizes close, levels fitted."""
    sides = []
    for present in ((), tuple(effects)):
        comparison = ModelNominal(oracle.spacecraft, present).compare(
            samples, oracle.settings, (), lambda share: None)
        sides.append(validated(comparison, Ranked(comparison.null)))
    return reduction(*sides)[0]


def run(kind, count, out, first, only=()):
    """Write one line of JSON for every case."""
    oracle = Oracle(replace(load_spacecraft(), uncertainty=EXACT))
    names = list(only or applicable(None))
    for case in range(first, first + count):
        rng = np.random.default_rng(1000 * {'null': 1, 'singles': 2, 'pairs': 3}[kind] + case)
        detection = DETECTION[(case // len(names)) % len(DETECTION)]
        effects = []
        if kind == 'singles':
            effects = [draw(rng, oracle, names[case % len(names)], detection)]
        elif kind == 'pairs':
            two = rng.choice(len(names), 2, replace=False)
            detection = 10.0
            effects = [draw(rng, oracle, names[i], detection) for i in two]
        try:
            samples = record(rng, oracle, effects, 50_000 + case)
        except ValueError as error:
            print(f'{case}: {error}', flush=True)
            continue
        begin = time.process_time()
        found = diagnose(oracle.spacecraft, samples, pairs=kind != 'null')
        line = {'case': case, 'detection': detection if effects else 0.0,
                'effects': [e.name for e in effects], 'texts': [e.text() for e in effects],
                'truth': {f'{e.name}.{f.name}': getattr(e, f.name) for e in effects
                          for f in e.numbers()},
                'seconds': time.process_time() - begin, **found.to_json()}
        line['where'] = {'site': line['where']['site']}
        share = closed_by_truth(oracle, samples, effects) if effects else float('nan')
        line['closed_by_truth'] = share if np.isfinite(share) else None
        out.write(json.dumps(line) + '\n')
        out.flush()
        top = ' ; '.join(f'{"+".join(c["effects"])} {c["probability"]:.2f}'
                         for c in line['candidates'][:3])
        print(f'{case} d={line["detection"]:g} {" ".join(line["texts"])} -> {found.outcome} '
              f'p={found.gap["p_value"]:.1e} {line["seconds"]:.0f}s {top}', flush=True)


def summary(path):
    """Print the scores of a file of cases."""
    with open(path) as file:
        cases = [json.loads(line) for line in file]
    quiet = [c for c in cases if not c['effects']]
    if quiet:
        print(f'false alarms {sum(c["outcome"] != "WITHIN_FLOOR" for c in quiet)} of {len(quiet)}')
    for detection in sorted({c['detection'] for c in cases if c['effects']}):
        some = [c for c in cases if c['effects'] and c['detection'] == detection]
        seen = [c for c in some if c['outcome'] != 'WITHIN_FLOOR']
        right = [c for c in some if sorted(c['verdict']['effects']) == sorted(c['effects'])]
        alike = [c for c in some if set(c['effects']) <= set(c['verdict']['class'])]
        three = [c for c in some if any(sorted(k['effects']) == sorted(c['effects'])
                                        for k in c['candidates'][:3])]
        flagged = [c for c in some if c['outcome'] == 'UNEXPLAINED']
        print(f"d'={detection:g}: {len(some)} cases, seen {len(seen)}, strict {len(right)}, "
              f'class {len(alike)}, top 3 {len(three)}, unexplained {len(flagged)}')
    first, there = (covered(cases, own) for own in (False, True))
    if first[1]:
        print('90 % intervals cover {} of {}'.format(*first)
              + ', at the true place where that is tied {} of {}'.format(*there))
    print(f'seconds: median {np.median([c["seconds"] for c in cases]):.1f}, '
          f'largest {max(c["seconds"] for c in cases):.1f}')


def covered(cases, own):
    """
    Return how many 90 % intervals of right answers hold the truth, and how many there are.

    Those of the most probable candidate; `own`: of the one at the true place (channel, array)
    where that is tied with it.
    """
    inside = total = 0
    for c in cases:
        best, *others = c['candidates']
        if sorted(best['effects']) != sorted(c['effects']):
            continue
        for k in others if own else ():
            if k['effects'] == best['effects'] and at_its_place(k, c) and not at_its_place(
                    best, c) and k['probability'] > (
                        SELECTION['tied_share'].value * best['probability']):
                best = k
        for name, v in best['parameters'].items():
            if v['low90'] is not None and name in c['truth']:
                total += 1
                inside += v['low90'] <= c['truth'][name] <= v['high90']
    return inside, total


def at_its_place(candidate, case):
    """Return whether every channel and array of a candidate is that of the effects in a case."""
    true = {f'{e.name}.{f.name}': getattr(e, f.name) for e in map(parse_effect, case['texts'])
            for f in e.words()}
    return all(v['value'] == true[k] for k, v in candidate['parameters'].items() if k in true)


def main():
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('kind', choices=('null', 'singles', 'pairs', 'summary'))
    parser.add_argument('what', help='number of cases, or a file to sum up')
    parser.add_argument('--out', default='gap_campaign.jsonl')
    parser.add_argument('--first', type=int, default=0, help='number of the first case')
    parser.add_argument('--only', nargs='*', help='effects that singles are drawn of')
    args = parser.parse_args()
    if args.kind == 'summary':
        summary(args.what)
        return
    with open(args.out, 'a') as out:
        run(args.kind, int(args.what), out, args.first, args.only)


if __name__ == '__main__':
    main()
