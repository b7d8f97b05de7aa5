# Licensed under the Apache License, Version 2.0.
"""From a scenario and a seed to the samples that a recorder would have."""
from blindgen.craft import assemble, propagators, state_matrices
from blindgen.excitation import held_loads, smooth_torque
from blindgen.march import LAWS, march
from blindgen.scenario import RATE_HZ
from blindgen.sensors import measured
import numpy as np

SUBSTEPS = 20               # 2 kHz
FRICTION_SUBSTEPS = 80      # a standing hinge creeps at 2 kHz, by a tenth of its effect
SETTLE_S = 400.0            # linear settling before the record; the slowest mode takes 88 s
LEAD_S = 60.0               # then with every effect acting
TAIL_S = 2.0                # past the end, for interpolation
BLOCK_S = 1.0               # how long the matrices of a drifting scenario stand still


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
        Integration steps a sample; 20 are 2 kHz, the default but for friction.

    Returns
    -------
    values : (kept, 4) array
        Accelerations [m/s^2].
    index : (kept,) int array
        Number of each scan kept.

    Raises
    ------
    ValueError
        If the record is shorter than 1 s.
    ArithmeticError
        If the integration has run away, which is a fault of this generator.

    """
    samples = int(round(duration_s * RATE_HZ))
    substeps = substeps or (FRICTION_SUBSTEPS if 'friction' in [k for k, *_ in scenario.local]
                            else SUBSTEPS)
    if samples < RATE_HZ:
        raise ValueError(f'duration_s={duration_s} is under 1 s; ask for more')
    settle, lead = int(SETTLE_S * RATE_HZ), int(LEAD_S * RATE_HZ)
    tail = int(TAIL_S * RATE_HZ + samples * abs(scenario.ppm) * 1e-6)
    sequence = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    loads_seed, sensor_seed = (np.random.default_rng(
        np.random.SeedSequence(sequence.entropy, spawn_key=(*sequence.spawn_key, i)))
        for i in range(2))
    total = settle + lead + samples + tail
    u = held_loads(scenario, total, settle + lead, duration_s, loads_seed)
    smooth = smooth_torque(scenario, lead + samples + tail, lead, duration_s, substeps)

    x = np.zeros(2 * len(assemble(scenario).mass))
    off = np.zeros(1 + len(scenario.local), dtype=np.int64)
    early = smooth_torque(scenario, settle, settle + lead, duration_s, 1)
    march(*_blocks(scenario, 1, [0.0]), *_laws(scenario, off), x, u[:settle], early,
          1 / RATE_HZ, settle)
    moves = scenario.drift or scenario.rotation_rad
    per_block = int(BLOCK_S * RATE_HZ) if moves else lead + samples + tail
    starts = np.arange(0, lead + samples + tail, per_block)
    progress = np.clip((starts + per_block / 2 - lead) / samples, 0, 1) if moves else [0.0]
    kinds = np.array([0] + [LAWS[kind] for kind, _, _ in scenario.local], dtype=np.int64)
    y = march(*_blocks(scenario, substeps, progress), *_laws(scenario, kinds), x, u[settle:],
              smooth, 1 / (RATE_HZ * substeps), per_block)
    if not np.all(np.isfinite(y)):
        raise ArithmeticError('the integration ran away; a law of march.py needs a smaller step')
    return measured(scenario, y, lead, samples, sensor_seed)


def _blocks(scenario, substeps, progress):
    """Return the stacked propagators and outputs of `march`, and what the local forces see."""
    stacks = [[] for _ in range(7)]
    for share in progress:
        craft = assemble(scenario, share)
        a, b, ell, c, d, e = state_matrices(craft)
        exact, p0, p1 = propagators(a, 1 / (RATE_HZ * substeps))
        for stack, value in zip(stacks, (exact, (p0 + p1) @ b, p0 @ ell, p1 @ ell, c, d, e)):
            stack.append(value)
    return (*(np.ascontiguousarray(np.array(stack)) for stack in stacks),
            np.ascontiguousarray(craft.directions.T))


def _laws(scenario, kinds):
    """Return the kinds and the parameters of the local forces, force 0 being the torque."""
    values = [[0.0, 0.0]] + [(list(p['values']) + [0.0, 0.0])[:2] for _, _, p in scenario.local]
    return kinds, np.array(values)
