"""
Search records of known effects for amplitude modulation: how often is it detected where none is.

    python -m validation.gap_swings [RECORDS]

Every record: 600 s of the package's own simulator, the effects of the model fitted from their true
sizes. A modulation is detected where p < 0.01.
"""
import argparse

import numpy as np
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.detectors.amplitude_modulation import strongest_modulation
from ssi_ros.gap.detectors.input_reconstruction import reconstruct
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.whittle import Evidence
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame, spectra
from ssi_ros.model import load_spacecraft

SECONDS, SEED = 600.0, 1700
SLOW = 'nonstationary_excitation:depth=0.025,period_s=400'
CASES = [('', ''), *((f'timestamp_jitter:rms_s={ms}e-3', '') for ms in (0.7, 1.4, 3, 6)),
         ('impulsive_events:rate_per_min=6,impulse_n_m_s=0.3', ''),
         ('quantisation:step_m_s2=0.01', ''), ('damping_scale:scale=1.6', ''),
         ('harmonic_disturbance:frequency_hz=7.3,torque_n_m=3', ''),
         ('', 'nonstationary_excitation:depth=0.02,period_s=60'), ('', SLOW),
         ('', 'nonstationary_excitation:depth=0.6,period_s=300'),
         ('timestamp_jitter:rms_s=1.4e-3', 'nonstationary_excitation:depth=0.05,period_s=60')]


def input_of(spacecraft, known, beside, seed):
    """Return the input of a record, reconstructed by a model that has the known effects."""
    settings, known = DiagnosisSettings(), Candidate(known)
    samples = simulate_setup(inject(spacecraft, known.effects + beside, SECONDS), seed)
    frame = make_frame(len(samples.values), samples.rate_hz, settings)
    simulator = Simulator(spacecraft, frame, SECONDS)
    evidence = Evidence(frame, spectra(samples, frame), frame.used)
    found = fit(simulator, evidence)
    return reconstruct(simulator, fit(simulator, evidence, known, found.levels), samples,
                       settings)


def main(records):
    """Print how often a modulation is detected in each case, and with how much gain."""
    spacecraft = load_spacecraft()
    print('| known | beside it | detected | gain, median | largest | depth, mean | rms scatter | '
          'its std |\n' + '|---' * 8 + '|', flush=True)
    for texts in CASES:
        known, beside = (tuple(parse_effect(t) for t in (text,) if t) for text in texts)
        found = [strongest_modulation(input_of(spacecraft, known, beside, SEED + i))
                 for i in range(records)]
        gains = [m.gain if m else 0.0 for m in found]
        depths = [(m.parameters['depth'], m.stds['depth']) for m in found if m]
        depth, std = np.mean(depths, axis=0) if depths else (np.nan, np.nan)
        print(f'| {texts[0]} | {texts[1]} | {len(depths)} of {records} | {np.median(gains):.1f} | '
              f'{max(gains):.1f} | {depth:.3g} | {np.std([d for d, _ in depths] or [np.nan]):.2g} '
              f'| {std:.2g} |', flush=True)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('records', nargs='?', type=int, default=20, help='of each case')
    main(parser.parse_args().records)
