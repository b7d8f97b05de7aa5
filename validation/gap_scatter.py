"""
Measure how scores of unmodelled changes scatter in records that have none, eq. (105b).

    python -m validation.gap_scatter [RECORDS]

Records of the package's own simulator, from seed 6000; what is injected is in the model, or
filled. Of slow modes: the raw scores' rms, the deviation that they are held against, and the rms,
least and largest of what is made of them. Of all: how often the likeliest is below p = 0.1, 0.01.
"""
import argparse

import numpy as np
from scipy.stats import norm
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.score_test import score
from ssi_ros.gap.inference.unmodelled.scores import score_constant
from ssi_ros.gap.inference.unmodelled.templates import constant_templates
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.imputation import completed, without_clipped
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import load_spacecraft
from ssi_ros.updating.model_uncertainty import model_uncertainty

SEED = 6000
# seconds, what is injected, share of the records
CASES = [(600.0, '', 1.0), (200.0, '', 1.0), (1800.0, '', 0.2),
         (600.0, 'hinge_compliance:array=E1,stiffness_n_m_rad=2e5', 0.3),
         (600.0, 'dropped_samples:fraction=0.05', 0.3),
         (600.0, 'saturation:limit_m_s2=0.06', 0.1)]
NUMBERS = ('frequency of mode 1 ', 'damping of mode 1 ', 'damping of mode 2 ')


def scores_of(spacecraft, changes, seconds, effects, seed):
    """Return the raw and the standardised scores of one record, shape (2, t)."""
    settings = DiagnosisSettings()
    samples = simulate_setup(inject(spacecraft, effects, seconds), seed)
    samples, limits = without_clipped(samples, effects)
    frame = make_frame(len(samples.values), samples.rate_hz, settings,
                       ~np.isnan(samples.values).any(axis=1))
    simulator, _, evidence, levels = completed(
        Simulator(spacecraft, frame, seconds), samples, limits, settings)
    uncertainty = model_uncertainty(simulator, Candidate(), levels, settings)
    fitted = fit(simulator, evidence, Candidate(effects), levels, uncertainty=uncertainty)
    return [f(changes, fitted, evidence, uncertainty).z for f in (score, score_constant)]


def main(records):
    """Print one line for every number of a slow mode in each case."""
    spacecraft = load_spacecraft()
    print('| record | number | rms | held against | rms | least | largest | p < 0.1 | < 0.01 |\n'
          + '|---' * 9 + '|', flush=True)
    for seconds, text, share in CASES:
        effects = tuple(parse_effect(t) for t in (text,) if t)
        rows, count = round(seconds * spacecraft.rate_hz), max(2, round(share * records))
        changes = constant_templates(Simulator(
            spacecraft, make_frame(rows, spacecraft.rate_hz, DiagnosisSettings()), seconds))
        raw, z = np.array([scores_of(spacecraft, changes, seconds, effects, SEED + i)
                           for i in range(count)]).swapaxes(0, 1)
        positive = np.array([s.positive for s in changes.effects])
        p = np.where(positive, norm.sf(z), 2 * norm.sf(np.abs(z))).min(axis=1) * len(positive)
        for number in NUMBERS:
            at = [i for i, s in enumerate(changes.effects) if number in s.text]
            against, own = changes.effects[at[0]].scatter, z[:, at]
            print(f'| {count} of {seconds:g} s {text} | {number}| '
                  f'{np.sqrt(np.mean(raw[:, at] ** 2)):.2f} | {against:.2f} | '
                  f'{np.sqrt(np.mean(own ** 2)):.2f} | {own.min():.1f} | {own.max():.1f} | '
                  f'{np.mean(p < 0.1):.3f} | {np.mean(p < 0.01):.3f} |',
                  flush=True)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('records', nargs='?', type=int, default=100, help='of the first case')
    main(parser.parse_args().records)
