"""
Diagnose nonlinear hinges of another simulator: other laws, another integrator.

    python -m validation.gap_hinges [FIRST_SEED] [SEEDS] [LAW ...]

Every record: 600 s, level within 3 dB of the model's, which is clamped; the hinge is that of E1
or E2 by turns. d' is what an oracle that knows the spectrum sees, levels projected out.
"""
import argparse
from dataclasses import replace
from functools import lru_cache
import time

import numpy as np
from ssi_ros.effects import effect_class
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.score_test import promise, Templates
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.expected_periodogram import power_of
from ssi_ros.gap.spectra.segmentation import make_frame, periodograms, spectra
from ssi_ros.model import load_spacecraft, simulate
from ssi_ros.model.structure import assemble
from ssi_ros.records import Samples
from ssi_ros.updating.merged_bins import white_changes
from ssi_ros.updating.model_uncertainty import model_uncertainty

from validation.gap_reference import at_decibel
from validation.hinge_laws import Hinge, LAWS, simulate_hinge, WARM_UP_S
from validation.report import table

SECONDS = 600.0
SIZES = {'dahl': (0.3, 1.0), 'lugre': (0.3, 1.0), 'iwan': (0.3, 1.0), 'smooth stop': (0.3, 1.0),
         'hertz': (0.1, 0.5), 'quadratic damping': (0.01, 0.04), 'root damping': (0.03, 0.2),
         'fractional damping': (0.03, 0.2), 'softening spring': (0.3, 0.9),
         'quintic spring': (0.1, 1.0)}
HEAD = ('hinge', 'size', 'array', 'seed', "d'", 'answer', 'outcome', 'named', 'probability',
        'nearest', 'site', 'left [sd]', 'reason', 'CPU s')
HINGES = 'hinge_friction', 'hinge_freeplay', 'cubic_stiffness', 'hinge_compliance'


@lru_cache
def side():
    """Return a Simulator of the spacecraft as it is believed to be."""
    craft = load_spacecraft()
    frame = make_frame(round(SECONDS * craft.rate_hz), craft.rate_hz, DiagnosisSettings())
    return Simulator(craft, frame, SECONDS)


def deflection(clean, spacecraft, seed):
    """Return d' from the changes that both halves of a record without noise have in common."""
    simulator, settings = side(), DiagnosisSettings()
    before = round(WARM_UP_S * spacecraft.rate_hz)
    without = simulate(replace(assemble(spacecraft), chain=()), WARM_UP_S + SECONDS, seed,
                       at_rest=True)
    names, rate_hz = without.channels, without.rate_hz
    there, usual = (periodograms(spectra(Samples(v, rate_hz, names), simulator.frame))
                    for v in (clean, without.values[before:]))
    half = len(there) // 2
    changes = np.array([(there - usual)[part].mean(axis=0)
                        for part in (slice(half), slice(half, None))])
    nominal = simulator.expected(Candidate())
    uncertainty = model_uncertainty(simulator, Candidate(), np.ones(len(nominal.names)), settings)
    # the level of the record is that of the model but for some decibels: it scales the change
    level = power_of([usual.mean(axis=0)[None]]) / power_of(nominal.shares[:-1])
    white = white_changes(changes / level, nominal.at_nominal.mean(axis=0))
    templates = Templates(('a', 'b'), white, {}, power_of(nominal.shares[:-1]))
    sizes, cosine = promise(templates, nominal, simulator.frame, uncertainty)
    return float(np.sqrt(max(sizes[0] * sizes[1] * cosine[0, 1], 0.0)))


def row(hinge, seed):
    """Return the cells of a diagnosis and what it is worth."""
    level = np.random.default_rng(seed).uniform(-3, 3)
    craft = at_decibel(load_spacecraft(), level)
    samples, clean = simulate_hinge(craft, hinge, SECONDS, 6000 + seed)
    begin = time.process_time()
    found = diagnose(load_spacecraft(), samples)
    took, top, sites = time.process_time() - begin, found.candidates[0], found.where.site
    place = ' '.join(str(getattr(e, f.name)) for e in top.built for f in e.words())
    size = f'{deflection(clean, craft, 6000 + seed):.0f}'
    return (hinge.law, hinge.size, hinge.array, seed, size,
            worth(found, hinge.array), found.outcome, ' + '.join(found.verdict['class']),
            f'{found.verdict["probability"]:.2f}', ' + '.join(top.effects) + f' {place}',
            max(sites, key=sites.get) if any(sites.values()) else '',
            f'{(found.gap["before"] - found.gap["floor"]) / found.gap["floor_std"]:.0f}',
            found.reason, f'{took:.0f}')


def worth(found, array):
    """Return what an answer is worth where the hinge of an array is the cause."""
    top = found.candidates[0]
    on_it = all(getattr(e, 'array', array) == array for e in top.built)
    if found.outcome in ('WITHIN_FLOOR', 'TOO_LITTLE_DATA'):
        return 'silent'
    if found.outcome == 'UNEXPLAINED':
        place = found.where.site.get('structure', 0.0) > 0.5 and on_it
        return 'unexplained, right place' if place else 'unexplained, other place'
    if set(HINGES) & set(found.verdict['class']) and on_it:
        return 'right or tied with it'
    sites = {effect_class(n).site.value for n in top.effects}
    return 'other effect of the array' if sites == {'structure'} and on_it else 'wrong'


def main(first, seeds, laws):
    """Print a table of laws, sizes and seeds."""
    print('\n'.join(table(HEAD, [])[:2]), flush=True)
    for seed in range(first, first + seeds):
        for i, law in enumerate(laws):
            for size in SIZES[law]:
                hinge = Hinge(law, size, ('E1', 'E2')[(i + seed) % 2])
                print('| ' + ' | '.join(map(str, row(hinge, seed))) + ' |', flush=True)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('first', nargs='?', type=int, default=0, help='first seed')
    parser.add_argument('seeds', nargs='?', type=int, default=1, help='records of each size')
    parser.add_argument('laws', nargs='*', metavar='LAW', help=', '.join(LAWS[1:]))
    given = parser.parse_args()
    main(given.first, given.seeds, given.laws or LAWS[1:])
