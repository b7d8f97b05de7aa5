"""Can this record be compared with this model? Clear reasons where it cannot."""
import numpy as np

from ssi_ros.arrays import columns
from ssi_ros.gap.spectra.thresholds import LIMITS
from ssi_ros.integrity.missing import best_channels, missing_of, unusable
from ssi_ros.model.channels import with_channels
from ssi_ros.records import Samples

PARTIAL = 'it was left out: a partial answer'   # the end of a note on a channel


class TooLittleData(ValueError):
    """A record too short to be compared, with the length needed; `notes` as of a diagnosis."""

    def __init__(self, reason, notes=()):
        super().__init__(reason)
        self.notes = notes


def match(spacecraft, samples):
    """
    Return a model and Samples with the channels that both have, and what was left out, sentences.

    ValueError if no channel is in both, rates disagree, or a channel shows no acceleration.
    """
    wanted = [s.name for s in spacecraft.sensors]
    names = [c if c in wanted else c.rsplit('/', 1)[-1] for c in samples.channels]
    if not set(names) & set(wanted):
        raise ValueError(f'the record has the channels {", ".join(names)}, the model '
                         f'{", ".join(wanted)}: none is in both; give the model of this record, '
                         'or rename')
    if abs(samples.rate_hz / spacecraft.rate_hz - 1) > 0.02:
        raise ValueError(f'the record is sampled at {samples.rate_hz:g} Hz, the model at '
                         f'{spacecraft.rate_hz:g} Hz; set rate_hz in the model')
    out = {n: f'channel {n} of the model is not in the record' for n in wanted if n not in names}
    longest, kept = LIMITS.filled_s.value * samples.rate_hz, []
    for name in (n for n in wanted if n in names):
        reason = unusable(name, samples.values[:, names.index(name)], spacecraft.rate_hz, longest)
        kept += [] if reason else [name]
        out.update({name: reason} if reason else {})
    if not kept:
        raise TooLittleData('no channel can be compared: ' + '; '.join(out.values()))
    values = columns(samples.values, [names.index(n) for n in kept])
    best = best_channels(~np.isnan(values), spacecraft.rate_hz, longest)
    for name in set(kept) - {kept[i] for i in best}:
        lost = missing_of(Samples(values[:, [kept.index(name)]], spacecraft.rate_hz, (name,)))
        out[name] = (f'channel {name} lacks {100 * lost.share:.2g} % of its samples, up to '
                     f'{lost.longest_s:.4g} s at a time: the others hold more without it')
    chosen = tuple(kept[i] for i in best)
    at = [names.index(n) for n in chosen]
    return (with_channels(spacecraft, chosen),
            Samples(columns(values, best), spacecraft.rate_hz, chosen, samples.start_ns,
                    None if samples.as_sampled is None else columns(samples.as_sampled, at),
                    samples.late and tuple(samples.late[i] for i in at)),
            tuple(f'{out[n]}; {PARTIAL}' for n in wanted if n in out))
