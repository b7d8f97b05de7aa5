"""
How often linear motion shows a nonlinear force between two points of a model, and what is found.

    python -m validation.gap_joint_forces [RECORDS]

Records of a shear building and of a footbridge beside the model that made them, all forces steady
or all or one of them varying by half; then of the building with one storey that no effect of the
library has, integrated here.
"""
from dataclasses import replace
from itertools import product
import sys
from types import SimpleNamespace

from examples.footbridge import footbridge
from examples.shear_building import shear_building
import numpy as np
from scipy.linalg import expm
from ssi_ros.effects import inject, simulate_setup
from ssi_ros.events.joint_forces import joint_forces
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.detectors.input_reconstruction import reconstruct
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model.excitation import total_covariance, Varying
from ssi_ros.records import Samples

from validation.report import table

LENGTHS_S = 150.0, 600.0
LEVELS = {'steady': (0.0, 0.0), 'all forces vary by half': (0.5, 0.0),
          'one force varies by half': (0.0, 0.5)}
LIMITS = 0.05, 0.01, 0.001
SUBSTEPS, SETTLING_S, STOREY = 16, 60.0, ('floor_2', 'floor_3')
# the force over stiffness times rms of the drift, of drift and speed over their rms
LAWS = {
    'cubic spring, 1 %': lambda x, v: 0.01 * x ** 3,
    'softening spring, 1 %': lambda x, v: -0.01 * x ** 3,
    'one-sided contact, 10 %': lambda x, v: 0.1 * np.maximum(x, 0.0),
    'quadratic damper, 10 %': lambda x, v: 0.1 * v * np.abs(v),
    'friction, smooth, 10 %': lambda x, v: 0.1 * np.tanh(5 * v)}


def linear(model, seconds, seed, depths=(0.0, 0.0)):
    """Return the Samples of a model whose forces vary by shares, all and the first."""
    setup = inject(model, [], seconds)
    parts = [Varying(p, depths[0], seconds / 3, seed) for p in setup.system.excitation]
    parts[0] = Varying(parts[0], depths[1], seconds / 3, seed)
    return simulate_setup(replace(setup, system=replace(
        setup.system, excitation=tuple(parts))), seed)


def nonlinear(model, seconds, rng, law):
    """Return the Samples of a model with a law between two of its points."""
    system = inject(model, [], seconds).system
    covariance = total_covariance(system.excitation, system.rate_hz, system.inputs)
    rows = int((seconds + SETTLING_S) * system.rate_hz)
    state, acceleration = integrated(system, rng.multivariate_normal(
        np.zeros(len(covariance)), covariance, rows), law)
    positions, speeds = np.hsplit(state, 2)
    moved = {'acceleration': acceleration, 'velocity': speeds, 'displacement': positions}
    values = np.transpose([moved[kind] @ row for kind, row in zip(system.kinds, system.sensor)])
    values = values[-int(seconds * system.rate_hz):]
    noise = sum(s.noise_covariance(values.shape[1]) for s in system.chain)
    values += rng.multivariate_normal(np.zeros(len(noise)), noise, len(values))
    return Samples(values, system.rate_hz, system.channels)


def with_levels(model):
    """Return a model each of whose forces has a level of its own."""
    return replace(model, drives=tuple(replace(d, group='') for d in model.drives))


def integrated(system, forces, law):
    """Return states (n, 2 q) and accelerations (n, q); a law is a row and a function of both."""
    count, step = len(system.dofs), 1 / system.rate_hz / SUBSTEPS
    inverse = np.linalg.inv(system.mass)
    matrix = np.block([[np.zeros((count, count)), np.eye(count)],
                       [-inverse @ system.stiffness, -inverse @ system.damping]])
    push = np.vstack([np.zeros((count, count)), inverse])
    both = expm(step * np.block([[matrix, push], [np.zeros((count, 3 * count))]]))
    onward, pushed = both[:2 * count, :2 * count], both[:2 * count, 2 * count:]
    row, force = law or (np.zeros(count), lambda x, v: 0.0)
    state, found = np.zeros(2 * count), []
    for u in forces @ system.input.T:
        # a sample is taken when a new force begins
        acting = u - row * force(row @ state[:count], row @ state[count:])
        found.append((state, (matrix @ state + push @ acting)[count:]))
        for _ in range(SUBSTEPS):
            state = onward @ state + pushed @ acting
            acting = u - row * force(row @ state[:count], row @ state[count:])
    return map(np.array, zip(*found))


def storey(model, shape):
    """Return a law of a shape in one storey, in its stiffness and the rms of its motion."""
    system = inject(model, [], 600.0).system
    row = np.zeros(len(system.dofs))
    row[[system.dofs.index(n) for n in STOREY]] = -1.0, 1.0
    state, _ = integrated(system, np.random.default_rng(1).multivariate_normal(
        np.zeros(len(system.inputs)), total_covariance(
            system.excitation, system.rate_hz, system.inputs), 4000), None)
    drift, speed = ((part @ row).std() for part in np.hsplit(state, 2))
    force = 1 / (row @ np.linalg.solve(system.stiffness, row)) * drift
    return row, lambda x, v: force * shape(x / drift, v / speed)


def shown(model, samples):
    """Return the Detections of nonlinear forces of a record beside the model that made it."""
    settings, seconds = DiagnosisSettings(), samples.duration_s
    side = Simulator(model, make_frame(len(samples.values), model.rate_hz, settings), seconds)
    fit = SimpleNamespace(candidate=Candidate(), levels=np.ones(
        len(side.spectrum(side.setup(Candidate())).shares)))
    return joint_forces(side, fit, reconstruct(side, fit, samples, settings), samples.channels)


def main():
    """Print how often p-values of linear motion are small, and what is found of laws."""
    records = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    models = {'building': with_levels(shear_building()), 'footbridge': with_levels(footbridge())}
    rows = []
    for name, model in models.items():
        for (text, depths), seconds in product(LEVELS.items(), LENGTHS_S):
            p = np.array([min([1.0] + [d.p_value for d in shown(model, linear(
                model, seconds, seed, depths))]) for seed in range(records)])
            rows.append((name, text, f'{seconds:g}', *(f'{(p < x).mean():.3f}' for x in LIMITS),
                         f'{p.min():.1e}'))
    print(f'{records} records of linear motion each, share of p-values below a limit\n')
    print('\n'.join(table(('model', 'levels', 's', *map(str, LIMITS), 'least'), rows)))
    rows, model = [], models['building']
    for (text, shape), seconds in product(LAWS.items(), LENGTHS_S):
        rng = np.random.default_rng(int(seconds) + 1)
        found = shown(model, nonlinear(model, seconds, rng, storey(model, shape)))
        best = min(found, key=lambda d: d.p_value, default=None)
        rows.append((text, f'{seconds:g}', f'{best.p_value:.1e}' if best else '> 0.05',
                     best.text if best else ''))
    head = f'between {" and ".join(STOREY)}', 's', 'p-value', 'found'
    print('\n' + '\n'.join(table(head, rows)))


if __name__ == '__main__':
    main()
