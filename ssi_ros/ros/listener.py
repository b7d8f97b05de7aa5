"""Listen to the results on the topics and keep a `Watch` of them up to date, in a thread."""
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from ssi_ros.monitor.watch import (Status, Watch, with_gap, with_health, with_where, with_window)
from ssi_ros.ros.messages import window_of
from std_msgs.msg import Float64

LEVELS = {DiagnosticStatus.OK: 'ok', DiagnosticStatus.WARN: 'warn',
          DiagnosticStatus.ERROR: 'error', DiagnosticStatus.STALE: 'stale'}
GAP = ('gap', 'floor', 'deviations')


class Listener:
    """
    Listen until closed; `watch` is what is known at this moment.

    Only results are subscribed to, no samples: that is what keeps it cheap.

    Parameters
    ----------
    identifier, gap : str
        Names of the two nodes.

    """

    def __init__(self, identifier='/identifier', gap='/gap'):
        self.watch = Watch()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node('monitor', enable_rosout=False,
                                      start_parameter_services=False)
        self.faults = 0
        results = QoSProfile(depth=100)
        self._listen(DiagnosticArray, f'{identifier}/modes', results, self._window)
        self._listen(DiagnosticArray, '/diagnostics', results, self._health)
        self._listen(DiagnosticArray, f'{gap}/where', results, self._where)
        for name in GAP:
            self._listen(Float64, f'{gap}/{name}', results, self._number(name))
        self.executor = EventsExecutor()
        self.executor.add_node(self.node)
        self._stop = threading.Event()
        self.thread = threading.Thread(target=self._spin, daemon=True)
        self.thread.start()

    def _listen(self, message_class, topic, qos, take):
        self.node.create_subscription(message_class, topic, take, qos)

    def _window(self, msg):
        try:
            window = window_of(msg)
        except (KeyError, ValueError):      # a message of another shape on this topic
            self.faults += 1
            return
        self.watch = with_window(self.watch, window, time.monotonic())

    def _health(self, msg):
        self.watch = with_health(self.watch, map(_status, msg.status), time.monotonic())

    def _where(self, msg):
        self.watch = with_where(self.watch, map(_status, msg.status), time.monotonic())

    def _number(self, name):
        def take(msg):
            self.watch = with_gap(self.watch, name, msg.data, time.monotonic())
        return take

    def _spin(self):
        while not self._stop.is_set():
            self.executor.spin_once(timeout_sec=0.5)

    def close(self):
        """Stop listening."""
        self._stop.set()
        self.thread.join(timeout=5.0)
        self.node.destroy_node()
        rclpy.try_shutdown()


def _status(status):
    return Status(status.name, LEVELS.get(status.level, 'stale'), status.message,
                  {v.key: v.value for v in status.values})
