"""
Draw one effect of every kind at d' = 16 and freeze the numbers in sizes.json.

    PYTHONPATH=. python test/gap/injection/make_sizes.py

run from the root of the repository. d' is the number of standard deviations by which an oracle,
which knows the effect, would detect it. Places and numbers are those of validation/gap_campaign.py
on a shorter record. `detection` is what the oracle says of the effect; None where no expected
spectrum shows it: of lines, sweeps, impulses and modulation the campaign has a formula for d', of
steps, limits and losses it draws a size that has no d'. `large` is the effect of
validation/gap_reference.py, for a recording in place of the model: d' knows nothing of that.
"""
from dataclasses import replace
import json
from pathlib import Path

import numpy as np
from ssi_ros.effects import applicable, effect_class
from ssi_ros.model import load_spacecraft
from validation import gap_campaign
from validation.gap_reference import CASES

SECONDS = 200.0
DETECTION = 16.0
SEED = 4_000
EXACT = 0.05            # of log d': the campaign's secant steps may end at a bound of the size
DRAWS = 30
STEPS = 25              # bisections of log10 k over 4 decades
FILE = Path(__file__).resolve().parent / 'sizes.json'


def sized(oracle, name, rng):
    """Return an effect at d' = 16 and what the oracle says of it."""
    cls = effect_class(name)
    for _ in range(DRAWS):
        effect = gap_campaign.draw(rng, oracle, name, DETECTION)
        if not cls.spectral:
            return effect, None
        if cls.nonlinear and cls.hinge:
            effect = stiffened(oracle, effect)
        detection = oracle.detection(effect)
        if abs(np.log(detection / DETECTION)) < EXACT:
            return effect, round(detection, 2)
    raise RuntimeError(f'{name}: no size at d prime = {DETECTION:g} in {DRAWS} draws')


def stiffened(oracle, effect):
    """Return a nonlinear hinge at the stiffness with d' = 16; its size keeps its share of 1/k."""
    low, high = 5.0, 9.0
    start = effect.stiffness_n_m_rad
    for _ in range(STEPS):
        middle = (low + high) / 2
        ratio = 10 ** middle / start
        found = replace(effect, stiffness_n_m_rad=10 ** middle,
                        **{effect.size: getattr(effect, effect.size) / ratio})
        low, high = (middle, high) if oracle.detection(found) > DETECTION else (low, middle)
    return found


def main():
    """Write the file."""
    gap_campaign.SECONDS = SECONDS      # the campaign's own records are three times as long
    oracle = gap_campaign.Oracle(load_spacecraft())
    large = {text.partition(':')[0]: text for text in CASES}
    found = {}
    for k, name in enumerate(applicable(None)):
        effect, detection = sized(oracle, name, np.random.default_rng(SEED + k))
        found[name] = {'text': effect.text(), 'detection': detection,
                       'large': large[name], 'seed': SEED + 100 + k}
        print(name, found[name], flush=True)
    FILE.write_text(json.dumps({'seconds': SECONDS, 'effects': found}, indent=1) + '\n')


if __name__ == '__main__':
    main()
