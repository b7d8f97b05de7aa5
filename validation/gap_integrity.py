"""
Name faults of wiring, units and recorder beside a model and beside a reference recording.

    python -m validation.gap_integrity [RECORDS] [SECONDS]

Every fault is put into RECORDS records of SECONDS, each of another seed and a level within 3 dB;
as many have no fault. Printed: how often the fault is named with its channels, and what else was.
"""
import argparse
from collections import Counter
from dataclasses import replace
import time

import numpy as np
from ssi_ros.effects import inject, library, simulate_setup
from ssi_ros.gap.detectors import data_faults
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model import load_spacecraft

from validation.gap_reference import at_decibel

GRAVITY = 9.80665
RECORDS, SECONDS = 20, 600.0


def scaled(values, rng, factor):
    """Multiply one channel."""
    at = rng.integers(values.shape[1])
    values[:, at] *= factor
    return values, (at,)


def swapped(values, rng):
    """Swap two channels."""
    i, j = sorted(rng.choice(values.shape[1], 2, replace=False))
    values[:, [i, j]] = values[:, [j, i]]
    return values, (i, j)


def skewed(values, rng):
    """Sample the channels one after another, 0.4 to 2 ms apart."""
    step = 100.0 * rng.uniform(4e-4, 2e-3)
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(len(values))[:, None] * step
                  * np.arange(values.shape[1]))
    return np.fft.irfft(np.fft.rfft(values, axis=0) * turn, len(values), axis=0), ()


def stuck(values, rng):
    """Hold one value of one channel for 1 to 20 s."""
    at, rows = rng.integers(values.shape[1]), int(100 * rng.uniform(1, 20))
    first = rng.integers(len(values) - rows)
    values[first:first + rows, at] = values[first, at]
    return values, (at,)


def repeated(values, rng):
    """Repeat 0.5 to 10 % of the samples of one channel."""
    at, share = rng.integers(values.shape[1]), 10 ** rng.uniform(-2.3, -1)
    rows = np.flatnonzero(rng.random(len(values)) < share)
    rows = rows[rows > 0]
    values[rows, at] = values[rows - 1, at]
    return values, (at,)


FAULTS = {
    'none': lambda v, rng: (v, ()), 'swapped channels': swapped,
    'reversed polarity': lambda v, rng: scaled(v, rng, -1.0),
    'unit': lambda v, rng: scaled(v, rng, rng.choice([GRAVITY, 1 / GRAVITY])),
    'unit of all': lambda v, rng: (v / GRAVITY, ()), 'scan skew': skewed,
    'stuck channel': stuck, 'repeated samples': repeated}


def named(kind, at, channels, reason):
    """Return whether a reason names a fault with its channels."""
    words = {'none': '', 'swapped channels': 'are swapped', 'reversed polarity': 'polarity',
             'unit': 'g, ', 'unit of all': 'all channels are in g',
             'scan skew': 'after each other', 'stuck channel': 'is stuck',
             'repeated samples': 'repeats'}[kind]
    if kind == 'none':
        return reason == ''
    return words in reason and all(channels[i] in reason for i in at)


def main(records, seconds):
    """Print a table of how often every fault is named."""
    craft, settings = load_spacecraft(), DiagnosisSettings()
    print('| nominal | fault | named | otherwise |\n|---|---|---|---|', flush=True)
    took = []
    for k, (kind, fault) in enumerate(FAULTS.items()):
        hits, misses = Counter(), []
        for seed in range(records):
            rng = np.random.default_rng([k, seed])
            reference, samples = (simulate_setup(inject(at_decibel(craft, rng.uniform(-3, 3)), (),
                                                        seconds), s)
                                  for s in (7000 + 2 * seed, 7001 + 2 * seed))
            values, at = fault(samples.values.copy(), rng)
            samples = replace(samples, values=values)
            for name, nominal in (('model', ModelNominal(craft)),
                                  ('reference', RecordedNominal(reference))):
                if kind == 'unit of all' and name == 'reference':
                    continue                # of recordings alone it is another level
                comparison = nominal.compare(samples, settings, tuple(library()), lambda s: None)
                reason = comparison.mismatch
                hits[name] += named(kind, at, samples.channels, reason)
                if not named(kind, at, samples.channels, reason):
                    misses.append(f'{name} {seed}: {reason or "nothing"}')
                if name == 'model':
                    begin = time.process_time()
                    data_faults.faults_of_samples(samples)
                    data_faults.faults_beside_model(comparison.simulator, comparison.null.state,
                                                    comparison.record.spectra)
                    took.append(time.process_time() - begin)
        for name, count in hits.items():
            print(f'| {name} | {kind} | {count} of {records} | '
                  f'{"; ".join(m for m in misses if m.startswith(name))} |', flush=True)
    print(f'\n{np.median(took):.3f} s of CPU time a record, {max(took):.3f} s at most')


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('records', nargs='?', type=int, default=RECORDS)
    parser.add_argument('seconds', nargs='?', type=float, default=SECONDS)
    main(*vars(parser.parse_args()).values())
