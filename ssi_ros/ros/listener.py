"""Listen to the results on the topics and keep a `Watch` of them up to date, in a thread."""
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from ssi_ros.monitor.watch import Status, Watch, with_gap, with_health, with_where, with_window
from ssi_ros.ros.messages import window_of
from std_msgs.msg import Float64

LEVELS = {DiagnosticStatus.OK: 'ok', DiagnosticStatus.WARN: 'warn',
          DiagnosticStatus.ERROR: 'error', DiagnosticStatus.STALE: 'stale'}
ADAPT_S = 0.5             # how often the publishers of modes are looked at
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
        self._modes, self._latched, self._hears = f'{identifier}/modes', True, None
        self._hear_modes()
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
        return self.node.create_subscription(message_class, topic, take, qos)

    def _hear_modes(self):
        """Subscribe so that the windows of before come too, if the publisher keeps them."""
        if self._hears is not None:
            self.node.destroy_subscription(self._hears)
        self._hears = self._listen(DiagnosticArray, self._modes, QoSProfile(
            depth=100, durability=(DurabilityPolicy.TRANSIENT_LOCAL if self._latched
                                   else DurabilityPolicy.VOLATILE)), self._window)

    def _adapt(self):
        """Follow a publisher that keeps no windows, as the player of an older bag."""
        offers = self.node.get_publishers_info_by_topic(self._modes)
        latched = all(o.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
                      for o in offers)
        if offers and latched != self._latched:
            self._latched = latched
            self._hear_modes()

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
        looked = 0.0
        while not self._stop.is_set():
            try:
                self.executor.spin_once(timeout_sec=0.5)
            except rclpy_implementation.InvalidHandle:
                # an event of the subscription that another one has taken the place of since
                continue
            if time.monotonic() > looked + ADAPT_S:
                looked = time.monotonic()
                self._adapt()

    def close(self):
        """Stop listening."""
        self._stop.set()
        self.thread.join(timeout=5.0)
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown()


def _status(status):
    return Status(status.name, LEVELS.get(status.level, 'stale'), status.message,
                  {v.key: v.value for v in status.values})
