"""What of a record is missing, and which of its channels and times are worth most together."""
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ssi_ros.arrays import runs

FEW = 8                 # channels, up to which all of their sets are tried
WILD = 1e7              # medians of a channel that no acceleration reaches
SINGLE = 0.5            # runs of lost rows over those of independent losses
FEWEST = 5              # losses that show a rate: their number is known to half of itself
LOSES = 1 / 6           # of the longest segment, to which a row of a segment is worth half
LISTED, NAMED = 100, 4  # gaps, the longest, whose places are listed, and that a sentence has
MEMORY_S = 10.0         # a part of that length is worth half of as many rows of a longer one


@dataclass(frozen=True)
class Missing:
    """
    What of a record is missing.

    Attributes
    ----------
    share : float
        Of all samples of the channels that were expected [1].
    gaps : int
        Times without a sample of one channel or more.
    longest_s, longest_at_s : float
        The longest time without a sample of a channel, and when it begins [s].
    longest_of : tuple of str
        Channels that it is on.
    channels : dict
        Share that is missing, by the name of every channel that lacks a sample [1].
    places : tuple of (float, float, tuple of str)
        When each gap begins and ends [s], and its channels; of more than 100 the longest.

    """

    share: float = 0.0
    gaps: int = 0
    longest_s: float = 0.0
    longest_at_s: float = 0.0
    longest_of: tuple = ()
    channels: dict = None
    places: tuple = ()

    @property
    def text(self):
        """Return the same as one sentence without a full stop."""
        if not self.share:
            return 'no sample is missing'
        where = ', '.join(f'{name} {_percent(share)}' for name, share in self.channels.items())
        return (f'{_percent(self.share)} of the samples are missing ({where}) in {self.gaps} '
                f'gap{"s" * (self.gaps != 1)}, the longest of {self.longest_s:.4g} s from '
                f'{self.longest_at_s:.4g} s on {", ".join(self.longest_of)}{self._others}')

    @property
    def _others(self):
        """Return where the next longest gaps begin, in words."""
        rest = sorted((p for p in self.places if not p[0] <= self.longest_at_s < p[1]),
                      key=lambda p: p[0] - p[1])[:NAMED]
        if not rest:
            return ''
        more = self.gaps - 1 - len(rest)
        return (f', {"others" if len(rest) > 1 else "the other"} from '
                + ', '.join(f'{begin:.4g}' for begin, _, _ in sorted(rest)) + ' s'
                + f' and {more} more' * (more > 0))


def _percent(share):
    """Return a share with two digits, and all of it as 100 %."""
    return f'{100 * share:.2g} %' if share < 0.995 else '100 %'


def missing_of(samples, expected=()):
    """
    Count what of a record is missing.

    Parameters
    ----------
    samples : Samples
        The record, NaN where a sample is missing.
    expected : sequence of str
        Names of channels that it should have; one that it has not is missing all the time.

    Returns
    -------
    Missing

    """
    lost = {name: np.isnan(column) for name, column in zip(samples.channels, samples.values.T)}
    own = {name.rsplit('/', 1)[-1] for name in lost}
    lost.update({name: np.ones(len(samples.values), bool) for name in expected
                 if name not in own})
    gone = np.array(list(lost.values()))
    if not gone.any():
        return Missing(channels={})
    longest = {name: max(runs(column), key=lambda run: run[1] - run[0], default=(0, 0))
               for name, column in lost.items()}
    first, last = max(longest.values(), key=lambda run: run[1] - run[0])
    gaps = runs(gone.any(axis=0))
    listed = sorted(sorted(gaps, key=lambda gap: gap[0] - gap[1])[:LISTED])
    return Missing(
        float(gone.mean()), len(gaps), (last - first) / samples.rate_hz,
        float(first / samples.rate_hz),
        tuple(n for n, column in lost.items() if column[first:last].all()),
        {n: float(column.mean()) for n, column in lost.items() if column.any()},
        tuple((float(begin / samples.rate_hz), float(end / samples.rate_hz),
               tuple(n for n, column in lost.items() if column[begin:end].any()))
              for begin, end in listed))


def parts_between(present, longest):
    """Return first row and end of every part, (p, 2), without a gap of more than `longest`."""
    gaps = [g for g in runs(~present) if g[1] - g[0] > longest]
    edges = np.array([0, *(row for gap in gaps for row in gap), len(present)]).reshape(-1, 2)
    return edges[edges[:, 1] > edges[:, 0]]


def lost_at_random(missing, longest):
    """
    Return the share of rows that are lost one by one, 0 where they are lost in gaps.

    Parameters
    ----------
    missing : ndarray of bool, shape (n,)
        Rows that are missing; gaps of more than `longest` rows are left out, and both ends,
        which a channel that is sampled beside the others does not reach.
    longest : float
        Of a loss, in rows.

    Returns
    -------
    float

    """
    there = np.flatnonzero(~missing)
    missing = missing[there[0]:there[-1] + 1] if len(there) else missing[:0]
    missing = np.concatenate([missing[first:last] for first, last in parts_between(
        ~missing, longest)] or [missing[:0]])
    share = float(missing.mean()) if len(missing) else 0.0
    # independent losses make many runs, a gap makes one
    many = len(runs(missing)) >= max(FEWEST, SINGLE * missing.sum() * (1 - share))
    return share if many else 0.0


def segment_rows(parts, longest, least, count):
    """
    Return the rows of a segment that use parts (p, 2) best, at least `count` times, else 0.

    Long ones resolve lightly damped modes, short ones fit into more parts: a row is worth rows
    over rows + LOSES of the longest. Engineering choice: between segments of 60 and of 150 s d'
    of a spacecraft's effects rises by 7 to 19 %.
    """
    lengths = np.diff(parts, axis=1)
    tried = lengths // np.arange(1, lengths.max(initial=0) // least + 1)
    tried = np.unique(np.append(tried, longest))
    tried = tried[(tried >= least) & (tried <= longest)]
    counts = (lengths // tried).sum(axis=0)
    worth = np.where(counts >= count, counts * tried ** 2 / (tried + LOSES * longest), 0.0)
    return int(tried[np.argmax(worth)]) if worth.any() else 0


def best_channels(present, rate_hz, longest):
    """
    Return the indices of the channels that hold most together: rows times channels.

    A channel that is silent for long costs the time, or the channel. Rows count where all of a set
    are there but for gaps that can be filled, and those of a short part less.

    Parameters
    ----------
    present : ndarray of bool, shape (n, l)
        Whether there is a sample.
    rate_hz : float
        Sampling rate [Hz].
    longest : float
        Gap that can be filled [rows].

    Returns
    -------
    list of int

    """
    count = present.shape[1]
    long_gaps = np.ones_like(present)
    for i, column in enumerate(present.T):
        for first, last in parts_between(column, longest):
            long_gaps[first:last, i] = False
    if (long_gaps == long_gaps[:, :1]).all():
        return list(range(count))
    order = np.argsort(long_gaps.sum(axis=0), kind='stable').tolist()
    sets = [order[:k] for k in range(count, 0, -1)] if count > FEW else [
        s for k in range(count, 0, -1) for s in combinations(range(count), k)]

    def worth(some):
        lengths = np.diff(parts_between(~long_gaps[:, list(some)].any(axis=1), 0)) / rate_hz
        return len(some) * float(np.sum(lengths ** 2 / (lengths + MEMORY_S)))
    return sorted(max(sets, key=worth))


def unusable(name, column, rate_hz, longest):
    """
    Return why a channel cannot be used, or an empty text.

    Parameters
    ----------
    name : str
        Of the channel.
    column : ndarray, shape (n,)
        Its samples, NaN where missing.
    rate_hz : float
        Sampling rate [Hz].
    longest : float
        Gap that can be filled [rows].

    Returns
    -------
    str

    Raises
    ------
    ValueError
        If it shows what no acceleration can be.

    """
    there = column[~np.isnan(column)]
    span = int(np.diff(parts_between(~np.isnan(column), longest)).sum())
    if not len(there) or len(there) < 0.3 * span:
        return (f'channel {name} has {len(there)} of {span or len(column)} samples, and a third '
                'of them is needed')
    # of coarse steps most values may be zero
    sizes = np.abs(there[there != 0.0])
    middle, largest = (np.median(sizes), sizes.max()) if len(sizes) else (0.0, 0.0)
    if not np.isfinite(largest) or largest > WILD * middle:
        at = int(np.nanargmax(np.abs(column)))
        raise ValueError(f'channel {name} shows {column[at]:g} m/s^2 at '
                         f'{at / rate_hz:g} s, {largest / middle:.1g} times its '
                         'median; that is no acceleration: take the sample out of the bag')
    return f'channel {name} is dead: it shows {there[0] + 0.0:g} all the time' if (
        there.std() == 0.0) else ''
