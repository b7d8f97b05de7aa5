"""
Identifier node: numeric fields of any topics in, frequencies and damping of every window out.

The intake appends raw bytes and reads them into rows; a worker thread with one BLAS thread runs
SSI-COV, so that no sample waits for a singular value decomposition.
"""
import json
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from ssi_ros.identify import Identification
from ssi_ros.identify.stamped import SegmentMonitor
from ssi_ros.ros import health
from ssi_ros.ros.backlog import Backlog
from ssi_ros.ros.identifier_settings import IdentifierInput
from ssi_ros.ros.intake import Intake
from ssi_ros.ros.intake_words import waits_for, watches
from ssi_ros.ros.messages import modes_message, series_message, shape_message, Slots, SLOTTED
from ssi_ros.ros.node import run, StageNode
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger


class IdentifierNode(StageNode):
    """Watch the modes of a structure through its accelerometers."""

    settings_classes = (IdentifierInput, Identification)
    restarting_classes = (Identification,)

    def __init__(self, **kwargs):
        super().__init__('identifier', **kwargs)
        self._publishers_made = []
        self._intake = self._worker = self._service = None

    def configure(self, source, identification):
        """Subscribe, advertise, and start the worker."""
        self._intake = Intake(self, source, source.rate_hz, self._take)
        self._modes = self._advertise(DiagnosticArray, '~/modes', latched=True)
        self._series = {n: self._advertise(Float64MultiArray, f'~/{n}') for n in SLOTTED}
        self._shape = self._advertise(Float64MultiArray, '~/shape')
        self._service = self.create_service(Trigger, '~/identify_now', self._identify_now)
        self._worker = Worker(self, self._intake, source.slots, identification)

    def announcement(self):
        """Say what it waits for."""
        return waits_for(self._intake)

    def watching(self, rows):
        """Return the line that says what is watched, when the first row of it is there."""
        window_s, hop_s = self.settings[1].window_s, self.settings[1].hop_s
        return watches(self._intake, rows, window_s) + f', then every {hop_s:g} s'

    def _advertise(self, message_class, topic, latched=False):
        qos = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=100,
                         reliability=ReliabilityPolicy.RELIABLE,
                         durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched
                                     else DurabilityPolicy.VOLATILE))
        publisher = self.create_lifecycle_publisher(message_class, topic, qos)
        self._publishers_made.append(publisher)
        return publisher

    def activate(self):
        """Let the samples in."""
        self._intake.begin()
        self._worker.begin()
        self._intake.open()

    def deactivate(self):
        """Keep the samples out; the window begins anew after the next activation."""
        if self._intake is not None:
            self._intake.close()

    def cleanup(self):
        """Release all that `configure` created."""
        if self._intake is not None:
            self._intake.release()
        if self._worker is not None:
            self._worker.stop()
            counts = self._intake.counts
            self.get_logger().info(
                f'{self._worker.computed} windows{self._worker.rows.words()}; samples received '
                f'{[c.received for c in counts]}, missing {[c.missing for c in counts]}')
        for publisher in self._publishers_made:
            self.destroy_lifecycle_publisher(publisher)
        if self._service is not None:
            self.destroy_service(self._service)
        self._publishers_made = []
        self._intake = self._worker = self._service = None

    def _take(self, rows):
        self._worker.rows.put(rows)

    def _note(self, text):
        self.get_logger().warning(text, throttle_duration_sec=5.0)

    def publish(self, window):
        """Publish one window; called by the worker."""
        if not self._intake.is_open:
            return
        slots = self._worker.slots
        for identity in slots.update(window):
            self._note(f'mode {identity} found no free slot of {slots.size}: raise slots')
        self._modes.publish(modes_message(window, slots.of))
        for name, publisher in self._series.items():
            publisher.publish(series_message(window, name, slots.of, slots.size))
        self._shape.publish(shape_message(window, slots.of, slots.size, self._intake.names))

    def settings_changed(self, source, identification):
        """Take other settings; what shapes the window starts it anew."""
        self._worker.change(identification)

    def _identify_now(self, request, response):
        if mixed := self._intake.mixing.words():
            response.success, response.message = False, mixed
            return response
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
        return health.identifier(self.get_name(), self._intake.states(), self._worker,
                                 self._intake.clock_jumps)


class Worker:
    """The thread that identifies, and what it works on."""

    def __init__(self, node, intake, slots, identification):
        self.node, self.intake, self.identification = node, intake, identification
        self.lock = threading.Lock()
        self.rows = Backlog(node.get_logger().warning)
        self.slots = Slots(slots)
        self.computed, self.compute_s, self.worst_s, self.last = 0, 0.0, 0.0, None
        self.begin()
        self.thread = threading.Thread(target=self._work, daemon=True)
        self.thread.start()

    def begin(self):
        """Begin a new window with the next sample."""
        with self.lock:
            self.follow = SegmentMonitor(self.intake.names, self.identification)

    @property
    def grid(self):
        """Return the grid from which the rows come."""
        return self.intake.grid

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
            windows = self.follow.push(rows, lambda left: self.rows.late(
                left, rows.rate_hz, self.identification))
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
