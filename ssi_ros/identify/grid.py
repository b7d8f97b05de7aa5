"""
From stamped samples of several channels to rows on one even grid.

Accelerometers arrive as separate messages, late, twice or not at all. The grid puts each sample
on the nearest tick of one clock shared by all channels, leaves NaN where a sample is missing, and
counts what it met. Rows come out in an order that depends on the stamps alone, never on how the
messages were bunched, so that a live run and a replayed bag give the same rows to the bit.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.arrays import firsts, joined, marked_or_all, shortened, written_out
from ssi_ros.limits import LIMITS

from .pace import common_rate, fits, LONG, Pace
from .stamps import ChannelCount, Phase, Queue, rate_of, Run

RATE_SAMPLES = 256        # stamps from which the rate is estimated, where it is not given
JUMP_CONFIRMED = 5        # samples in a row that must agree before a clock jump is believed
TOGETHER_NS = 10 ** 9     # they agree within `lateness_s`, or this where that is shorter
LATEST_NS = 2 ** 62       # the year 2116; a message ends in 2038, and sums must not overflow
FEW = 32                  # stamps that are tried together behind one that did not fit


@dataclass(frozen=True)
class Rows:
    """
    Rows of one grid: `values` of shape (n, l) from row `first`, NaN where missing.

    A new `segment` number means that the clock jumped or a rate changed: nothing before it
    belongs to it.
    """

    segment: int
    first: int
    origin_ns: int
    rate_hz: float
    values: np.ndarray


class Grid:
    """
    Collect stamped samples, hand out complete rows.

    A channel whose stamps do not fit the rate is left out, and so is one that changes its rate
    where that is given; where it is estimated, the grid is made anew at the rate that most
    channels share.

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
        if not (0.0 <= lateness_s <= 1e6 and 0.0 < max_gap_s <= 1e9):
            raise ValueError(f'lateness_s={lateness_s} must be 0 to 1e6 s, and max_gap_s='
                             f'{max_gap_s} up to 1e9 s')
        self.channels = tuple(channels)
        self.given_rate_hz = rate_hz
        self.lateness_ns = int(lateness_s * 1e9)
        self.max_gap_ns = int(max_gap_s * 1e9)
        self.counts = [ChannelCount() for _ in self.channels]
        self.segment = 0
        self.jumps = []                        # (from_ns, to_ns) of every clock jump
        self.turns = []                        # (stamp_ns, channel) of every rate that changed
        self._paces = [Pace() for _ in self.channels]
        self.rate_hz = 0.0
        self._ahead = [Run() for _ in self.channels]
        self._begin()

    def off_rate(self, channel):
        """Return whether a channel comes at another rate, so that its samples are left out."""
        return self._paces[channel].off

    def offsets(self):
        """
        Return how much later than the first channel each is sampled, from its first stamps.

        Returns
        -------
        ndarray, shape (l,)
            In samples; NaN where it is not known yet.

        """
        return self._beside('settled_ns')

    def drifts(self):
        """Return by how much each offset has changed since, shape (l,) [samples]."""
        return self._beside('phase_ns') - self._beside('settled_ns')

    def _beside(self, name):
        at = [np.nan if p is None or p.settled_ns is None else getattr(p, name)
              for p in self._phases]
        known = [a for a in at if not np.isnan(a)]
        return (np.array(at) - (known[0] if known else np.nan)) * 1e-9 * self.rate_hz

    def _begin(self):
        self._before_hz, self.rate_hz = self.rate_hz, self.given_rate_hz
        # at a given rate a channel that does not fit stays one; else the rate is found anew
        self._paces = [Pace(p.off and self.rate_hz > 0.0) for p in self._paces]
        self.origin_ns = None
        self._queues = [Queue() for _ in self.channels]
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
                    bad_stamps=int(np.count_nonzero((stamps_ns < 0) | (stamps_ns > LATEST_NS))))
        keep = marked_or_all(    # a view: a day of samples is large
            np.isfinite(values) & (stamps_ns >= 0) & (stamps_ns <= LATEST_NS))
        self._accept(channel, stamps_ns[keep], values[keep])

    def _accept(self, channel, stamps_ns, values):
        """Queue what fits the running clock, set aside what does not."""
        at, size = 0, len(stamps_ns)
        while at < len(stamps_ns):
            some = slice(at, at + size)
            taken = self._accept_some(channel, stamps_ns[some], values[some])
            # behind one that does not fit few are tried: the next may not fit either
            size = 2 * size if taken == len(stamps_ns[some]) else FEW
            at += taken

    def _accept_some(self, channel, stamps_ns, values):
        """Accept the first samples, up to one that does not fit; return how many."""
        queue, ahead = self._queues[channel], self._ahead[channel]
        newest = queue.newest
        if newest is None:                # new to this segment: the channel must be near others
            newest = self._left_behind[channel]
        if newest is None:
            others = self._newest_ns()
            newest = int(stamps_ns[0])
            if others is not None and abs(newest - others) > self.max_gap_ns:
                newest = others
        running = np.maximum.accumulate(np.concatenate(([newest], stamps_ns)))[:-1]
        fits = ((stamps_ns >= running - self.lateness_ns)
                & (stamps_ns <= running + self._gap_ns()))
        first = len(fits) if fits.all() else int(np.argmin(fits))
        if self._left_behind[channel] is not None:
            # what a channel still brings from before the jump that the others have made
            self._count(channel, late=first)
            self._left_behind[channel] = None if first < len(fits) else int(stamps_ns.max())
            return first
        if first:
            self._count(channel, bad_stamps=ahead.clear())      # the strange stamps were no jump
            queue.add(stamps_ns[:first], values[:first])
        if first < len(fits):
            given_up = ahead.add(int(stamps_ns[first]), float(values[first]),
                                 max(self.lateness_ns, TOGETHER_NS))
            self._count(channel, bad_stamps=given_up)
            if self._jumped(channel):
                self._restart()
            first += 1
        return first

    def _gap_ns(self):
        """Return the longest gap that is filled with missing samples [ns]."""
        if not self.rate_hz:
            return self.max_gap_ns
        rows = LIMITS.gap_numbers / len(self.channels)
        return min(self.max_gap_ns, int(rows / self.rate_hz * 1e9))

    def _jumped(self, channel):
        ahead = self._ahead[channel]
        return len(ahead) >= JUMP_CONFIRMED and (
            ahead.span_ns > self.lateness_ns
            or all(len(a) >= JUMP_CONFIRMED for a in self._ahead))

    def _restart(self):
        """Begin a new segment with the samples that were set aside after a clock jump."""
        old, ahead = self._newest_ns(), self._ahead
        newest = [q.newest for q in self._queues]
        self._finished = self._all(flush=True)
        self.segment += 1
        self._begin()
        self._ahead = [Run() for _ in self.channels]
        self.jumps.append((old, min(run.stamps[0] for run in ahead if len(run))))
        for channel, run in enumerate(ahead):
            if len(run):
                self._queues[channel].add(np.array(run.stamps, np.int64), np.array(run.values))
            else:
                self._left_behind[channel] = newest[channel]

    _finished = ()

    def _newest_ns(self):
        return max((q.newest for q in self._queues if q.newest is not None), default=None)

    def rows(self, flush=False):
        """
        Hand out the complete rows, a list of Rows (most often none or one).

        A row is complete when every channel, or the newest sample by `lateness_s`, is past it.
        `flush` hands out the rest.
        """
        finished, self._finished = list(self._finished), ()
        if flush:
            for channel, run in enumerate(self._ahead):
                self._count(channel, bad_stamps=run.clear())
        return finished + self._all(flush)

    def _all(self, flush):
        """Collect segment after segment, as long as a rate that changes ends them."""
        turns, out = None, []
        while turns != len(self.turns):
            turns = len(self.turns)
            out += self._collect(flush)
        return out

    def _collect(self, flush):
        if self.origin_ns is None and not self._start(flush):
            return []
        dt = 1e9 / self.rate_hz
        parts = [q.take() if len(q) else None for q in self._queues]
        turn_ns, rest = self._judge(parts, dt)
        for c, part in enumerate(parts):
            if part is not None and len(part[0]):
                self._place(c, *part, dt)
                parts[c] = part = None
        out = self._emitted(flush or turn_ns is not None, dt)
        if turn_ns is not None:
            self.segment += 1
            self._begin()
            for queue, part in zip(self._queues, rest):
                if part is not None and len(part[0]):
                    queue.add(*part)
        return out

    def _judge(self, parts, dt):
        """
        Leave out the samples of channels at another rate; cut all where a channel changes its.

        Returns
        -------
        int or None
            Stamp from which on a new segment begins [ns].
        list
            The samples from then on of each channel; `parts` keeps those before.

        """
        verdicts = [None if p is None else pace.take((p[0] - self.origin_ns) / dt)
                    for p, pace in zip(parts, self._paces)]
        ends = [(int(p[0][v.lost_at - 1]) + 1, c) for c, (p, v) in enumerate(zip(parts, verdicts))
                if v is not None and v.lost_at is not None]
        turn_ns, first = min(ends, default=(None, None))
        rest = [None] * len(parts)
        for c, (part, verdict) in enumerate(zip(parts, verdicts)):
            if part is None:
                continue
            use = verdict.use
            if turn_ns is not None:
                later = part[0] >= turn_ns
                # they are judged again in the new segment, by its rate
                rest[c] = tuple(column[later] for column in part)
                part, use = tuple(column[~later] for column in part), use[~later]
            self._count(c, off_rate=int(np.count_nonzero(~use)))
            if not use.all():
                self._update_rate(c, part[0])
                part = tuple(column[use] for column in part)
            parts[c] = part
        if turn_ns is not None:
            self.turns.append((turn_ns, self.channels[first]))
        return turn_ns, rest

    def _emitted(self, flush, dt):
        newest = [-1 if i is None else i for i in self._last]
        end = max(newest) + 1
        if not flush:
            end = min(end, max(min(newest) + 1, end - int(self.lateness_ns / dt)))
        if end <= self._next:
            return []
        self._check_room(end)
        return [self._emit(end)]

    def _check_room(self, end):
        """Raise ValueError where rows are taken for samples that were never there."""
        received = sum(c.received for c in self.counts)
        numbers = end * len(self.channels)
        if (numbers > LIMITS.gap_numbers // 8 + LIMITS.sparse * received
                or numbers - self._next * len(self.channels) > LIMITS.grid_numbers):
            raise ValueError(
                f'{received} samples would be spread over {end} rows of {self.rate_hz:g} Hz: the '
                'rate does not fit the stamps, or they jump; give another rate_hz, or cut the '
                'record where the stamps jump')

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
            rates = [r for r in map(rate_of, first) if np.isfinite(r)]
            if not rates:
                self._give_up(all(ready) or flush)
                return False
            self.rate_hz = float(f'{common_rate(rates, self._before_hz):.7g}')
            for c, q in enumerate(self._queues):
                stamps = q.stamps()[:LONG]
                self._paces[c] = Pace(not fits((stamps - stamps[:1]) * 1e-9 * self.rate_hz))
        newest = self._newest_ns()
        heads = [int(q.stamps().min()) for q in self._queues if len(q)]
        waited = newest - min(heads) > self.lateness_ns
        if min(sizes) == 0 and not (waited or flush):
            return False
        # a channel that begins later than `lateness_s` must not hold up the others
        self.origin_ns = max(h for h in heads if h - min(heads) <= self.lateness_ns)
        return True

    def _give_up(self, ready):
        """Count samples that have one and the same stamp as badly stamped: they have no rate."""
        for c, queue in enumerate(self._queues):
            if ready and len(queue):
                self._count(c, bad_stamps=len(queue))
                queue.clear()

    def _place(self, c, stamps, values, dt):
        """Give each sample the index of its tick; follow the drift of the channel's phase."""
        self._update_rate(c, stamps)
        since = (stamps - self.origin_ns).astype(float)
        if self._phases[c] is None:
            k = int(np.argmax(since >= -0.5 * dt)) if (since >= -0.5 * dt).any() else 0
            # a row holds what is nearest to the instants of the channel that was placed first
            away = since[k] - next((p.phase_ns for p in self._phases if p is not None), 0.0)
            self._phases[c] = Phase(since[k] - np.rint(away / dt) * dt)
        index = self._phases[c].index(since, dt)
        good = marked_or_all(index >= 0)      # before the origin some channel was not there yet
        index, values = index[good], values[good]
        if not len(index):
            return
        before, gap_s = -1 if self._last[c] is None else self._last[c], 0.0
        backward = np.append(before > index[0], index[:-1] > index[1:])
        late = index < self._next
        again = late & (index == before)      # a row that went on had the same stamp
        if before >= 0:
            step = np.diff(np.maximum.accumulate(np.append(before, index)))
            gap_s = float(step.max()) * dt * 1e-9
        self._count(c, out_of_order=int(np.count_nonzero(backward)),
                    duplicates=int(np.count_nonzero(again)),
                    late=int(np.count_nonzero(late & ~again)), gap_s=gap_s)
        new = marked_or_all(~late)
        self._rows.setdefault(c, []).append((shortened(index[new]), values[new]))
        self._last[c] = max(before, int(index.max()))

    def _update_rate(self, c, stamps):
        """Follow the rate at which a channel's stamps come, over its last RATE_SAMPLES."""
        recent = self._recent[c] = np.append(self._recent[c], stamps)[-RATE_SAMPLES:].copy()
        if len(recent) > 1 and (step := np.median(np.diff(recent))) > 0:
            self.counts[c] = replace(self.counts[c], rate_hz=float(1e9 / step))

    def _emit(self, end):
        first, n = self._next, end - self._next
        values = np.full((n, len(self.channels)), np.nan)
        for c in range(len(self.channels)):
            if parts := self._rows.pop(c, []):
                index, value = map(joined, zip(*((written_out(i), v) for i, v in parts)))
                later = index >= end
                if later.any():
                    self._rows[c] = [(index[later], value[later])]
                    index, value = index[~later], value[~later]
                # of two samples on one tick the first counts
                at = firsts(index)
                values[index[at] - first, c] = value[at]
                self._count(c, duplicates=len(index) - len(index[at]), placed=len(index[at]))
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
