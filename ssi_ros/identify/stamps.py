"""The stamps of one channel: samples that wait, its phase, its rate; batches of several."""
from dataclasses import dataclass, fields, replace

import numpy as np
from ssi_ros.arrays import distinct, joined

NEAR = 0.1                # relative distance of the median step from the period, at most
COMBS = 8192              # periods that are tried in it
PHASE_SAMPLES = 256       # after so many samples a channel's phase follows the clock's drift
MOST = 1024               # blocks of them that are looked at at once


@dataclass(frozen=True)
class ChannelCount:
    """What a channel has brought so far (numbers of samples, rate in Hz)."""

    received: int = 0
    placed: int = 0
    missing: int = 0
    duplicates: int = 0
    out_of_order: int = 0
    late: int = 0
    not_finite: int = 0
    bad_stamps: int = 0
    off_rate: int = 0
    rate_hz: float = float('nan')
    longest_gap_s: float = 0.0

    def plus(self, later):
        """Return this count and that of a later grid together."""
        numbers = {name: getattr(self, name) + getattr(later, name) for name in NUMBERS}
        return ChannelCount(**numbers, rate_hz=later.rate_hz,
                            longest_gap_s=max(self.longest_gap_s, later.longest_gap_s))

    def given_up(self):
        """Return the count where what still waited for its place counts as badly stamped."""
        waited = self.received - (self.placed + self.duplicates + self.late + self.not_finite
                                  + self.bad_stamps + self.off_rate)
        return replace(self, bad_stamps=self.bad_stamps + max(0, waited))


NUMBERS = tuple(f.name for f in fields(ChannelCount) if isinstance(f.default, int))


def batches(arrivals_ns, span_ns):
    """
    Cut channels at the same moments, so that all meet a jump of the clock together.

    Parameters
    ----------
    arrivals_ns : sequence of ndarray of int64
        When the samples of each channel arrived [ns], not falling.
    span_ns : int
        Longest time that one batch holds [ns].

    Returns
    -------
    list of tuple of slice
        Of each batch that holds a sample, the slice of every channel: a gap costs nothing.

    """
    begins = [int(a[0]) for a in arrivals_ns if len(a)]
    if not begins:
        return []
    spans = [(a - min(begins)) // span_ns for a in arrivals_ns]
    numbers = distinct(np.concatenate([s[np.append(True, s[1:] != s[:-1])[:len(s)]]
                                       for s in spans]))
    ends = [np.searchsorted(s, numbers, side='right').tolist() for s in spans]
    return [tuple(slice(e[k - 1] if k else 0, e[k]) for e in ends) for k in range(len(numbers))]


def rate_of(stamps_ns):
    """
    Estimate the rate [Hz] of stamps with losses and jitter: slope over their counted ticks.

    NaN where all stamps are equal.
    """
    stamps = np.sort(stamps_ns)
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    if not len(steps):
        return float('nan')
    dt = float(np.median(steps))
    since = (stamps - stamps[0]).astype(float)
    if len(since) > 8 and np.abs(since / dt - np.rint(since / dt)).max() > 0.2:
        dt = _on_a_comb(since, dt)           # of uneven steps the median is not good enough
    # where most are lost the median is two periods or three
    dt /= next((m for m in (1, 2, 3, 4) if abs(np.exp(2j * np.pi * m * since / dt).mean()) > 0.7),
               1)
    for _ in range(2):                       # the second pass counts with a better period
        ticks = np.rint(since / dt)
        dt = float(np.polyfit(ticks, since, 1)[0]) if ticks[-1] > 1 else dt
    return 1e9 / dt


def _on_a_comb(since, dt):
    """Return the period near `dt` on whose multiples the times lie best."""
    ticks = since / dt
    number = int(np.clip(1.6 * ticks[-1], 16, COMBS))
    rates = np.linspace(1.0 - NEAR, 1.0 + NEAR, number)
    lengths = np.concatenate([np.abs(np.exp(2j * np.pi * np.outer(some, ticks)).mean(axis=1))
                              for some in np.array_split(rates, 1 + number // 256)])
    return dt / rates[int(lengths.argmax())]


class Phase:
    """The offset of a channel's stamps from the ticks, followed in steps of PHASE_SAMPLES."""

    def __init__(self, phase_ns):
        self.phase_ns = phase_ns
        self.settled_ns = None          # after the first PHASE_SAMPLES, so of the stamps alone
        self.residuals = []
        self.collected = 0

    def index(self, since_ns, dt):
        """Return the tick of each time (n,) [ns], with a period [ns]; follow the phase."""
        out = np.empty(len(since_ns), dtype=np.int64)
        at, blocks = 0, 1
        while at < len(since_ns):
            whole = min(blocks, MOST, (len(since_ns) - at) // PHASE_SAMPLES)
            if whole > 1 and not self.collected and self.settled_ns is not None:
                taken = self._steady(since_ns[at:at + whole * PHASE_SAMPLES], dt, out[at:])
                # where the phase stays many blocks are one
                at, blocks = at + taken, 2 * blocks if taken == whole * PHASE_SAMPLES else 1
                continue
            n = min(PHASE_SAMPLES - self.collected, len(since_ns) - at)
            ticks = (since_ns[at:at + n] - self.phase_ns) / dt
            index = np.rint(ticks)
            out[at:at + n] = index
            self.residuals.append(ticks - index)
            self.collected += n
            at += n
            if self.collected == PHASE_SAMPLES:
                before = self.phase_ns
                self.phase_ns += float(np.median(np.concatenate(self.residuals))) * dt
                self.residuals, self.collected = [], 0
                if self.settled_ns is None:
                    self.settled_ns = self.phase_ns
                blocks = 2 if self.phase_ns == before else 1
        return out

    def _steady(self, since_ns, dt, out):
        """Enter the ticks of whole blocks up to one that moves the phase; return how many."""
        ticks = (since_ns - self.phase_ns) / dt
        index = np.rint(ticks)
        medians = np.median((ticks - index).reshape(-1, PHASE_SAMPLES), axis=1)
        moved = self.phase_ns + medians * dt != self.phase_ns
        taken = PHASE_SAMPLES * (int(np.argmax(moved)) if moved.any() else len(moved))
        out[:taken] = index[:taken]
        return taken


class Queue:
    """Stamped samples waiting for their place."""

    def __init__(self):
        self._stamps, self._values, self._size, self.newest = [], [], 0, None

    def __len__(self):
        return self._size

    def add(self, stamps, values):
        self._stamps.append(stamps)
        self._values.append(values)
        self._size += len(stamps)
        newest = int(stamps.max())
        self.newest = newest if self.newest is None else max(self.newest, newest)

    def stamps(self):
        return joined(self._stamps) if self._stamps else np.empty(0, dtype=np.int64)

    def take(self):
        stamps, values = self.stamps(), joined(self._values)
        self._stamps, self._values, self._size = [], [], 0
        return stamps, values

    def clear(self):
        self._stamps, self._values, self._size, self.newest = [], [], 0, None


class Run:
    """Strange stamps that follow each other: the beginning of a jump, if enough of them do."""

    def __init__(self):
        self.clear()

    def __len__(self):
        return len(self.values)

    def clear(self):
        """Forget all; return how many there were."""
        count = len(getattr(self, 'values', ()))
        self.stamps, self.values = [], []
        return count

    def add(self, stamp, value, within_ns):
        """Add one sample; where it does not follow the last one, return how many are given up."""
        apart = bool(self.stamps) and abs(stamp - self.stamps[-1]) > within_ns
        given_up = self.clear() if apart else 0
        self.stamps.append(stamp)
        self.values.append(value)
        return given_up

    @property
    def span_ns(self):
        """Return the time from the first to the last [ns]."""
        return self.stamps[-1] - self.stamps[0] if self.stamps else 0


def nothing_on(grid):
    """Return the sentence for a grid that has no row."""
    received = sum(c.received for c in grid.counts)
    if not received:
        return 'the record has no samples on these channels'
    faults = {k: sum(getattr(c, k) for c in grid.counts)
              for k in ('bad_stamps', 'not_finite', 'late', 'out_of_order')}
    return (f'none of {received} samples has a place on an even grid ('
            + ', '.join(f'{n} {k}' for k, n in faults.items() if n)
            + '): stamps have to rise, all but evenly; check them, or give rate_hz')
