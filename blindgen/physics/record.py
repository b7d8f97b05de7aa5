# Licensed under the Apache License, Version 2.0.
"""From a scenario and a seed to the samples that a recorder would have."""
from blindgen.physics.assemble import assemble
from blindgen.physics.excitation import held_loads, smooth_torque
from blindgen.physics.march import LAWS, march
from blindgen.physics.propagate import frequencies, propagators, state_matrices
from blindgen.physics.scenario import Scenario
from blindgen.physics.sensors import measured
import numpy as np

SUBSTEPS = 20               # a sample: 2 kHz of 100 Hz, where something is not linear and held
RUN_AWAY = 1e30             # m/s^2: its powers overflow next
FRICTION_SUBSTEPS = 80      # a standing hinge creeps at 2 kHz, by a tenth of its effect
DECAYS = 5.0                # of the slowest mode, settled before the record without local forces
LEAD = 0.15                 # then this share of it with every effect acting
TAIL = 200                  # samples past the end, for interpolation
BLOCKS = 300                # of a record whose matrices drift or are modulated: constant in each
SLOW_BLOCKS = 48            # of one that is only warmed


def simulate(scenario, duration_s, seed, substeps=None):
    """
    Return one record of a scenario.

    Parameters
    ----------
    scenario : Scenario
        What the record is made of.
    duration_s : float
        Length of the record [s].
    seed : int or numpy.random.SeedSequence
        Loads and sensors have their own streams, so that two scenarios with one seed share both.
    substeps : int
        Integration steps a sample; the default is one where all is linear and held.

    Returns
    -------
    values : (kept, c) array
        Accelerations [m/s^2].
    index : (kept,) int array
        Number of each scan kept.

    Raises
    ------
    ValueError
        If the record has under 100 samples.
    ArithmeticError
        If the integration has run away, which is a fault of this generator.

    """
    rate = scenario.craft.rate_hz
    samples = int(round(duration_s * rate))
    if samples < 100:
        raise ValueError(f'duration_s={duration_s} is under 100 samples; ask for more')
    substeps = substeps or _substeps(scenario)
    settle = _settling(scenario.craft)
    lead = int(LEAD * settle) + TAIL
    tail = int(TAIL + samples * abs(scenario.ppm) * 1e-6)
    loads_seed, sensor_seed = _streams(seed)
    total = settle + lead + samples + tail
    u = held_loads(scenario, total, settle + lead, duration_s, loads_seed)
    smooth = smooth_torque(scenario, lead + samples + tail, lead, duration_s, substeps)
    early = smooth_torque(scenario, settle, settle + lead, duration_s, 1)

    x = np.zeros(2 * len(assemble(scenario).mass))
    off = np.zeros(1 + len(scenario.local), dtype=np.int64)
    march(blocks(scenario, 1, [0.0]), laws(scenario, off), x, u[:settle], early, settle)
    moving = bool(scenario.drift or scenario.modulated)
    count = BLOCKS if moving else SLOW_BLOCKS if scenario.warming else 1
    per_block = -(-(lead + samples + tail) // count)
    starts = np.arange(0, lead + samples + tail, per_block)
    progress = np.clip((starts + per_block / 2 - lead) / samples, 0, 1) if count > 1 else [0.5]
    kinds = np.array([0] + [LAWS[kind] for kind, _, _ in scenario.local], dtype=np.int64)
    y = march(blocks(scenario, substeps, progress), laws(scenario, kinds), x, u[settle:],
              smooth, per_block)
    if not np.abs(y).max() < RUN_AWAY:
        raise ArithmeticError('the integration ran away; a law of march.py needs a smaller step')
    return measured(scenario, y, lead, samples, sensor_seed)


def _substeps(scenario):
    if 'friction' in [kind for kind, *_ in scenario.local]:
        return FRICTION_SUBSTEPS
    return SUBSTEPS if scenario.local or scenario.sines or scenario.sweeps else 1


def _settling(craft):
    """Return how many samples the slowest mode takes to settle, whatever the effect."""
    hz, damping = frequencies(assemble(Scenario(craft=craft)))
    return int(DECAYS / np.min(2 * np.pi * hz * damping) * craft.rate_hz) + 1


def _streams(seed):
    """Return the random generators of the loads and of the sensors."""
    sequence = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    return [np.random.default_rng(np.random.SeedSequence(
        sequence.entropy, spawn_key=(*sequence.spawn_key, i))) for i in range(2)]


def blocks(scenario, substeps, progress):
    """Return the stacked propagators and outputs of `march`, and what the local forces see."""
    stacks = [[] for _ in range(7)]
    for share in progress:
        craft = assemble(scenario, share)
        a, b, ell, c, d, e = state_matrices(craft)
        exact, p0, p1 = propagators(a, 1 / (scenario.craft.rate_hz * substeps))
        for stack, value in zip(stacks, (exact, (p0 + p1) @ b, p0 @ ell, p1 @ ell, c, d, e)):
            stack.append(value)
    return (*(np.ascontiguousarray(np.array(stack)) for stack in stacks),
            np.ascontiguousarray(craft.directions.T))


def laws(scenario, kinds):
    """Return kinds, parameters and tables of the local forces, force 0 being the torque."""
    values = [[0.0, 0.0]] + [(list(p['values']) + [0.0, 0.0])[:2] for _, _, p in scenario.local]
    tables = [p.get('tables', np.zeros((2, 2))) for _, _, p in scenario.local]
    points = max((np.shape(t)[1] for t in tables), default=2)
    padded = np.zeros((1 + len(tables), 2, points))
    for k, table in enumerate(tables, 1):
        if np.shape(table)[1] == points:
            padded[k] = table
    return kinds, np.array(values), padded
