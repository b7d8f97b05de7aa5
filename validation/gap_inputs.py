"""
What a recorded input gains: d' with and without it, false alarms, singles, MuJoCo's arm.

    python -m validation.gap_inputs [sizes nulls singles arm]       (all four; some 25 minutes)

The spacecraft of config/spacecraft.yaml with exact numbers and a torque of 2 N m rms about x_b (a
manoeuvre for identification; ambient is 0.1), which is recorded; process noise on the arrays is
not. 600 s at 100 Hz. `sizes`: d' of small effects with and without the recorded torque. `nulls`:
20 records without effect. `singles`: each effect at d' = 8 with the torque, diagnosed with and
without. `arm`: MuJoCo's arm of examples/robot_arm.py with its torques, one thing changed;
`pip install mujoco`.
"""
from dataclasses import replace
from importlib import import_module
import sys
import time

import numpy as np
from ssi_ros.cli._inputs import simulated_inputs
from ssi_ros.effects import inject, load_configuration, parse_effect, simulate_setup
from ssi_ros.effects.sizes import at_size
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.score_test import make_templates, promise
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import frame_of
from ssi_ros.inputs.beside import beside_inputs
from ssi_ros.model import assemble
from ssi_ros.model.uncertainty import EXACT
from ssi_ros.updating.model_uncertainty import model_uncertainty

SECONDS, SEED, NULLS, DETECTION, SMALL = 600.0, 100, 20, 8.0, 0.02
TORQUE_N_M = 2.0
EFFECTS = (             # the path from the torque, timing, single channels, what is not on it
    'hub_inertia:scale=1.02', 'attitude_controller:bandwidth_hz=0.02,damping_ratio=0.5',
    'fuel_slosh:mass_kg=3,frequency_hz=1,damping_ratio=0.02,arm_m=1',
    'damping_scale:scale=1.05', 'stiffness_scale:scale=1.002',
    'added_mass:array=E1,mass_kg=0.01,along_m=7.2,lateral_m=0.6',
    'hinge_compliance:array=E2,stiffness_n_m_rad=3000000',
    'sensor_bandwidth:channel=all,corner_hz=500', 'channel_delay:channel=e1_b,delay_s=0.0002',
    'timestamp_jitter:rms_s=0.0002', 'clock_rate:ppm=500', 'sensor_gain:channel=e2_a,scale=1.002',
    'sensor_noise:channel=e1_a,scale=1.1')
# what is changed in MuJoCo, and the effect that is right
ARM = (({'payload_mass': 1.002}, 'point_mass'), ({'elbow_damping': 1.005}, 'connection_damping'),
       ({'play': 1e-5}, 'connection_play'), ({'late': (0, 0, 5, 0)}, 'channel_delay'),
       ({'gains': (1.0, 1.0, 1.0, 1.002)}, 'sensor_gain'))
ARM_SECONDS, ARM_NULLS = 120.0, 5


def craft():
    """Return the spacecraft of this page."""
    spacecraft, _ = load_configuration(None)
    return replace(spacecraft, uncertainty=EXACT, excitation=replace(
        spacecraft.excitation, torque_rms_n_m=(TORQUE_N_M, 0.0, 0.0)))


def recorded(spacecraft, effects, seed):
    """Return Samples of a spacecraft with effects, and of its torque."""
    setup = inject(spacecraft, effects, SECONDS)
    samples = simulate_setup(setup, seed)
    return samples, simulated_inputs(setup, assemble(spacecraft).excitation, samples, seed)


def sides(spacecraft):
    """Return the model sides without and with the torque of a record without effect."""
    samples, inputs = recorded(spacecraft, (), SEED - 1)
    frame = frame_of(samples, DiagnosisSettings())
    side = Simulator(spacecraft, frame, SECONDS)
    return side, beside_inputs(side, samples, np.full(samples.values.shape, np.nan), inputs)[0]


def deflection(side, effect):
    """Return d' of an effect, levels projected out; in proportion to a small one where it is."""
    share = SMALL if effect.power == 1.0 else 1.0
    small = at_size(effect, share)
    settings, nominal = DiagnosisSettings(), side.expected(Candidate())
    levels = np.ones(len(nominal.names))
    unknown = model_uncertainty(side, Candidate(), levels, settings)
    templates = make_templates(side.for_templates(levels), [small])
    return float(promise(templates, nominal, side.frame, unknown)[0][0]) / share


def sizes(spacecraft):
    """Print d' of every effect with and without the recorded torque."""
    print("\n| effect | d' without | with | ratio |\n|---|---|---|---|", flush=True)
    without, beside = sides(spacecraft)
    for text in EFFECTS:
        one, two = (deflection(s, parse_effect(text)) for s in (without, beside))
        print(f'| {text} | {one:.3g} | {two:.3g} | {two / one:.2f} |', flush=True)


def line(what, nominal, samples):
    """Diagnose, print a row of a table, return the diagnosis."""
    begin = time.process_time()
    found = diagnose(nominal, samples)
    named = ' + '.join(found.verdict['effects'])
    print(f'| {what} | {found.outcome} | {named} | {found.verdict["probability"]:.2f} | '
          f'{found.gap["p_value"]:.2g} | {time.process_time() - begin:.0f} |', flush=True)
    return found


def head():
    """Print the head of such a table."""
    print('\n| record | outcome | named | probability | p | CPU s |\n' + '|---' * 6 + '|',
          flush=True)


def nulls(spacecraft):
    """Print the answers to records without effect."""
    head()
    quiet = sum(line(f'nothing, seed {seed}', ModelNominal(spacecraft, (), inputs),
                     samples).outcome == 'WITHIN_FLOOR'
                for seed in range(SEED, SEED + NULLS)
                for samples, inputs in [recorded(spacecraft, (), seed)])
    print(f'\n{quiet} of {NULLS} within the floor')


def singles(spacecraft):
    """Print the answers to single effects at d' = DETECTION with the torque."""
    _, beside = sides(spacecraft)
    head()
    counts = np.zeros(2, int)
    for k, text in enumerate(EFFECTS):
        effect = parse_effect(text)
        effect = at_size(effect, DETECTION / deflection(beside, effect))
        samples, inputs = recorded(spacecraft, (effect,), SEED + 100 + k)
        for i, given in enumerate((None, inputs)):
            found = line(f'{effect.text()}, {"with" if i else "without"}',
                         ModelNominal(spacecraft, (), given), samples)
            counts[i] += effect.name in (*found.verdict['effects'], *found.verdict['class'])
    print(f'\nnamed, or in the class that is named: {counts[1]} of {len(EFFECTS)} with the '
          f'torque, {counts[0]} without')


def arm(_):
    """Print the answers to records of MuJoCo's arm with and without its torques."""
    robot, counts = import_module('examples.robot_arm'), np.zeros(2, int)
    model = robot.matrices()
    head()
    for k, (changes, right) in enumerate((({}, ''),) * ARM_NULLS + ARM):
        samples, torques = robot.record(ARM_SECONDS, SEED + 200 + k, **changes)
        text = ', '.join(f'{n} {v}' for n, v in changes.items()) or 'nothing'
        for i, given in enumerate((None, torques)):
            found = line(f'{text}, {"with" if i else "without"}', ModelNominal(model, (), given),
                         samples)
            named = found.verdict['effects']
            counts[i] += right in named if right else not named
    print(f'\nright: {counts[1]} of {len(ARM) + ARM_NULLS} with the torques, {counts[0]} without')


if __name__ == '__main__':
    for part in sys.argv[1:] or ('sizes', 'nulls', 'singles', 'arm'):
        {'sizes': sizes, 'nulls': nulls, 'singles': singles, 'arm': arm}[part](craft())
