"""
Diagnose models of other people: a shear building, a footbridge, a robot arm of MuJoCo.

    python -m validation.gap_foreign [building bridge arm]          (all three; some 30 minutes)

Building and bridge: records of the simulator's own (1800 s, 1200 s), level within 3 dB of the
model's; without effect, and with each effect that applies, at a random place, at d' = 12 of
`identifiability`. The arm: records of 300 s by MuJoCo's own integrator (RK4) under random torques,
with one thing changed; the nominal is MuJoCo's linearisation, as a state space (mjd_transitionFD)
where it says so and as matrices else. MuJoCo is not a dependency: `pip install mujoco`.
"""
import argparse
from importlib import import_module
import time

import numpy as np
from ssi_ros.effects import applicable, effect_class, inject, simulate_setup
from ssi_ros.effects.sizes import at_size
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.score_test import make_templates, promise
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.planning.identifiability import DETECTED, identifiability
from ssi_ros.updating.model_uncertainty import model_uncertainty

DETECTION, NULLS, SEED = 12.0, 10, 90_000
SECONDS = {'building': 1800.0, 'bridge': 1200.0}
MODELS = {'building': ('examples.shear_building', 'shear_building'),
          'bridge': ('examples.footbridge', 'footbridge')}
# what is changed in MuJoCo, and the effects that are right; in a state space joints have no names
ARM = (
    ({'elbow_stiffness': 0.96}, ('connection_stiffness',), 'matrices'),
    ({'flex_stiffness': 1.03}, ('connection_stiffness',), 'matrices'),
    ({'shoulder_stiffness': 0.95}, ('connection_stiffness',), 'matrices'),
    ({'flex_damping': 1.3}, ('connection_damping',), 'matrices'),
    ({'elbow_damping': 1.3}, ('connection_damping',), 'matrices'),
    ({'payload_mass': 1.1}, ('point_mass',), 'matrices'),
    ({'gains': (1.0, 1.0, 1.0, 1.02)}, ('sensor_gain',), 'matrices'),
    ({'gains': (1.0, 1.02, 1.0, 1.0)}, ('sensor_gain',), 'state_space'),
    ({'gains': (1.0, 1.0, 1.0, 0.98)}, ('sensor_gain',), 'state_space'))
SIZES = {       # of what has no promised d'; a step and a limit are those of all channels
    'quantisation': lambda rms, rng: {'step_m_s2': 0.1 * rms.min()},
    'saturation': lambda rms, rng: {'limit_m_s2': 2.5 * rms.max()},
    'dropped_samples': lambda rms, rng: {'fraction': rng.uniform(0.005, 0.05)}}


def judged(found, right, null):
    """Return what is to be said of an answer: right, in class, or wrong."""
    if null:
        return 'yes' if found.outcome == 'WITHIN_FLOOR' else 'false alarm'
    named = found.verdict['effects']
    if found.outcome in ('EXPLAINED', 'TIED') and set(named) <= set(right) and named:
        return 'yes'
    return 'in its class' if set(right) & set(found.verdict['class']) else 'no'


def line(what, found, right, took):
    """Print a row of the table; return whether the answer is right or in its class."""
    answer = judged(found, right, not right)
    print(f'| {what} | {found.outcome} | {" + ".join(found.verdict["effects"])} | {answer} | '
          f'{took:.0f} |', flush=True)
    return answer in ('yes', 'in its class')


def sized(model, promised, name, rng, seconds):
    """Return an effect at a random place at d' = DETECTION, None if it is not promised."""
    own = [v for v in promised if v.effect.name == name]
    chosen = own[rng.integers(len(own))]
    if name in SIZES:
        rms = simulate_setup(inject(model, [], 60.0), 1).values.std(axis=0)
        return effect_class(name)(**SIZES[name](rms, rng))
    if chosen.seen is None:
        return None
    effect = at_size(chosen.seen, DETECTION / DETECTED)
    if not effect.spectral:
        return effect
    cut = model.cut(DiagnosisSettings())
    frame = make_frame(round(seconds * model.rate_hz), model.rate_hz, cut)
    side = Simulator(model, frame, seconds)
    nominal = side.expected(Candidate())
    uncertainty = model_uncertainty(side, Candidate(), np.ones(len(nominal.names)), cut)
    for _ in range(6):          # what is promised of a small size is not that of a large one
        there = make_templates(side, [effect])
        ratio = DETECTION / max(float(promise(there, nominal, frame, uncertainty)[0][0]), 1e-9)
        if abs(np.log(ratio)) < 0.05:
            break
        effect = at_size(effect, ratio)
    return effect


def own_records(name):
    """Print the table of a model whose records are simulated here; return its counts."""
    module, function = MODELS[name]
    model = getattr(import_module(module), function)()
    promised, seconds = identifiability(model, SECONDS[name]), SECONDS[name]
    cases = [None] * NULLS + list(applicable(model))
    counts = {True: [], False: []}
    for k, case in enumerate(cases):
        rng = np.random.default_rng(SEED + k)
        effect = case and sized(model, promised, case, rng, seconds)
        if case and effect is None:
            continue
        groups = len({d.level_name for d in model.drives if d.level > 0.0})
        level = 10 ** (rng.uniform(-3, 3) / 10)
        real = model.at_levels([level] * groups + [1.0])
        try:
            samples = simulate_setup(inject(real, [effect] if effect else [], seconds), SEED + k)
        except ValueError as error:
            print(f'| {effect.text()} | {error} | | | |', flush=True)
            continue
        begin = time.process_time()
        found = diagnose(model, samples)
        took = time.process_time() - begin
        counts[effect is None].append(line(
            f'{name}: {effect.text() if effect else "nothing"}', found,
            (effect.name,) if effect else (), took))
    return counts


def arm_records():
    """Print the table of the arm; return its counts."""
    try:
        robot = import_module('examples.robot_arm')
    except ModuleNotFoundError:
        print('| arm: MuJoCo is not there; `pip install mujoco` | | | | |')
        return {True: [], False: []}
    counts = {True: [], False: []}
    cases = [({}, (), 'matrices')] * (NULLS // 2) + [({}, (), 'state_space')] * (NULLS // 2)
    for k, (changes, right, form) in enumerate([*cases, *ARM]):
        samples, _ = robot.record(300.0, SEED + k, **changes)
        begin = time.process_time()
        found = diagnose(getattr(robot, form)(), samples)
        took = time.process_time() - begin
        text = ', '.join(f'{k} {v}' for k, v in changes.items()) or 'nothing'
        counts[not right].append(line(f'arm, {form}: {text}', found, right, took))
    return counts


def main(names):
    """Print the tables and the sums."""
    print('| record | outcome | named | right | CPU s |\n' + '|---' * 5 + '|', flush=True)
    for name in names:
        counts = arm_records() if name == 'arm' else own_records(name)
        quiet, single = counts[True], counts[False]
        print(f'\n{name}: {sum(quiet)} of {len(quiet)} without effect within the floor, '
              f'{sum(single)} of {len(single)} singles named or in their class\n', flush=True)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    every = ('building', 'bridge', 'arm')
    parser.add_argument('models', nargs='*', metavar='MODEL',
                        help='building, bridge or arm (default: all three)')
    given = parser.parse_args().models or every
    if set(given) - set(every):
        parser.error(f'{" ".join(given)}: known are {", ".join(every)}')
    main(given)
