"""
Identifier node: numeric fields of any topics in, frequencies and damping of every window out.

The subscription callback only appends raw bytes; a timer reads them into rows; a worker thread
with one BLAS thread runs SSI-COV, so that no sample waits for a singular value decomposition.
"""
from collections import deque
import json
import queue
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import (DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy)
from ssi_ros.identify import Identification
from ssi_ros.identify.grid import Grid
from ssi_ros.identify.stamped import SegmentMonitor
from ssi_ros.ros import health
from ssi_ros.ros.channels import channel_sources
from ssi_ros.ros.identifier_settings import IdentifierInput
from ssi_ros.ros.messages import modes_message, SERIES, series_message, Slots
from ssi_ros.ros.node import run, StageNode
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

DRAIN_S = 0.2             # how often the raw bytes are read into rows


class IdentifierNode(StageNode):
    """Watch the modes of a structure through its accelerometers."""

    settings_classes = (IdentifierInput, Identification)
    restarting_classes = (Identification,)

    def __init__(self, **kwargs):
        super().__init__('identifier', **kwargs)
        self._subscriptions_made, self._publishers_made = [], []
        self._timer = self._service = None
        self._worker = None

    def configure(self, source, identification):
        """Subscribe, advertise, and start the worker."""
        self.sources = channel_sources(source)
        self._pending = {s.topic: deque() for s in self.sources}
        self._modes = self._advertise(DiagnosticArray, '~/modes')
        self._series = {n: self._advertise(Float64MultiArray, f'~/{n}') for n in SERIES}
        self._service = self.create_service(Trigger, '~/identify_now', self._identify_now)
        self._worker = Worker(self, source, identification)
        depth = int(source.queue_s * source.expected_rate_hz)
        reliability = (ReliabilityPolicy.RELIABLE if source.reliable
                       else ReliabilityPolicy.BEST_EFFORT)
        qos = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=reliability)
        self._gate = threading.Event()
        for topic, message_class in {s.topic: s.message_class for s in self.sources}.items():
            self._subscriptions_made.append(self.create_subscription(
                message_class, topic, self._collector(topic), qos, raw=True))
        self._timer = self.every(DRAIN_S, self._drain)
        self._started = time.monotonic()

    def _advertise(self, message_class, topic):
        qos = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=100,
                         reliability=ReliabilityPolicy.RELIABLE,
                         durability=DurabilityPolicy.VOLATILE)
        publisher = self.create_lifecycle_publisher(message_class, topic, qos)
        self._publishers_made.append(publisher)
        return publisher

    def _collector(self, topic):
        append, gate = self._pending[topic].append, self._gate
        if self.get_parameter('use_sim_time').value:
            clock = self.get_clock()
            return lambda raw: gate.is_set() and append((raw, clock.now().nanoseconds))
        return lambda raw: gate.is_set() and append((raw, time.time_ns()))

    def activate(self):
        """Let the samples in."""
        self._worker.begin()
        self._gate.set()

    def deactivate(self):
        """Keep the samples out; the window begins anew after the next activation."""
        if self._worker is not None:
            self._gate.clear()

    def cleanup(self):
        """Release all that `configure` created."""
        if self._timer is not None:
            self.destroy_timer(self._timer)
        for subscription in self._subscriptions_made:
            self.destroy_subscription(subscription)
        if self._worker is not None:
            self._worker.stop()
            counts = self._worker.grid.counts
            self.get_logger().info(
                f'{self._worker.computed} windows; samples received '
                f'{[c.received for c in counts]}, missing {[c.missing for c in counts]}')
        for publisher in self._publishers_made:
            self.destroy_lifecycle_publisher(publisher)
        if self._service is not None:
            self.destroy_service(self._service)
        self._timer = self._service = self._worker = None
        self._subscriptions_made, self._publishers_made = [], []

    def _drain(self):
        """Read the raw bytes that came in, hand the rows to the worker."""
        grid, worker = self._worker.grid, self._worker
        for topic, pending in self._pending.items():
            if not pending:
                continue
            batch = [pending.popleft() for _ in range(len(pending))]
            for number, source in enumerate(self.sources):
                if source.topic == topic:
                    stamps, values = source.read(batch, self._note)
                    grid.push(number, stamps, values)
        for rows in grid.rows():
            worker.put(rows)
        self._report_jumps(grid)

    def _report_jumps(self, grid):
        if len(grid.jumps) > self._worker.jumps_seen:
            self._worker.jumps_seen = len(grid.jumps)
            old, new = grid.jumps[-1]
            self.get_logger().warning(
                f'the clock of the samples jumped by {(new - old) * 1e-9:+.3f} s: '
                'the window begins anew')

    def _note(self, text):
        self.get_logger().warning(text, throttle_duration_sec=5.0)

    def publish(self, window):
        """Publish one window; called by the worker."""
        if not self._gate.is_set():
            return
        slots = self._worker.slots
        for identity in slots.update(window):
            self._note(f'mode {identity} found no free slot of {slots.size}: raise slots')
        self._modes.publish(modes_message(window, slots.of))
        for name, publisher in self._series.items():
            publisher.publish(series_message(window, name, slots.of, slots.size))

    def settings_changed(self, source, identification):
        """Take other settings; what shapes the window starts it anew."""
        self._worker.change(identification)

    def _identify_now(self, request, response):
        window = self._worker.identify_now()
        response.success = bool(window is not None and window.modes)
        if window is None:
            response.message = 'no samples yet: is the simulator or the player running?'
        else:
            self.publish(window)
            response.message = json.dumps({
                'end_ns': window.end_ns, 'reason': window.reason,
                'frequency_hz': [m.frequency_hz for m in window.modes],
                'damping_ratio': [m.damping_ratio for m in window.modes]})
        return response

    def health(self):
        """Tell of every channel and of the identification."""
        names = [self.resolve_topic_name(s.topic) for s in self.sources]
        publishers = [self.count_publishers(name) for name in names]
        return health.identifier(self.get_name(), self.sources, publishers, self._worker,
                                 time.monotonic() - self._started)


class Worker:
    """The thread that identifies, and what it works on."""

    def __init__(self, node, source, identification):
        self.node, self.source, self.identification = node, source, identification
        self.lock = threading.Lock()
        self.rows = queue.SimpleQueue()
        self.slots = Slots(source.slots)
        self.computed, self.compute_s, self.worst_s, self.last = 0, 0.0, 0.0, None
        self.begin()
        self.thread = threading.Thread(target=self._work, daemon=True)
        self.thread.start()

    def begin(self):
        """Begin a new window with the next sample."""
        names = [s.name for s in self.node.sources]
        with self.lock:
            self.grid = Grid(names, self.source.rate_hz, self.source.lateness_s)
            self.follow = SegmentMonitor(names, self.identification)
            self.jumps_seen = 0

    def put(self, rows):
        """Queue rows for the worker."""
        self.rows.put(rows)

    def change(self, identification):
        """Take other settings; a window of another shape begins anew."""
        with self.lock:
            self.follow.change(identification)
            self.identification = identification

    def identify_now(self):
        """Return the modes of what the window holds; None before the first sample."""
        with self.lock:
            monitor = self.follow.monitor
            return None if monitor is None else monitor.identify_now()

    def stop(self):
        """End the thread."""
        self.rows.put(None)
        self.thread.join(timeout=10.0)

    def _work(self):
        while (rows := self.rows.get()) is not None:
            try:
                self._take(rows)
            except Exception as error:      # a node never dies of data: say it, go on
                self.node.get_logger().error(
                    f'a window could not be identified ({type(error).__name__}: {error}); '
                    'the window begins anew')
                self.follow.restart()

    def _take(self, rows):
        before = time.thread_time()
        with self.lock:
            windows = self.follow.push(rows)
        spent = time.thread_time() - before
        if windows:
            self.computed += len(windows)
            self.compute_s = spent / len(windows)
            self.worst_s = max(self.worst_s, self.compute_s)
            self.last = windows[-1]
        for window in windows:
            self.node.publish(window)


def main(args=None):
    """Run the node until SIGINT or SIGTERM."""
    return run(IdentifierNode, args)


if __name__ == '__main__':
    raise SystemExit(main())
