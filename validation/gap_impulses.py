"""
Ask whether impulses are as many and as high as a detection says, beside an exact model.

    python -m validation.gap_impulses 1 40 --lowest 12 --highest 40

prints deviations and relative errors of both for records of 600 s, then how often 90 % intervals
hold the truth. Sizes are drawn by d' of one impulse.
"""
import argparse
from dataclasses import replace

import numpy as np
from ssi_ros.effects import effect_class, inject, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.detectors.impulses import detect_impulses, impulse_deflection
from ssi_ros.gap.detectors.input_reconstruction import reconstruct, sensitivity
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.nominal.model_answer import Z90
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT

SECONDS = 600.0
RATES = 1.5, 30.0       # impulses a minute


def main():
    """Print one line of every record, and what all of them say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('seed', type=int)
    parser.add_argument('count', type=int, help='of records')
    parser.add_argument('--lowest', type=float, default=5.0, help="d' of one impulse")
    parser.add_argument('--highest', type=float, default=30.0)
    args = parser.parse_args()
    craft, settings = replace(load_spacecraft(), uncertainty=EXACT), DiagnosisSettings()
    rows = round(SECONDS * craft.rate_hz)
    simulator = Simulator(craft, make_frame(rows, craft.rate_hz, settings), SECONDS)
    ones = np.ones(len(simulator.expected(Candidate()).names))
    of = sensitivity(simulator, simulator.setup(Candidate()), ones, rows, settings)
    rng, cls, deviations = np.random.default_rng(args.seed), effect_class('impulsive_events'), []
    for _ in range(args.count):
        rate, height = np.exp(rng.uniform(*np.log([RATES, (args.lowest, args.highest)]).T))
        unit = impulse_deflection(cls(impulse_n_m_s=1.0), of)
        true = cls(rate_per_min=float(rate), impulse_n_m_s=float(height / unit))
        samples = simulate_setup(inject(craft, [true], SECONDS), int(rng.integers(1_000_000)))
        null = fit(simulator, simulator.evidence(samples))
        found = detect_impulses(cls(), reconstruct(simulator, null, samples, settings))
        if found is None:
            print(f"{rate:.1f} a minute of d' {height:.1f}: not seen")
            continue
        names = 'rate_per_min', 'impulse_n_m_s'
        off = np.array([found.parameters[n] - getattr(true, n) for n in names])
        deviations.append(off / [found.stds[n] for n in names])
        share = off / [getattr(true, n) for n in names]
        print(f"{rate:.1f} a minute of d' {height:.1f}: rate {share[0]:+.0%}, "
              f'{deviations[-1][0]:+.1f} deviations; height {share[1]:+.1%}, '
              f'{deviations[-1][1]:+.1f} deviations', flush=True)
    hits = np.sum(np.abs(deviations) < Z90, axis=0)
    print(f'90 % intervals: rate {hits[0]} of {len(deviations)}, height {hits[1]}')


if __name__ == '__main__':
    main()
