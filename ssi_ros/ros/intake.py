"""
Samples from topics to rows of one grid: subscriptions that only append, a timer that reads.

The subscription callback only appends raw bytes; a timer reads them into a `Grid` and hands the
rows that are complete on, in an order that depends on the stamps alone.
"""
from collections import deque
import threading
import time

from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from ssi_ros.identify.grid import Grid
from ssi_ros.ros.channels import channel_sources
from ssi_ros.ros.messages import clock_words

DRAIN_S = 0.2             # how often the raw bytes are read into rows
SAY_S = 5.0               # how often missing samples are reported


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

    Raises
    ------
    ValueError
        For a channel that cannot be read.

    """

    def __init__(self, node, settings, rate_hz, take):
        self.node, self.settings, self.rate_hz, self.take = node, settings, rate_hz, take
        self.sources = channel_sources(settings)
        self.names = [s.name for s in self.sources]
        for source in self.sources:
            source.resolved = node.resolve_topic_name(source.topic)
        self.began = time.monotonic()
        self._pending = {s.topic: deque() for s in self.sources}
        self._gate = threading.Event()
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
        self.grid = Grid(self.names, self.rate_hz, self.settings.lateness_s)
        self._jumps, self._segment = 0, None
        self._missing, self._said = [0] * len(self.sources), time.monotonic()

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

    def publishers(self):
        """Return how many publishers each channel has."""
        return [self.node.count_publishers(s.resolved) for s in self.sources]

    def _collector(self, topic):
        append, gate = self._pending[topic].append, self._gate
        if self.node.get_parameter('use_sim_time').value:
            clock = self.node.get_clock()
            return lambda raw: gate.is_set() and append((raw, clock.now().nanoseconds))
        return lambda raw: gate.is_set() and append((raw, time.time_ns()))

    def _drain(self):
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
                self.node.get_logger().info(self.node.watching(rows))
            self.take(rows)
        self._report_missing()
        if len(self.grid.jumps) > self._jumps:
            self._jumps = len(self.grid.jumps)
            old, new = self.grid.jumps[-1]
            self.node.get_logger().warning(
                f'the clock of the samples jumped by {(new - old) * 1e-9:+.3f} s: '
                'the window begins anew')

    def _report_missing(self):
        """Say which samples are missing since the last time, at most every SAY_S."""
        now = time.monotonic()
        if now < self._said + SAY_S:
            return
        lost = [c.missing + c.late for c in self.grid.counts]
        new = {name: n - before for name, n, before in zip(self.names, lost, self._missing)
               if n > before}
        self._missing, self._said = lost, now
        if new:
            total = sum(c.received for c in self.grid.counts) + sum(lost)
            self.node.get_logger().warning(
                f'{sum(new.values())} samples missing in {SAY_S:g} s ('
                + ', '.join(f'{name}: {n}' for name, n in new.items())
                + f'; {100 * sum(lost) / total:.2g} % since the start): never sent, or lost on '
                'the way; `ssi_ros doctor` says where to begin')

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


def waits_for(intake):
    """Return the words for channels whose samples have not come yet."""
    return f'waiting for {len(intake.sources)} channels: ' + ', '.join(
        s.resolved for s in intake.sources)


def watches(intake, rows, window_s):
    """Return the words for channels whose samples have come, and when a window will be full."""
    n = len(intake.sources)
    first = rows.origin_ns + round((rows.first / rows.rate_hz + window_s) * 1e9)
    return (f'watching {n} channel{"s" * (n > 1)} at {rows.rate_hz:g} Hz, window {window_s:g} s, '
            f'first result at {clock_words(first)}')
