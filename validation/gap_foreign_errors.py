"""
A foreign model whose numbers err: the shear building, alone with its uncertainty and calibrated.

    python -m validation.gap_foreign_errors [NULLS [SINGLES]]       (some 45 s a record)

The building of examples/shear_building.py, 1800 s. Its twin, which is recorded, errs by one
declared deviation in every number, drawn at random: 1 % in each frequency, 0.3 in the logarithm
of each damping ratio, 3 % in shapes and participation, 0.1 % in gains; another twin each record.
`exact` is the model taken as it is, `alone` with its uncertainty declared, `calibrated` on one
healthy record of the same twin.
"""
from dataclasses import replace
import sys
import time

from examples.shear_building import shear_building
import numpy as np
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.model.errors import Calibration, declared
from ssi_ros.model.modal_errors import modal_uncertainty
from ssi_ros.quantity import p_value_text, probability_text
from ssi_ros.updating.calibrate import calibrate

SECONDS, SEED, EXACT_TOO = 1800.0, 500, 1
STDS = {'frequency': 0.01, 'damping': 0.3, 'participation': 0.03, 'shape': 0.03, 'gain': 0.001}
SINGLES = ('connection_stiffness:freedom=floor_2,to=floor_3,share=-0.08',
           'sensor_gain:channel=acc_3,scale=1.05', 'point_mass:freedom=floor_4,share=0.1',
           'channel_delay:channel=acc_1,delay_s=0.005', 'sensor_noise:channel=gnss,scale=2',
           'connection_damping:freedom=floor_1,to=ground,ratio=0.03')


def model():
    """Return the building with its uncertainty."""
    plain = shear_building()
    return replace(plain, uncertainty=modal_uncertainty(plain, **STDS))


def record(twin, seed, *texts):
    """Return a record of a twin with effects."""
    return simulate_setup(inject(twin, [parse_effect(t) for t in texts], SECONDS), seed)


def line(what, nominal, samples):
    """Diagnose, print a row, return the diagnosis."""
    begin = time.process_time()
    found = diagnose(ModelNominal(nominal), samples)
    print(f'| {what} | {found.outcome} | {" + ".join(found.verdict["effects"])} | '
          f'{probability_text(found.verdict["probability"])} | '
          f'{p_value_text(found.gap["p_value"])} | '
          f'{time.process_time() - begin:.0f} |', flush=True)
    return found


def main(nulls, singles):
    """Print the table and what it comes to."""
    print('\n| record | outcome | named | probability | p | CPU s |\n' + '|---' * 6 + '|')
    names, stds = declared(model())
    z, counts = [], {}
    for k, text in enumerate(('',) * nulls + SINGLES[:singles]):
        seed = SEED + 10 * k
        errors = stds * np.random.default_rng(seed).standard_normal(len(stds))
        twin = replace(model(), calibration=Calibration(names, errors))
        begin = time.process_time()
        healthy = calibrate(model(), [record(twin, seed + 1)])
        took = time.process_time() - begin
        z.append((healthy.fit.values - errors) / np.sqrt(np.diag(healthy.fit.covariance)))
        samples = record(twin, seed + 2, *filter(None, [text]))
        sides = {'alone': model(), 'calibrated': healthy.spacecraft}
        if k < EXACT_TOO:
            sides['exact'] = shear_building()
        for side, nominal in sides.items():
            found = line(f'{text or "nothing"}, seed {seed}, {side}', nominal, samples)
            good = (text.split(':')[0] in (*found.verdict['effects'], *found.verdict['class'])
                    if text else found.outcome == 'WITHIN_FLOOR')
            key = side, 'named or in the class' if text else 'within the floor'
            before = counts.get(key, (0, 0))
            counts[key] = before[0] + good, before[1] + 1
        print(f'<!-- calibrated in {took:.0f} s, explains: {healthy.explains} -->', flush=True)
    for (side, what), (good, of) in counts.items():
        print(f'\n{side}: {good} of {of} {what}')
    print(f'\nerrors of the fit over their deviations, rms: {np.sqrt(np.mean(np.square(z))):.2f}')


if __name__ == '__main__':
    main(*(int(a) for a in sys.argv[1:3]) if len(sys.argv) > 2 else (10, len(SINGLES)))
