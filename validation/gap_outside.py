"""
Diagnose records with an effect that is not in the library: how many are called unexplained.

    python -m validation.gap_outside [SEEDS]

Sizes are in units of d', what an oracle that knows the effect would see, levels and model errors
projected out; of gains that vary it is the amplitude of half a cosine over the record. Every
record: 600 s, level within 3 dB of the model's.
"""
import argparse
from dataclasses import replace
import time

import numpy as np
from ssi_ros.effects import inject, simulate_setup
from ssi_ros.effects.edits import add_part
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.score_test import promise, Templates
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.expected_periodogram import expected, power_of
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import load_spacecraft
from ssi_ros.model.excitation import Coloured, White
from ssi_ros.updating.merged_bins import white_changes
from ssi_ros.updating.model_uncertainty import model_uncertainty

from validation.gap_reference import at_decibel

SECONDS = 600.0
SIZES = (8.0, 16.0)


def rows_of(setup, array, modes=range(1, 11)):
    """Return the rows of modes of an array."""
    return [setup.system.dofs.index(f'{array}_eta{m}') for m in modes]


def changed(setup, name, change):
    """Return a setup with a matrix of the system changed in place."""
    matrix = getattr(setup.system, name).copy()
    change(matrix)
    return replace(setup, system=replace(setup.system, **{name: matrix}))


def one_mode(name, array, mode):
    """Return the change of stiffness or damping of one mode of one array."""
    def make(setup, size):
        row = rows_of(setup, array, [mode])[0]

        def change(matrix):
            matrix[row, row] *= 1 + size
        return changed(setup, name, change)
    return make


def cable(array, seed):
    """Return a spring from some point of an array to the hub: stiffness of rank one."""
    def make(setup, size):
        rows = rows_of(setup, array)
        shape = np.random.default_rng(seed).uniform(-1, 1, len(rows))

        def change(matrix):
            matrix[np.ix_(rows, rows)] += size * np.outer(shape, shape)
        return changed(setup, 'stiffness', change)
    return make


def looser(array):
    """Return modes of an array that couple less with the hub."""
    def make(setup, size):
        rows = rows_of(setup, array)
        hub = [i for i, d in enumerate(setup.system.dofs) if '_eta' not in d]

        def change(matrix):
            matrix[np.ix_(rows, hub)] *= 1 - size
            matrix[np.ix_(hub, rows)] *= 1 - size
        return changed(setup, 'mass', change)
    return make


def torque(axis, corner_hz=None):
    """Return random torque about an axis, of a power that grows with the size."""
    def make(setup, size):
        part = White('unmodelled', (f'torque_{axis}',), (np.sqrt(size),))
        return add_part(setup, part if corner_hz is None else Coloured(part, corner_hz))
    return make


CASES = {
    'frequency of mode 2 of E1': (one_mode('stiffness', 'E1', 2), 1e-3),
    'frequency of mode 4 of E2': (one_mode('stiffness', 'E2', 4), 1e-3),
    'damping of mode 3 of E1': (one_mode('damping', 'E1', 3), 0.1),
    'damping of mode 5 of E2': (one_mode('damping', 'E2', 5), 0.1),
    'cable on E1': (cable('E1', 1), 1e-2), 'cable on E2': (cable('E2', 5), 1e-2),
    'E1 couples less with the hub': (looser('E1'), 1e-3),
    'torque about y': (torque('y'), 1e-3), 'torque about x below 0.3 Hz': (torque('x', 0.3), 1e-3)}


VARYING = {'gain of e1_a varies': slice(1), 'gain of E1 varies': slice(2)}
AMPLITUDES = (0.005, 0.01, 0.04)


def size_for(simulator, make, size, detection, settings):
    """Return the size of a change that an oracle sees with so many deviations."""
    nominal = simulator.expected(Candidate())
    ones = np.ones(len(nominal.names))
    uncertainty = model_uncertainty(simulator, Candidate(), ones, settings)
    for _ in range(4):
        there = expected(make(simulator.setup(Candidate()), size), simulator.frame)
        change = there.at(np.ones(len(there.names))) - nominal.at(ones)
        white = white_changes(change.mean(axis=0)[None], nominal.at_nominal.mean(axis=0))
        templates = Templates(('unmodelled',), white, {}, power_of(nominal.shares[:-1]))
        size *= detection / promise(templates, nominal, simulator.frame, uncertainty)[0][0]
    return size


def main(seeds):
    """Print what is said of every case."""
    def tell(name, size, detection, samples):
        begin = time.process_time()
        found = diagnose(spacecraft, samples)
        print(f'| {name} | {size:.3g} | {detection} | {found.outcome} | '
              f'{found.gap["p_value"]:.1e} | {" + ".join(found.verdict["effects"])} | '
              f'{"; ".join(found.signs)} | {time.process_time() - begin:.0f} |', flush=True)
        flagged.append(found.outcome == 'UNEXPLAINED')

    def craft(seed):
        return at_decibel(spacecraft, np.random.default_rng(seed).uniform(-3, 3))
    spacecraft, settings = load_spacecraft(), DiagnosisSettings()
    frame = make_frame(round(SECONDS * spacecraft.rate_hz), spacecraft.rate_hz, settings)
    simulator = Simulator(spacecraft, frame, SECONDS)
    print("| change | size | d' | outcome | p | named | said | CPU s |\n" + '|---' * 8 + '|',
          flush=True)
    flagged = []
    for name, (make, start) in CASES.items():
        for detection in SIZES:
            size = size_for(simulator, make, start, detection, settings)
            for seed in range(seeds):
                samples = simulate_setup(make(inject(craft(seed), (), SECONDS), size), 4000 + seed)
                tell(name, size, f'{detection:g}', samples)
    for name, channels in VARYING.items():
        for size in AMPLITUDES:
            for seed in range(seeds):
                samples = simulate_setup(inject(craft(seed), (), SECONDS), 4000 + seed)
                values = samples.values.copy()
                turn = np.pi * np.arange(len(values)) / len(values)
                values[:, channels] *= 1 + size * np.cos(turn)[:, None]
                tell(name, size, '', replace(samples, values=values))
    print(f'\n{sum(flagged)} of {len(flagged)} unexplained')


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('seeds', nargs='?', type=int, default=1, help='records of each size')
    main(parser.parse_args().seeds)
