"""
Player node: a bag's messages again, byte for byte, at any rate, with /clock.

A thread publishes each message when it is due. Pause and resume are services. In a loop the
stamps go on rising: time never jumps back.
"""
from dataclasses import dataclass
import re
import threading
import time

from rclpy.qos import (DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy)
from rosgraph_msgs.msg import Clock
from ssi_ros.bag import open_bag
from ssi_ros.bag.play import schedule
from ssi_ros.quantity import quantity
from ssi_ros.ros.channels import message_class
from ssi_ros.ros.messages import status, time_of
from ssi_ros.ros.node import Audience, run, StageNode
from std_srvs.srv import Trigger

CLOCK_S = 0.01            # how often /clock is published while nothing else happens
DISCOVERY_S = 10.0        # how long to wait for the subscribers that were asked for


@dataclass(frozen=True)
class Playing:
    """What to play and how."""

    bag: str = quantity('', doc='the bag to play: its folder or its .mcap file', live=False)
    rate: float = quantity(1.0, low=1e-3, high=1e3, doc='seconds of the bag a second')
    start_s: float = quantity(0.0, unit='s', low=0.0, high=1e9, live=False,
                              doc='begin so far into the bag')
    duration_s: float = quantity(0.0, unit='s', low=0.0, high=1e9, live=False,
                                 doc='play so much of it, 0 = to its end')
    loop: bool = quantity(False, doc='begin anew at the end; stamps go on rising', live=False)
    topics: tuple = quantity(('.*',), live=False,
                             doc='regular expressions of the topic names to play')
    publish_clock: bool = quantity(True, doc='publish /clock', live=False)
    reliable: bool = quantity(False, live=False,
                              doc='publish reliable, whatever the recorded publishers offered')
    wait_for_subscribers: int = quantity(
        0, low=0, high=100, live=False,
        doc='begin when every topic has so many subscribers')
    paused: bool = quantity(False, doc='begin paused; see ~/resume', live=False)


class PlayerNode(StageNode):
    """Play a bag."""

    settings_classes = (Playing,)

    def __init__(self, **kwargs):
        super().__init__('player', **kwargs)
        self._services_made, self._made, self._thread = [], {}, None
        self._clock_publisher = None

    def configure(self, settings):
        """Open the bag and advertise its topics."""
        if not settings.bag:
            raise ValueError('no bag was named; set the parameter bag')
        self._bag = open_bag(settings.bag)
        topics = [t for t in self._bag.topics
                  if any(re.fullmatch(p, t.name) for p in settings.topics)]
        if not topics:
            raise ValueError(f'no topic of {settings.bag} matches {list(settings.topics)}; it has '
                             + ', '.join(t.name for t in self._bag.topics))
        for topic in topics:
            try:
                self._made[topic.name] = self.create_publisher(
                    message_class(topic.type), topic.name,
                    publisher_qos(topic.qos, settings.reliable))
            except ValueError as error:
                self.get_logger().warning(f'{topic.name} is not played: {error}')
        if settings.publish_clock:
            self._clock_publisher = self.create_publisher(Clock, '/clock', 10)
        self._services_made = [
            self.create_service(Trigger, '~/pause', self._pause),
            self.create_service(Trigger, '~/resume', self._resume)]
        self._running = threading.Event()
        self._stop = threading.Event()
        self.sent, self.bag_s, self.late_s = 0, 0.0, 0.0
        self.rate = settings.rate
        if not settings.paused:
            self._running.set()

    def activate(self):
        """Begin to play."""
        self._stop.clear()
        self._thread = threading.Thread(target=self._play, daemon=True)
        self._thread.start()

    def deactivate(self):
        """Stop playing; the next activation begins anew."""
        if self._thread is not None:
            self._stop.set()
            self._thread.join(timeout=10.0)
            self._thread = None

    def cleanup(self):
        """Release all that `configure` created."""
        for publisher in self._made.values():
            self.destroy_publisher(publisher)
        if self._clock_publisher is not None:
            self.destroy_publisher(self._clock_publisher)
        for service in self._services_made:
            self.destroy_service(service)
        self._made, self._clock_publisher, self._services_made = {}, None, []

    def settings_changed(self, settings):
        """Take another rate."""
        self.rate = settings.rate

    def _pause(self, request, response):
        self._running.clear()
        response.success, response.message = True, f'paused at {self.bag_s:.3f} s of the bag'
        return response

    def _resume(self, request, response):
        self._running.set()
        response.success, response.message = True, f'playing from {self.bag_s:.3f} s of the bag'
        return response

    def _wait_for_subscribers(self, wanted):
        audience, until = Audience(self._made.values(), wanted), time.monotonic() + DISCOVERY_S
        while not (audience.ready() or self._stop.is_set()):
            if time.monotonic() > until:
                self.get_logger().warning(f'playing although fewer than {wanted} listen to '
                                          + ', '.join(audience.short()))
                return
            time.sleep(0.01)

    def _play(self):
        settings = self.settings[0]
        try:
            self._wait_for_subscribers(settings.wait_for_subscribers)
            pace = _Pace(self)
            for due_s, topic, raw, stamp_ns in schedule(
                    self._bag, topics=list(self._made), start_s=settings.start_s,
                    duration_s=settings.duration_s, loop=settings.loop):
                if not pace.wait_until(due_s, stamp_ns):
                    return
                self._made[topic].publish(raw)
                self.sent += 1
        except (ValueError, OSError) as error:
            self.get_logger().error(f'playing stopped: {error}')
            self.exit_code = 1
        else:
            self.get_logger().info(f'{self.sent} messages played')
        self.done.set()

    def publish_clock(self, stamp_ns):
        """Publish the bag's time."""
        if self._clock_publisher is not None:
            self._clock_publisher.publish(Clock(clock=time_of(stamp_ns)))

    def health(self):
        """Tell how far the player is."""
        text = f'{self.bag_s:.1f} s of the bag at rate {self.rate:g}'
        if not self._running.is_set():
            text = f'paused at {self.bag_s:.1f} s of the bag'
        return [status(f'{self.get_name()}: bag', 'ok', text, bag=self.settings[0].bag,
                       sent=self.sent, bag_s=float(self.bag_s), rate=float(self.rate),
                       late_s=float(self.late_s))]


class _Pace:
    """Wall time against the bag's time, with pauses and changes of rate."""

    def __init__(self, node):
        self.node = node
        self.rate, self.wall, self.at = node.rate, time.monotonic(), 0.0
        self.clock_due = 0.0

    def wait_until(self, due_s, stamp_ns):
        """Wait for a time of the bag; False when the node is to stop."""
        node = self.node
        while not node._stop.is_set():
            if not node._running.wait(timeout=0.0):
                self.at = node.bag_s
                node._running.wait(timeout=0.05)
                self.wall = time.monotonic()
                continue
            if node.rate != self.rate:
                self.at, self.wall, self.rate = node.bag_s, time.monotonic(), node.rate
            wall = time.monotonic()
            now_s = self.at + (wall - self.wall) * self.rate
            node.bag_s = min(now_s, due_s)
            if wall >= self.clock_due:
                node.publish_clock(stamp_ns - round((due_s - node.bag_s) * 1e9))
                self.clock_due = wall + CLOCK_S
            left_s = (due_s - now_s) / self.rate
            if left_s <= 0.0:
                node.late_s = -left_s
                return True
            time.sleep(min(left_s, CLOCK_S))
        return False


def publisher_qos(offered, reliable=False):
    """Return the quality of service that the bag's publishers offered; reliable if asked."""
    first = offered[0] if offered else {}
    best_effort = not reliable and any(o.get('reliability') == 'best_effort' for o in offered)
    latched = bool(offered) and all(o.get('durability') == 'transient_local' for o in offered)
    depth = int(first.get('depth') or 0)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=max(depth, 5000),
        reliability=(ReliabilityPolicy.BEST_EFFORT if best_effort
                     else ReliabilityPolicy.RELIABLE),
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE))


def main(args=None):
    """Run the node until the end of the bag, SIGINT or SIGTERM."""
    return run(PlayerNode, args)


if __name__ == '__main__':
    raise SystemExit(main())
