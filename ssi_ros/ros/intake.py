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

DRAIN_S = 0.2             # how often the raw bytes are read into rows


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
        self.began = time.monotonic()
        self._pending = {s.topic: deque() for s in self.sources}
        self._gate = threading.Event()
        self.begin()
        qos = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=max(1, int(settings.queue_s * settings.expected_rate_hz)),
            reliability=(ReliabilityPolicy.RELIABLE if settings.reliable
                         else ReliabilityPolicy.BEST_EFFORT))
        self._subscriptions = [
            node.create_subscription(message_class, topic, self._collector(topic), qos, raw=True)
            for topic, message_class in {s.topic: s.message_class for s in self.sources}.items()]
        self._timer = node.every(DRAIN_S, self._drain)

    def begin(self):
        """Begin a new grid with the next sample."""
        for pending in self._pending.values():
            pending.clear()
        self.grid = Grid(self.names, self.rate_hz, self.settings.lateness_s)
        self._jumps = 0

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
        return [self.node.count_publishers(self.node.resolve_topic_name(s.topic))
                for s in self.sources]

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
            self.take(rows)
        if len(self.grid.jumps) > self._jumps:
            self._jumps = len(self.grid.jumps)
            old, new = self.grid.jumps[-1]
            self.node.get_logger().warning(
                f'the clock of the samples jumped by {(new - old) * 1e-9:+.3f} s: '
                'the window begins anew')

    def _note(self, text):
        self.node.get_logger().warning(text, throttle_duration_sec=5.0)
