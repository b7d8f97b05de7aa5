"""
How much of an effect the nearest of its starting templates sees, wherever its numbers lie.

    python -m validation.gap_places [EFFECTS]

The cosine of eq. (105) between a small effect with random numbers and its best template: an effect
of d' = 8 has a score of 8 times that. Random over the ranges that a spacecraft may have.
"""
import argparse

import numpy as np
from ssi_ros.effects import effect_class, places
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.score_test import make_templates, promise
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.nominal.starting_points import starting_points
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import load_spacecraft
from ssi_ros.updating.model_uncertainty import no_uncertainty

SECONDS = 600.0
RANGES = {      # of numbers but the size; True: even in the logarithm
    'fuel_slosh': {'mass_kg': (4.0, 4.0, False), 'frequency_hz': (0.2, 8.0, True),
                   'damping_ratio': (0.004, 0.06, True), 'arm_m': (0.5, 0.5, False)},
    'attitude_controller': {'bandwidth_hz': (0.02, 0.5, True),
                            'damping_ratio': (0.1, 1.2, False)},
    'added_mass': {'mass_kg': (0.02, 0.02, False), 'along_m': (0.8, 8.0, False),
                   'lateral_m': (-0.9, 0.9, False)},
    'sensor_misplacement': {'along_m': (-0.01, 0.01, False), 'lateral_m': (-0.01, 0.01, False)}}


def drawn(rng, name, spacecraft):
    """Return an effect at a random place with random numbers."""
    cls = effect_class(name)
    words = list(places(cls, spacecraft)) or [{}]
    numbers = {}
    for key, (low, high, logarithm) in RANGES[name].items():
        x = rng.uniform(*np.log([low, high])) if logarithm else rng.uniform(low, high)
        numbers[key] = float(np.exp(x)) if logarithm else float(x)
    return cls(**words[rng.integers(len(words))], **numbers)


def main(count):
    """Print one row an effect."""
    spacecraft = load_spacecraft()
    frame = make_frame(round(SECONDS * spacecraft.rate_hz), spacecraft.rate_hz,
                       DiagnosisSettings())
    simulator = Simulator(spacecraft, frame, SECONDS)
    print('| effect | starts | median | a tenth is below | least |\n' + '|---' * 5 + '|')
    for name in RANGES:
        rng = np.random.default_rng(5)
        effects = [drawn(rng, name, spacecraft) for _ in range(count)]
        starts = starting_points([effect_class(name)], spacecraft)
        templates = make_templates(simulator, effects + starts)
        known = {id(e) for e in effects}
        own = np.array([id(e) in known for e in templates.effects])
        _, cosine = promise(templates, simulator.expected(Candidate()), frame,
                            no_uncertainty(frame, len(spacecraft.sensors)))
        # the size of some has either sign
        seen = cosine[np.ix_(own, ~own)]
        best = (seen if effects[0].one_sided() else np.abs(seen)).max(axis=1)
        print(f'| {name} | {len(starts)} | {np.median(best):.2f} | {np.quantile(best, 0.1):.2f} '
              f'| {best.min():.2f} |', flush=True)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('effects', nargs='?', type=int, default=60, help='drawn of each kind')
    main(parser.parse_args().effects)
