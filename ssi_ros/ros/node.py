"""
What the nodes share: lifecycle with autostart, health at 1 Hz, a clean end.

A node derives from `StageNode`, creates its interfaces in `configure`, works between `activate`
and `deactivate`, and releases everything in `cleanup`. A `ValueError` or `OSError` in them is
reported as one clear line and a failed transition, never as a traceback.
"""
import json
import signal
import sys
import threading
import time
import traceback

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.exceptions import ParameterException
from rclpy.experimental import EventsExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.signals import SignalHandlerOptions
from ssi_ros.ros import parameters
from ssi_ros.ros.messages import status
from ssi_ros.ros.twins import twins

LINGER_S = 0.5
ACKNOWLEDGED_S = 10.0          # a reader that stands still may go on in that time
SETTLE_S = 0.5
FAILED = (ValueError, OSError, ParameterException)


class StageNode(LifecycleNode):
    """A lifecycle node with settings declared as records."""

    settings_classes = ()
    restarting_classes = ()        # those of them that can change although not `live`
    exit_code = 0

    def __init__(self, name, **kwargs):
        super().__init__(name, **kwargs)
        self.settings = ()
        self.done = threading.Event()          # set it to end the process
        self.declare_parameter('autostart', True)
        for cls in self.settings_classes:
            parameters.declare(self, cls)
        self.add_on_set_parameters_callback(parameters.answer(self._change))
        self._health_timer = self._health_publisher = None
        self.is_active, self._warned = False, set()
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)

    def every(self, period_s, callback):
        """Return a timer by the machine's own clock, which runs when simulated time stands."""
        return self.create_timer(period_s, callback, clock=self._steady)

    # what a node fills in
    def configure(self, *settings):
        """Create the interfaces; one record for each of `settings_classes`."""

    def activate(self):
        """Begin the work."""

    def deactivate(self):
        """Pause the work."""

    def cleanup(self):
        """Release everything that `configure` created."""

    def health(self):
        """Return a list of DiagnosticStatus, asked for once a second."""
        return []

    def announcement(self):
        """Return the line that says at the start what the node is about to do; or nothing."""
        return ''

    def settings_changed(self, *settings):
        """Take new settings while configured; ValueError refuses them."""

    # the lifecycle
    def on_configure(self, state):
        """Read the settings and create the interfaces."""
        def work():
            self.settings = tuple(parameters.read(self, c) for c in self.settings_classes)
            self._health_publisher = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
            self.configure(*self.settings)
            self._health_timer = self.every(1.0, self._publish_health)
        return self._attempt('configure', work, undo=self._release)

    def on_activate(self, state):
        """Begin the work."""
        result = super().on_activate(state)
        if result == _SUCCESS:
            result = self._attempt('activate', self.activate)
        self.is_active = result == _SUCCESS
        if self.is_active and (line := self.announcement()):
            self.get_logger().info(line)
        return result

    def on_deactivate(self, state):
        """Pause the work."""
        self.is_active = False
        self._attempt('deactivate', self.deactivate)
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        """Release everything."""
        return self._attempt('cleanup', self._release)

    def on_shutdown(self, state):
        """Stop the work and release everything."""
        self.is_active = False
        self._attempt('deactivate', self.deactivate)
        return self._attempt('shutdown', self._release)

    def on_error(self, state):
        """Release everything, so that the node can be configured anew."""
        return self._attempt('recover', self._release)

    def _attempt(self, what, work, undo=None):
        try:
            work()
        except FAILED as error:
            self.get_logger().error(f'cannot {what}: {error}')
            if undo is not None:
                undo()
            return TransitionCallbackReturn.FAILURE
        except Exception:       # rclpy would swallow it without a word
            self.get_logger().error(f'cannot {what}, a fault of this node:\n'
                                    + traceback.format_exc())
            return TransitionCallbackReturn.ERROR
        return _SUCCESS

    def _release(self):
        for timer in (self._health_timer,):
            if timer is not None:
                self.destroy_timer(timer)
        self._health_timer = None
        self.cleanup()
        if self._health_publisher is not None:
            self.destroy_publisher(self._health_publisher)
            self._health_publisher = None
        self.settings = ()

    def _publish_health(self):
        name = self.get_name()
        found = self.health() if self.is_active else [
            status(f'{name}: node', 'ok', 'inactive: configured, waits for activation')]
        for sentence in twins(self):
            found.append(status(f'{name}: names', 'warn', sentence))
            if sentence not in self._warned:
                self._warned.add(sentence)
                self.get_logger().warning(sentence)
        msg = DiagnosticArray(status=found)
        msg.header.stamp = self.get_clock().now().to_msg()
        self._health_publisher.publish(msg)

    def _change(self, changes):
        new = tuple(parameters.changed(record, changes, type(record) in self.restarting_classes)
                    for record in self.settings)
        if new != self.settings:
            self.settings_changed(*new)
            self.settings = new


class Audience:
    """
    Know when every publisher is heard by so many subscribers.

    A writer learns of a reader a moment before the reader learns of the writer, and nothing tells
    the writer when that is: what it sends in that moment is lost. So the matched counts must have
    stood for SETTLE_S before the first sample goes out.
    """

    def __init__(self, publishers, wanted):
        self.publishers, self.wanted, self._since = list(publishers), wanted, None

    def short(self):
        """Return the names of the topics that too few listen to."""
        return [p.topic_name for p in self.publishers
                if p.get_subscription_count() < self.wanted]

    def ready(self):
        """Return whether all are heard."""
        if not self.wanted:
            return True
        if self.short():
            self._since = None
            return False
        now = time.monotonic()
        self._since = self._since or now
        return now - self._since >= SETTLE_S


_SUCCESS = TransitionCallbackReturn.SUCCESS


def run(node_class, args=None, beside=None):
    """
    Run one node in this process until it is done or told to stop; return the exit code.

    SIGINT and SIGTERM end it cleanly: the node shuts down, files are closed, no traceback.

    Parameters
    ----------
    node_class : type
        The StageNode.
    args : list of str, optional
        ROS arguments; those of the process if not given.
    beside : callable, optional
        Called with the node; what it returns works beside it and is closed at the end.

    """
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    code, node, other, executor = 0, None, None, None
    try:
        node = node_class()
        parameters.check_known(node)
        executor = EventsExecutor()
        executor.add_node(node)
        autostart = node.get_parameter('autostart').value
        if not autostart:
            node.get_logger().info('unconfigured, since autostart is false; waits for: '
                                   f'ros2 lifecycle set {node.get_fully_qualified_name()} '
                                   'configure, then activate')
        if autostart and not _start(node):
            code = 2
        else:
            other = beside(node) if beside is not None else None
            # an infinite timeout hangs in this executor, a finite one does not
            while not stop.is_set() and not node.done.is_set():
                _spin(executor, node)
            _linger(executor, node, stop)
        node.trigger_shutdown()
        code = code or node.exit_code
    except FAILED as error:
        print(f'{node_class.__name__}: {error}', file=sys.stderr)
        code = 2
    finally:
        if other is not None:
            other.close()
        if executor is not None:
            # what is destroyed while an executor still listens to it may end in a segmentation
            # fault (ros2/rclpy #1644)
            executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return code


def _spin(executor, node):
    """Let one event be handled; a fault in its callback is told, the node goes on."""
    try:
        executor.spin_once(timeout_sec=0.2)
    except Exception:
        node.get_logger().error('a callback failed, the node goes on:\n'
                                + traceback.format_exc(), throttle_duration_sec=10.0)


def _linger(executor, node, stop):
    """Let the last messages reach their readers before the publishers go away."""
    begin = time.monotonic()
    waiting = list(node.publishers)
    while not stop.is_set() and (waiting or time.monotonic() < begin + LINGER_S):
        if time.monotonic() > begin + ACKNOWLEDGED_S:
            node.get_logger().warning(
                f'{ACKNOWLEDGED_S:g} s after the end readers have not confirmed all of '
                + ', '.join(p.topic_name for p in waiting) + '; what they lack is lost')
            return
        executor.spin_once(timeout_sec=0.05)
        waiting = [p for p in waiting if not p.wait_for_all_acked(Duration())]


def ros_arguments(parameters, remaps=()):
    """
    Return parameters and remappings as ROS command line arguments.

    JSON is YAML: a path that looks like a number stays a text, a list stays a list.
    """
    words = ['--ros-args']
    for name, value in parameters.items():
        if isinstance(value, tuple):
            value = list(value)
        plain = isinstance(value, (bool, int, float, list))
        words += ['-p', f'{name}:={json.dumps(value if plain else str(value))}']
    for remap in remaps:
        words += ['-r', remap]
    return words


def _start(node):
    return (node.trigger_configure() == _SUCCESS and node.trigger_activate() == _SUCCESS)
