"""
Measure the diagnosis with models that are wrong, on the package's own simulator.

    python -m validation.gap_nominal calibrated 30 --errors 0.01 --out calibrated.jsonl
    python -m validation.gap_nominal alone 30 --errors 0.003 --out alone.jsonl
    python -m validation.gap_nominal calibrated 30 --pairs --out pairs.jsonl
    python -m validation.gap_nominal summary calibrated.jsonl

The spacecraft that is recorded differs from its model by `--errors` in each frequency (standard
deviation), by exp(0.3 n) in each damping ratio, by three times as much in participation and shape,
by twice as much in the inertia of the hub, by 0.1 % in gains and 1 cm in the places of the
sensors. Levels of torque and of process noise differ by +-6 dB, each on its own, from the model
and from record to record, and the force on every mode by +-3 dB from those on the others. Every
craft has one record without effect and CASES with one, or with two of different sites, of which
each has d' between 5 and 20; sizes are in units of d' with the covariance that the nominal leaves.
"""
import argparse
from dataclasses import dataclass, replace
import json
import time

import numpy as np

from ssi_ros.effects import applicable, effect_class, inject, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.whittle import BLAS, whiten
from ssi_ros.gap.spectra.segmentation import Frame
from ssi_ros.model import load_spacecraft
from ssi_ros.model.errors import Calibration, declared, of_recording
from ssi_ros.model.uncertainty import Uncertainty
from ssi_ros.updating.calibrate import calibrate
from ssi_ros.updating.correlation import heights_of
from ssi_ros.updating.error_place import Problem, Recording
from ssi_ros.updating.fit import climbed, errors_of
from ssi_ros.updating.prior import error_directions, ErrorPrior, known_by_recordings
from ssi_ros.updating.slopes import is_plain
from validation.gap_campaign import draw, Oracle, SECONDS, summary

CLIMB = 10              # steps to the most probable errors
CASES = 5               # effects a craft
DETECTION = 8.0         # d' of every effect,
OF_PAIRS = 5.0, 20.0    # and of each of two, even in the logarithm
LEVEL_DB, FORCE_DB = 6.0, 3.0


def uncertainty(errors):
    """Return what is declared of the model: what the errors are drawn from."""
    return Uncertainty(frequency=errors, participation=3 * errors, shape=3 * errors,
                       hub_inertia=2 * errors)


def wrong(spacecraft, rng):
    """Return a spacecraft that differs from its model as declared."""
    names, stds = declared(spacecraft)
    return replace(spacecraft, calibration=Calibration(
        names, stds * rng.standard_normal(len(stds))))


def at_other_levels(spacecraft, rng):
    """Return a spacecraft whose inputs have other levels, those of all modes included."""
    torque, process = 10 ** (rng.uniform(-LEVEL_DB, LEVEL_DB, 2) / 20)
    e, known = spacecraft.excitation, spacecraft.calibration
    forces = rng.uniform(-FORCE_DB, FORCE_DB, len(known.names)) * np.log(10) / 20
    return replace(spacecraft, excitation=replace(
        e, torque_rms_n_m=tuple(float(torque * t) for t in e.torque_rms_n_m),
        process_noise_rms=float(e.process_noise_rms * process)), calibration=replace(
            known, values=np.where(of_recording(known.names), forces, known.values)))


def oracle_of(nominal, prior):
    """Return what sizes effects around a nominal known by its recordings."""
    oracle = Oracle(nominal)
    levels = np.ones(len(oracle.simulator.expected(Candidate()).names))
    oracle.free = error_directions(oracle.simulator, levels, prior).and_of(
        heights_of(oracle.simulator, Candidate(), levels, len(prior.names)))
    return oracle


@dataclass(frozen=True, eq=False)
class Expectation:
    """Evidence of a record that has the expected spectrum; see `Evidence`."""

    frame: Frame
    mean: np.ndarray        # (1, k, l, l)
    known: int = 0
    parts: tuple = (0,)     # the same for all segments

    def against(self, model):
        """Return it as a model needs it."""
        return self.mean, self.frame.segments, model

    @property
    def segments(self):
        """Return the segments that count: all."""
        return self.frame.used


class WideOracle(Oracle):
    """
    What an effect adds to a record beside a model alone, whose errors are declared and fitted.

    Errors of the model take up most of a small effect, and a linear picture of them fails for a
    large one. So d' is that of the likelihood ratio of the most probable errors with and without
    the effect, given the expected spectrum of the truth with it.
    """

    def __init__(self, truth):
        super().__init__(truth)
        self.start = np.array(truth.calibration.values)
        (self.names, self.stds), self.shrinkage = declared(truth), None

    def detection(self, effect):
        """Return d' of an effect."""
        candidate = Candidate((effect,))
        now = self.simulator.expected(candidate)
        if now is None:
            raise ValueError(f'{effect.text()}: no structure is like that')
        if not is_plain(self.simulator, np.ones(len(now.names)), candidate):
            return super().detection(effect)
        evidence = Expectation(self.frame, now.at_nominal.mean(axis=0, keepdims=True))
        recording = Recording(self.simulator, evidence)
        begin = whiten(evidence.mean, evidence).likelihood - np.sum(
            np.square(self.start / self.stds)) / 2
        if self.shrinkage is None:      # of errors that a record does not show: of any effect
            self.shrinkage = self._climbed(recording, candidate).value - begin
        without = self._climbed(recording, Candidate()).value
        return float(np.sqrt(2 * max(begin + self.shrinkage - without, 0.0)))

    def _climbed(self, recording, candidate):
        return climbed(Problem((recording,), self.stds, candidate,
                               errors_of(self.names, 1)), None, self.start, CLIMB)


def elsewhere(truth, apart, rng):
    """Return a spacecraft whose clamped frequencies are all apart by a relative deviation."""
    if not apart:
        return truth
    names, values = truth.calibration.names, truth.calibration.values
    return truth.at_errors([v + apart * rng.standard_normal() * n.startswith('frequency')
                            for n, v in zip(names, values)])


def crafts(kind, errors, first, recordings=1, apart=0.0):
    """
    Yield spacecraft that differ from the model: number, generator, truth, nominal, prior.

    So many healthy recordings calibrate the nominal, each frequency apart from one to the next.
    """
    model = replace(load_spacecraft(), uncertainty=uncertainty(errors))
    for number in range(first, 1_000_000):
        rng = np.random.default_rng([number, round(1e5 * errors)])
        truth = wrong(model, rng)
        if kind == 'calibrated':
            healthy = [simulate_setup(
                inject(at_other_levels(elsewhere(truth, apart, rng), rng), (), SECONDS),
                70_000 + 1000 * k + number) for k in range(recordings)]
            with BLAS.limit(limits=1):
                nominal = calibrate(model, healthy).spacecraft
            prior = known_by_recordings(nominal.calibration)
        else:
            nominal, names = model, truth.calibration.names
            prior = ErrorPrior(names, np.diag(declared(model)[1]), np.zeros(len(names)))
        yield number, rng, truth, nominal, prior


def drawn(rng, oracle, names, number, pairs, detection=DETECTION):
    """Return the effect whose turn it is, of a size that is given, or two drawn at random."""
    if not pairs:
        return [draw(rng, oracle, names[number % len(names)], detection)]
    while True:
        two = rng.choice(names, 2, replace=False)
        if effect_class(two[0]).site != effect_class(two[1]).site:
            return [draw(rng, oracle, name, np.exp(rng.uniform(*np.log(OF_PAIRS))))
                    for name in two]


def run(kind, count, errors, out, first, only=(), pairs=False, detection=DETECTION):
    """Write one line of JSON for every record: of each craft one without effect first."""
    names, done = list(only or applicable(load_spacecraft())), 0
    for number, rng, truth, nominal, prior in crafts(kind, errors, first):
        for case in range(CASES + 1):
            if done == count:
                return
            effects, recorded = [], at_other_levels(truth, rng)
            try:
                if case:
                    # sized at the levels of the record, around the truth where the prior is wide
                    side = recorded if kind == 'alone' else replace(
                        nominal, excitation=recorded.excitation)
                    effects = drawn(rng, WideOracle(side) if kind == 'alone'
                                    else oracle_of(side, prior), names,
                                    CASES * number + case - 1, pairs, detection)
                samples = simulate_setup(inject(recorded, effects, SECONDS),
                                         80_000 + 10 * number + case)
            except ValueError as error:
                print(f'{number}.{case}: {error}', flush=True)
                continue
            done += 1
            begin = time.process_time()
            found = diagnose(nominal, samples)
            line = {'case': f'{number}.{case}', 'detection': detection if effects else 0.0,
                    'effects': [e.name for e in effects], 'texts': [e.text() for e in effects],
                    'truth': {f'{e.name}.{f.name}': getattr(e, f.name) for e in effects
                              for f in e.numbers()},
                    'seconds': time.process_time() - begin, **found.to_json()}
            line['where'] = {'site': line['where']['site']}
            line['closed_by_truth'] = None
            out.write(json.dumps(line) + '\n')
            out.flush()
            top = ' ; '.join(f'{"+".join(c["effects"])} {c["probability"]:.2f}'
                             for c in line['candidates'][:3])
            print(f'{number}.{case} {" ".join(line["texts"]) or "none"} -> {found.outcome} '
                  f'p={found.gap["p_value"]:.1e} {line["seconds"]:.0f}s {top} '
                  f'{",".join(found.verdict["class"])}', flush=True)


def main():
    """Run one campaign, or print the scores of one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('kind', choices=['calibrated', 'alone', 'summary'])
    parser.add_argument('what', help='number of records, or a file of cases')
    parser.add_argument('--errors', type=float, default=0.01, help='of the frequencies')
    parser.add_argument('--first', type=int, default=0, help='number of the first craft')
    parser.add_argument('--only', nargs='*', default=())
    parser.add_argument('--pairs', action='store_true', help='two effects a record')
    parser.add_argument('--detection', type=float, default=DETECTION, help="d' of an effect")
    parser.add_argument('--out', default='nominal.jsonl')
    args = parser.parse_args()
    if args.kind == 'summary':
        summary(args.what)
        return
    with open(args.out, 'a') as out:
        run(args.kind, int(args.what), args.errors, out, args.first, args.only, args.pairs,
            args.detection)


if __name__ == '__main__':
    main()
