"""
Samples from topics to rows of one grid: subscriptions that only append, a timer that reads.

The subscription callback only appends raw bytes; a timer reads them into a `Grid` and hands the
rows that are complete on, in an order that depends on the stamps alone.
"""
from collections import Counter, deque
import threading
import time

import numpy as np
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from ssi_ros.identify.aligned import Aligned
from ssi_ros.identify.grid import Grid
from ssi_ros.identify.offsets import DRIFTS, LARGE
from ssi_ros.identify.stamps import ChannelCount
from ssi_ros.ros.arrivals import ChannelState, Lately, Silence
from ssi_ros.ros.beside import apart_words, beside_words
from ssi_ros.ros.channels import channel_sources
from ssi_ros.ros.losses import with_number
from ssi_ros.ros.mixed import Mixing

DRAIN_S = 0.2             # how often the raw bytes are read into rows
SAY_S = 5.0               # after which time missing samples are said first,
SAY_LAST_S = 640.0        # and at longest; twice the time before at each
KEPT = 100                # jumps of the clock that are kept


class Intake:
    """
    Subscribe to the channels of a node and hand on the rows of their grid.

    Parameters
    ----------
    node : StageNode
        Whose subscriptions these are.
    settings : SampleInput
        Channels and how to read them.
    rate_hz : float
        Rate of the grid [Hz], 0 estimates it.
    take : callable
        Called with each `Rows`, in the executor's thread.
    together : bool
        Whether channels that are sampled beside the first one are moved to its instants.

    Raises
    ------
    ValueError
        For a channel that cannot be read.

    """

    def __init__(self, node, settings, rate_hz, take, together=False):
        self.together = together
        self.node, self.settings, self.rate_hz, self.take = node, settings, rate_hz, take
        self.sources = channel_sources(settings)
        self.names = [s.name for s in self.sources]
        for source in self.sources:
            source.resolved = node.resolve_topic_name(source.topic)
        self.began, self.grid = time.monotonic(), None
        self._pending = {s.topic: deque() for s in self.sources}
        self._gate = threading.Event()
        self._silences = {s.topic: Silence() for s in self.sources}
        self.mixing = Mixing(node, {s.topic: s.resolved for s in self.sources})
        self.begin()
        qos = sample_qos(settings)
        self._subscriptions = [
            node.create_subscription(message_class, topic, self._collector(topic), qos, raw=True)
            for topic, message_class in {s.topic: s.message_class for s in self.sources}.items()]
        self._timer = node.every(DRAIN_S, self._drain)

    def begin(self):
        """Begin a new grid with the next sample."""
        for pending in self._pending.values():
            pending.clear()
        self._before = [ChannelCount()] * len(self.sources)     # of grids that were given up
        self._missing, self._lost = [(0, 0)] * len(self.sources), Counter()
        self._lately = Lately()
        self._restart()
        self._lately.keep(self.counts)
        self.clock_jumps, self.fault, self._quiet = 0, '', set()
        self._said = self._kept = self._looked = time.monotonic()
        self._say_s = SAY_S
        for topic in self._silences:
            self._silences[topic] = Silence()
        self.mixing.begin()

    def _restart(self):
        """Begin a new grid."""
        segment = -1 if self.grid is None else self.grid.segment
        self.grid = Grid(self.names, self.rate_hz, self.settings.lateness_s)
        self.grid.segment = segment + 1         # so that whoever takes its rows begins anew too
        self._jumps, self._turns, self._segment, self._off = 0, 0, None, set()
        self._aligned, self._beside, self._apart = Aligned(), None, set()

    @property
    def counts(self):
        """Return what every channel has brought since the activation, a list of ChannelCount."""
        return [before.plus(now) for before, now in zip(self._before, self.grid.counts)]

    def open(self):     # noqa: A003
        """Let the samples in."""
        self._gate.set()

    def close(self):
        """Keep the samples out."""
        self._gate.clear()

    @property
    def is_open(self):
        """Whether samples are let in."""
        return self._gate.is_set()

    def release(self):
        """Give the subscriptions back."""
        self.close()
        self.node.destroy_timer(self._timer)
        for subscription in self._subscriptions:
            self.node.destroy_subscription(subscription)

    def states(self):
        """Return the ChannelState of every channel."""
        up_s, counts, out = time.monotonic() - self.began, self.counts, []
        offsets = self.grid.offsets() / (self.grid.rate_hz or 1.0)
        for i, source in enumerate(self.sources):
            offers = self.node.get_publishers_info_by_topic(source.resolved)
            silence, count = self._silences[source.topic], counts[i]
            out.append(ChannelState(
                source, len(offers), tuple({o.topic_type for o in offers} - {source.type}), count,
                self._lately.since(i, count), silence.idle_s if silence.silent else 0.0,
                self.grid.off_rate(i), self.grid.rate_hz, up_s, source.name in self._apart,
                float(offsets[i]), source.topic in self.mixing.now,
                self.mixing.left_out[source.topic]))
        return out

    def _collector(self, topic):
        append, gate, mixing = self._pending[topic].append, self._gate, self.mixing
        clock, simulated = self.node.get_clock(), self.node.get_parameter('use_sim_time').value
        now = (lambda: clock.now().nanoseconds) if simulated else time.time_ns

        def collect(raw, number):
            if gate.is_set():
                mixing.senders[topic].take(number)
                append((raw, now()))
        return with_number(collect)

    def _drain(self):
        now = time.monotonic()
        passed_s, self._looked = now - self._looked, now
        for topic, pending in self._pending.items():
            if self.is_open:
                self._silences[topic].look(passed_s, bool(pending))
        if self.mixing.look(self._pending):
            self._begin_anew()
        try:
            self._read()
        except ValueError as error:         # stamps of which no grid can be made
            self._fail(error)
        if now >= self._kept + 1.0:
            self._kept = now
            self._lately.keep(self.counts)
        self._report_silence()
        self._report_missing(now)
        self._report_turns()
        self._report_offsets()

    def _read(self):
        """Read the raw bytes into rows and hand them on."""
        for topic, pending in self._pending.items():
            if not pending:
                continue
            batch = [pending.popleft() for _ in range(len(pending))]
            for number, source in enumerate(self.sources):
                if source.topic == topic:
                    stamps, values = source.read(batch, self._note)
                    self.grid.push(number, stamps, values)
        for rows in self.grid.rows():
            if rows.segment != self._segment:
                self._segment = rows.segment
                self.node.get_logger().info(self.node.watching(rows), throttle_duration_sec=5.0)
            for part in (self._aligned.push(rows, self.grid.offsets()) if self.together
                         else (rows,)):
                self.take(part)

    def _fail(self, error):
        """Begin a new grid; the sentence is said once."""
        if str(error) != self.fault:
            self.node.get_logger().error(f'{error}; the window begins anew')
        self.fault = str(error)
        self._begin_anew()

    def _begin_anew(self):
        """Give the grid up; what waited for its place in it finds none any more."""
        self._before = [c.given_up() for c in self.counts]
        self._restart()

    def _report_silence(self):
        """Say once which channels fall silent, and once that they are back."""
        quiet = {s.name for s in self.sources if self._silences[s.topic].silent}
        if new := sorted(quiet - self._quiet):
            self.node.get_logger().warning(f'no sample any more of {", ".join(new)}')
        if back := sorted(self._quiet - quiet):
            self.node.get_logger().info(f'samples again of {", ".join(back)}')
        self._quiet = quiet

    def _report_turns(self):
        """Say what ended the window, and which channels are left out."""
        if len(self.grid.jumps) > self._jumps:
            old, new = self.grid.jumps[-1]
            self.clock_jumps += len(self.grid.jumps) - self._jumps
            self.node.get_logger().warning(
                f'the clock of the samples jumped by {(new - old) * 1e-9:+.3f} s: '
                'the window begins anew', throttle_duration_sec=5.0)
            del self.grid.jumps[:-KEPT]
            self._jumps = len(self.grid.jumps)
        if len(self.grid.turns) > self._turns:
            self.node.get_logger().warning(
                f'the rate of {self.grid.turns[-1][1]} has changed: the window begins anew',
                throttle_duration_sec=5.0)
            del self.grid.turns[:-KEPT]
            self._turns = len(self.grid.turns)
        off = {i for i in range(len(self.sources)) if self.grid.off_rate(i)}
        for i in sorted(off - self._off):
            self.node.get_logger().warning(
                f'{self.names[i]} comes at {self.grid.counts[i].rate_hz:.2f} Hz, the grid is at '
                f'{self.grid.rate_hz:.2f} Hz: its samples are left out', throttle_duration_sec=5.0)
        self._off = off

    def _report_offsets(self):
        """Say once a segment which channels are sampled beside the first one."""
        offsets, rate_hz = self.grid.offsets(), self.grid.rate_hz
        if self._beside != self._segment and not np.isnan(offsets).any():
            self._beside = self._segment
            for name, offset in zip(self.names, offsets):
                if abs(offset) > LARGE:
                    self.node.get_logger().warning(
                        beside_words(name, self.names[0], offset / rate_hz, self.together))
        apart = {n for n, d in zip(self.names, self.grid.drifts()) if abs(d) > DRIFTS}
        for name in sorted(apart - self._apart):
            self.node.get_logger().warning(apart_words([name], self.names[0]),
                                           throttle_duration_sec=60.0)
        self._apart = apart

    def apart_words(self):
        """Return why nothing can be said of clocks that run apart, empty where they do not."""
        return apart_words(self._apart, self.names[0])

    def _report_missing(self, now):
        """Say which samples are missing since the last time, ever less often."""
        # rows that a channel does not fill while it is silent, or at another rate, are reported
        # as that
        counts = self.counts
        lost = [(c.missing, c.late + c.bad_stamps + c.not_finite) for c in counts]
        for i, (name, (missing, bad), before) in enumerate(zip(self.names, lost, self._missing)):
            said = (name in self._quiet or i in self._off or not counts[i].received
                    or self.sources[i].topic in self.mixing.now)
            self._lost[name] += bad - before[1] + (0 if said else missing - before[0])
        self._missing = lost
        if now < self._said + self._say_s:
            return
        passed_s, self._said = now - self._said, now
        new, self._lost = +self._lost, Counter()
        if new:
            total = sum(c.received + c.missing for c in counts)
            share = min(100.0, 100 * sum(map(sum, lost)) / total)
            self.node.get_logger().warning(
                f'{sum(new.values())} samples missing in {passed_s:.0f} s ('
                + ', '.join(f'{name}: {n}' for name, n in new.items())
                + f'; {share:.3g} % since the start): never sent, lost on the '
                'way or of no use; `ssi_ros doctor` says where to begin')
        self._say_s = min(2.0 * self._say_s, SAY_LAST_S) if new else SAY_S

    def _note(self, text):
        self.node.get_logger().warning(text, throttle_duration_sec=5.0)


def sample_qos(settings):
    """
    Return the quality of service of a SampleInput's subscriptions.

    Reliable subscriptions keep all: what does not fit into the queue is not confirmed, and a
    publisher that keeps all, as the player does, waits. With keep-last the oldest would go.
    """
    if settings.reliable:
        return QoSProfile(history=HistoryPolicy.KEEP_ALL, depth=1,
                          reliability=ReliabilityPolicy.RELIABLE)
    return QoSProfile(history=HistoryPolicy.KEEP_LAST,
                      depth=max(1, int(settings.queue_s * settings.expected_rate_hz)),
                      reliability=ReliabilityPolicy.BEST_EFFORT)
