"""
From stamped samples of several channels to rows on one even grid.

Accelerometers arrive as separate messages, late, twice or not at all. The grid puts each sample
on the nearest tick of one clock shared by all channels, leaves NaN where a sample is missing, and
counts what it met. Rows come out in an order that depends on the stamps alone, never on how the
messages were bunched, so that a live run and a replayed bag give the same rows to the bit.
"""
from dataclasses import dataclass, replace

import numpy as np

RATE_SAMPLES = 256        # stamps from which the rate is estimated, where it is not given
PHASE_SAMPLES = 256       # after so many samples a channel's phase follows the clock's drift
JUMP_CONFIRMED = 5        # samples in a row that must agree before a clock jump is believed


@dataclass(frozen=True)
class Rows:
    """
    Rows of one grid: `values` of shape (n, l) from row `first`, NaN where missing.

    A new `segment` number means that the clock jumped: nothing before it belongs to it.
    """

    segment: int
    first: int
    origin_ns: int
    rate_hz: float
    values: np.ndarray


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
    rate_hz: float = float('nan')
    longest_gap_s: float = 0.0


class Grid:
    """
    Collect stamped samples, hand out complete rows.

    Parameters
    ----------
    channels : sequence of str
        Names of the l channels.
    rate_hz : float
        Sampling rate [Hz]; 0 estimates it from the first stamps.
    lateness_s : float
        How long a row waits for its last sample, in the time of the stamps [s].
    max_gap_s : float
        A longer silence of all channels begins a new segment [s].

    """

    def __init__(self, channels, rate_hz=0.0, lateness_s=1.0, max_gap_s=600.0):
        if not channels:
            raise ValueError('a grid needs one channel or more')
        if not (rate_hz >= 0.0 and np.isfinite(rate_hz)):
            raise ValueError(f'rate_hz={rate_hz} must be positive, or 0 to estimate it')
        self.channels = tuple(channels)
        self.given_rate_hz = rate_hz
        self.lateness_ns = int(lateness_s * 1e9)
        self.max_gap_ns = int(max_gap_s * 1e9)
        self.counts = [ChannelCount() for _ in self.channels]
        self.segment = 0
        self.jumps = []                        # (from_ns, to_ns) of every clock jump
        self._ahead = [_Queue() for _ in self.channels]
        self._begin()

    def _begin(self):
        self.rate_hz = self.given_rate_hz
        self.origin_ns = None
        self._queues = [_Queue() for _ in self.channels]
        self._phases = [None] * len(self.channels)
        self._last = [None] * len(self.channels)          # newest index a channel
        self._left_behind = [None] * len(self.channels)   # newest before a jump of the others
        self._rows = {}                                   # parts: (channel, index, value)
        self._recent = [np.empty(0, dtype=np.int64) for _ in self.channels]
        self._next = 0                                    # first row not yet handed out

    def push(self, channel, stamps_ns, values):
        """Add samples of one channel (its number): stamps int64 (n,) [ns], values (n,)."""
        stamps_ns = np.atleast_1d(np.asarray(stamps_ns, dtype=np.int64))
        values = np.atleast_1d(np.asarray(values, dtype=float))
        self._count(channel, received=len(stamps_ns),
                    not_finite=int(np.count_nonzero(~np.isfinite(values))),
                    bad_stamps=int(np.count_nonzero(stamps_ns < 0)))
        keep = np.isfinite(values) & (stamps_ns >= 0)
        self._accept(channel, stamps_ns[keep], values[keep])

    def _accept(self, channel, stamps_ns, values):
        """Queue what fits the running clock, set aside what does not."""
        if not len(stamps_ns):
            return
        ahead, queue = self._ahead[channel], self._queues[channel]
        newest = queue.newest
        if newest is None:                # new to this segment: the channel must be near others
            newest = self._left_behind[channel]
        if newest is None:
            others = self._newest_ns()
            newest = int(stamps_ns[0])
            if others is not None and abs(newest - others) > self.max_gap_ns:
                newest = others
        running = np.maximum.accumulate(np.concatenate(([newest], stamps_ns)))[:-1]
        fits = ((stamps_ns > running - self.lateness_ns)
                & (stamps_ns <= running + self.max_gap_ns))
        if self._left_behind[channel] is not None:
            self._catch_up(channel, stamps_ns, values, fits)
            return
        if fits.all():
            if len(ahead):                # the strange stamps were not a jump
                self._count(channel, bad_stamps=len(ahead))
                ahead.clear()
            queue.add(stamps_ns, values)
            return
        first = int(np.argmin(fits))      # the rest is looked at again, sample by sample
        if first:
            self._accept(channel, stamps_ns[:first], values[:first])
        ahead.add(stamps_ns[first:first + 1], values[first:first + 1])
        if self._jumped(channel):
            self._restart()
        self._accept(channel, stamps_ns[first + 1:], values[first + 1:])

    def _catch_up(self, channel, stamps_ns, values, fits):
        """Drop what a channel still brings from before the jump that the others have made."""
        end = len(fits) if fits.all() else int(np.argmin(fits))
        self._count(channel, late=end)
        self._left_behind[channel] = None if end < len(fits) else int(stamps_ns.max())
        self._accept(channel, stamps_ns[end:], values[end:])

    def _jumped(self, channel):
        stamps = self._ahead[channel].stamps()
        if len(stamps) < JUMP_CONFIRMED:
            return False
        together = np.abs(np.diff(stamps[-JUMP_CONFIRMED:])) < self.lateness_ns
        enough = [len(q) >= JUMP_CONFIRMED for q in self._ahead]
        waited = stamps[-1] - stamps[0] > self.lateness_ns
        return bool(together.all()) and (all(enough) or waited)

    def _restart(self):
        """Begin a new segment with the samples that were set aside after a clock jump."""
        old, ahead = self._newest_ns(), self._ahead
        newest = [q.newest for q in self._queues]
        self._finished = self._collect(flush=True)
        self.segment += 1
        self._begin()
        self._ahead = [_Queue() for _ in self.channels]
        self.jumps.append((old, min(int(q.stamps()[0]) for q in ahead if len(q))))
        for channel, q in enumerate(ahead):
            if len(q):
                self._queues[channel].add(*q.take())
            else:
                self._left_behind[channel] = newest[channel]

    _finished = ()

    def _newest_ns(self):
        newest = [q.newest for q in self._queues if q.newest is not None]
        return max(newest) if newest else None

    def rows(self, flush=False):
        """
        Hand out the rows that are complete, a list of Rows (most often none or one).

        A row is complete when every channel is past it, or when the newest sample is
        `lateness_s` past it. `flush` hands out what is there.
        """
        finished, self._finished = list(self._finished), ()
        return finished + self._collect(flush)

    def _collect(self, flush):
        if self.origin_ns is None and not self._start(flush):
            return []
        dt = 1e9 / self.rate_hz
        for c, queue in enumerate(self._queues):
            if len(queue):
                self._place(c, *queue.take(), dt)
        seen = [-1 if i is None else i for i in self._last]
        end = max(seen) + 1
        if not flush:
            end = min(end, max(min(seen) + 1, end - int(self.lateness_ns / dt)))
        if end <= self._next:
            return []
        block = self._emit(end)
        return [block]

    def _start(self, flush):
        """Find rate and origin once there are stamps enough; True when the grid stands."""
        sizes = [len(q) for q in self._queues]
        if not max(sizes):
            return False
        if not self.rate_hz:
            ready = [n >= RATE_SAMPLES for n in sizes]
            if not (all(ready) or flush or max(sizes) >= 3 * RATE_SAMPLES) or max(sizes) < 3:
                return False
            # only ever the first stamps, so that the estimate does not depend on the bunching
            first = [q.stamps()[:RATE_SAMPLES] for q, r in zip(self._queues, ready)
                     if r or (flush and len(q) >= 3)]
            self.rate_hz = float(f'{np.median([_rate(s) for s in first]):.7g}')
        newest = self._newest_ns()
        heads = [int(q.stamps().min()) for q in self._queues if len(q)]
        waited = newest - min(heads) > self.lateness_ns
        if min(sizes) == 0 and not (waited or flush):
            return False
        # a channel that begins later than `lateness_s` must not hold up the others
        self.origin_ns = max(h for h in heads if h - min(heads) <= self.lateness_ns)
        return True

    def _place(self, c, stamps, values, dt):
        """Give each sample the index of its tick; follow the drift of the channel's phase."""
        self._update_rate(c, stamps)
        since = (stamps - self.origin_ns).astype(float)
        if self._phases[c] is None:
            k = int(np.argmax(since >= -0.5 * dt)) if (since >= -0.5 * dt).any() else 0
            self._phases[c] = _Phase(since[k] - np.rint(since[k] / dt) * dt)
        index = self._phases[c].index(since, dt)
        good = index >= 0                     # before the origin some channel was not there yet
        index, values = index[good], values[good]
        if not len(index):
            return
        before = self._last[c] if self._last[c] is not None else -1
        step = np.diff(np.maximum.accumulate(np.concatenate(([before], index))))
        backward = np.concatenate(([before], index[:-1])) > index
        late = index < self._next
        again = late & (index == before)      # a row that went on had the same stamp
        gap_s = float(step.max()) * dt * 1e-9 if before >= 0 else 0.0
        self._count(c, out_of_order=int(np.count_nonzero(backward)),
                    duplicates=int(np.count_nonzero(again)),
                    late=int(np.count_nonzero(late & ~again)), gap_s=gap_s)
        if (~late).any():
            self._rows.setdefault(c, []).append((index[~late], values[~late]))
        self._last[c] = max(before, int(index.max()))

    def _update_rate(self, c, stamps):
        """Follow the rate at which a channel's stamps come, over its last RATE_SAMPLES."""
        recent = self._recent[c] = np.concatenate([self._recent[c], stamps])[-RATE_SAMPLES:]
        if len(recent) > 1 and (step := np.median(np.diff(recent))) > 0:
            self.counts[c] = replace(self.counts[c], rate_hz=float(1e9 / step))

    def _emit(self, end):
        first, n = self._next, end - self._next
        values = np.full((n, len(self.channels)), np.nan)
        for c in range(len(self.channels)):
            parts = self._rows.pop(c, [])
            if parts:
                index = np.concatenate([p[0] for p in parts])
                value = np.concatenate([p[1] for p in parts])
                later = index >= end
                if later.any():
                    self._rows[c] = [(index[later], value[later])]
                    index, value = index[~later], value[~later]
                # of two samples on one tick the first counts
                unique, at = np.unique(index, return_index=True)
                values[unique - first, c] = value[at]
                self._count(c, duplicates=len(index) - len(unique), placed=len(unique))
            self._count(c, missing=int(np.count_nonzero(np.isnan(values[:, c]))))
        self._next = end
        return Rows(self.segment, first, self.origin_ns, self.rate_hz, values)

    def _count(self, c, gap_s=0.0, **more):
        old = self.counts[c]
        new = {k: getattr(old, k) + v for k, v in more.items() if v}
        if gap_s > old.longest_gap_s:
            new['longest_gap_s'] = gap_s
        if new:
            self.counts[c] = replace(old, **new)


class _Phase:
    """The offset of a channel's stamps from the ticks, followed in steps of PHASE_SAMPLES."""

    def __init__(self, phase_ns):
        self.phase_ns = phase_ns
        self.residuals = []
        self.collected = 0

    def index(self, since_ns, dt):
        out = np.empty(len(since_ns), dtype=np.int64)
        at = 0
        while at < len(since_ns):
            n = min(PHASE_SAMPLES - self.collected, len(since_ns) - at)
            ticks = (since_ns[at:at + n] - self.phase_ns) / dt
            index = np.rint(ticks)
            out[at:at + n] = index
            self.residuals.append(ticks - index)
            self.collected += n
            at += n
            if self.collected == PHASE_SAMPLES:
                self.phase_ns += float(np.median(np.concatenate(self.residuals))) * dt
                self.residuals, self.collected = [], 0
        return out


class _Queue:
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
        return np.concatenate(self._stamps) if self._stamps else np.empty(0, dtype=np.int64)

    def take(self):
        stamps, values = self.stamps(), np.concatenate(self._values)
        self._stamps, self._values, self._size = [], [], 0
        return stamps, values

    def clear(self):
        self._stamps, self._values, self._size, self.newest = [], [], 0, None


def _rate(stamps_ns):
    """Estimate the rate [Hz] of stamps with losses and jitter: slope over their counted ticks."""
    stamps = np.sort(stamps_ns)
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    if not len(steps):
        raise ValueError('all stamps are equal, so no rate can be estimated; give rate_hz')
    dt = float(np.median(steps))
    since = (stamps - stamps[0]).astype(float)
    for _ in range(2):                       # the second pass counts with a better period
        ticks = np.rint(since / dt)
        dt = float(np.polyfit(ticks, since, 1)[0]) if ticks[-1] > 1 else dt
    return 1e9 / dt
