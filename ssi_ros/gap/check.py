"""Can this record be compared with this model? Clear reasons where it cannot."""
import numpy as np

from ssi_ros.records import Samples


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
        seen = column[np.isfinite(column)]
        if len(seen) < 0.3 * len(column):
            raise ValueError(f'channel {name} has {len(seen)} of {len(column)} samples; a '
                             'diagnosis needs a third of them')
        if seen.std() == 0.0:
            raise ValueError(f'channel {name} is dead: it shows {seen[0]:g} all the time; take '
                             'it out of the model to diagnose the others')
    return Samples(values, spacecraft.rate_hz, tuple(wanted), samples.start_ns)
