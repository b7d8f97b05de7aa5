"""Can this record be compared with this model? Clear reasons where it cannot."""
import numpy as np

from ssi_ros.records import Samples

WILD = 1e7              # medians of a channel that no acceleration reaches


def match(spacecraft, samples):
    """
    Put the channels of a record in the order of a model, and check that both agree.

    Returns
    -------
    Samples

    Raises
    ------
    ValueError
        If channels or rates disagree, or a channel is dead.

    """
    names = [c.rsplit('/', 1)[-1] for c in samples.channels]
    wanted = [s.name for s in spacecraft.sensors]
    missing = [n for n in wanted if n not in names]
    if missing:
        raise ValueError(f'the record has the channels {", ".join(names)}, but the model also has '
                         f'{", ".join(missing)}; give the model of this record, or rename')
    if abs(samples.rate_hz / spacecraft.rate_hz - 1) > 0.02:
        raise ValueError(f'the record is sampled at {samples.rate_hz:g} Hz, the model at '
                         f'{spacecraft.rate_hz:g} Hz; set rate_hz in the model')
    values = samples.values[:, [names.index(n) for n in wanted]]
    for name, column in zip(wanted, values.T):
        seen = column[~np.isnan(column)]
        if len(seen) < 0.3 * len(column):
            raise ValueError(f'channel {name} has {len(seen)} of {len(column)} samples; a '
                             'diagnosis needs a third of them')
        middle, largest = np.median(np.abs(seen)), np.abs(seen).max()
        if not np.isfinite(largest) or largest > WILD * max(middle, 1e-300):
            at = int(np.nanargmax(np.abs(column)))
            raise ValueError(f'channel {name} shows {column[at]:g} m/s^2 at '
                             f'{at / spacecraft.rate_hz:g} s, {largest / middle:.1g} times its '
                             'median; that is no acceleration: take the sample out of the bag')
        if seen.std() == 0.0:
            raise ValueError(f'channel {name} is dead: it shows {seen[0]:g} all the time; take '
                             'it out of the model to diagnose the others')
    return Samples(values, spacecraft.rate_hz, tuple(wanted), samples.start_ns)


def longest_part(samples):
    """Return the longest part of a record without a gap of a second, as lines and pulses need."""
    missing = np.isnan(samples.values).any(axis=1)
    holes = [(a, b) for a, b in runs(missing) if b - a >= samples.rate_hz]
    firsts = [0] + [b for _, b in holes]
    lasts = [a for a, _ in holes] + [len(missing)]
    first, last = max(zip(firsts, lasts), key=lambda part: part[1] - part[0])
    return Samples(samples.values[first:last], samples.rate_hz, samples.channels,
                   samples.start_ns + round(first * 1e9 / samples.rate_hz)) if holes else samples


def runs(marked):
    """Return (first, one after the last) of every run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]])))
    return list(zip(edges[::2], edges[1::2]))
