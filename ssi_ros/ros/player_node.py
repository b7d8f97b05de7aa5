"""
Player node: a bag's messages again, byte for byte, at any rate, with /clock.

A thread publishes each message when it is due. Pause and resume are services. In a loop the
stamps go on rising: time never jumps back.
"""
from dataclasses import dataclass
import re
import threading
import time

from rclpy.impl.implementation_singleton import rclpy_implementation
from rosgraph_msgs.msg import Clock
from ssi_ros.bag import open_bag
from ssi_ros.bag.names import check_topic
from ssi_ros.bag.play import schedule
from ssi_ros.quantity import quantity
from ssi_ros.ros.channels import message_class
from ssi_ros.ros.messages import status, time_of
from ssi_ros.ros.node import Audience, run, StageNode
from ssi_ros.ros.replayed_qos import publisher_qos
from std_srvs.srv import Trigger

CLOCK_S = 0.01            # how often /clock is published while nothing else happens
DISCOVERY_S = 10.0        # how long to wait for the subscribers that were asked for
FULL_S = 0.05             # `publish` waits longer, 0.1 s, where the queue is full
HELD_S = 0.5              # how long readers may hold up the bag before it is said


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
                              doc='publish reliable, whatever the recorded publishers offered, '
                              'and wait for reliable readers that are behind')
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
        for warning in self._bag.warnings:
            self.get_logger().warning(warning)
        patterns = [_pattern(p) for p in settings.topics]
        topics = [t for t in self._bag.topics if any(p.fullmatch(t.name) for p in patterns)]
        if not topics:
            raise ValueError(f'no topic of {settings.bag} matches {list(settings.topics)}; it has '
                             + ', '.join(t.name for t in self._bag.topics))
        for topic in topics:
            try:
                self._made[topic.name] = self.create_publisher(
                    message_class(topic.type), check_topic(topic.name),
                    publisher_qos(topic.qos, settings.reliable))
            except ValueError as error:
                self.get_logger().warning(f'{topic.name!r:.100} is not played: {error}')
        if settings.publish_clock:
            self._clock_publisher = self.create_publisher(Clock, '/clock', 10)
        self._services_made = [
            self.create_service(Trigger, '~/pause', self._pause),
            self.create_service(Trigger, '~/resume', self._resume)]
        self._running = threading.Event()
        self.begin_s = settings.start_s
        self._stop = threading.Event()
        self.sent, self.bag_s, self.late_s, self.held_s = 0, 0.0, 0.0, 0.0
        self.length_s = (self._bag.end_ns - self._bag.start_ns) * 1e-9
        self._seek_s = None
        self.rate = settings.rate
        if not settings.paused:
            self._running.set()

    def announcement(self):
        """Say what is played."""
        bag, settings = self._bag, self.settings[0]
        return (f'playing {settings.bag}: {len(self._made)} topics, '
                f'{(bag.end_ns - bag.start_ns) * 1e-9:.0f} s at rate {settings.rate:g}'
                + (', again and again' if settings.loop else '')
                + (', paused' if settings.paused else ''))

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
        response.success, response.message = True, f'paused at {self.at_s:.3f} s of the bag'
        return response

    def _resume(self, request, response):
        self._running.set()
        response.success, response.message = True, f'playing from {self.at_s:.3f} s of the bag'
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
            while self._play_from(self._where(settings), settings):
                pass                                  # another place was asked for
            if self._stop.is_set():
                return
        except (ValueError, OSError) as error:
            self.get_logger().error(f'playing stopped: {error}')
            self.exit_code = 1
        else:
            self.get_logger().info(f'{self.sent} messages played')
        self.done.set()

    def _where(self, settings):
        """Return where to begin [s]: where it was asked for, else where the settings say."""
        at, self._seek_s = self._seek_s, None
        return settings.start_s if at is None else at

    def _play_from(self, start_s, settings):
        """Play from a place of the bag; True when it stopped because another was asked for."""
        left_s = settings.duration_s and settings.start_s + settings.duration_s - start_s
        self.begin_s, self.bag_s = start_s, 0.0
        pace = _Pace(self)
        for due_s, topic, raw, stamp_ns in schedule(
                self._bag, topics=list(self._made), start_s=start_s, duration_s=left_s,
                loop=settings.loop):
            if not (pace.wait_until(due_s, stamp_ns) and self._publish(topic, raw, pace)):
                break
            self.sent += 1
        return self._seek_s is not None and not self._stop.is_set()

    def seek(self, at_s):
        """Go on at a place of the bag [s], within what is played; stamps jump with it."""
        settings = self.settings[0]
        end_s = settings.start_s + settings.duration_s if settings.duration_s else self.length_s
        self._seek_s = min(max(at_s, settings.start_s), max(settings.start_s, end_s - 0.5))

    def toggle(self):
        """Pause, or go on; return whether it plays."""
        (self._running.clear if self._running.is_set() else self._running.set)()
        return self._running.is_set()

    @property
    def at_s(self):
        """Where it is in the bag [s]; in a loop of the first pass on."""
        return self.begin_s + self.bag_s

    @property
    def plays(self):
        """Whether it is not paused."""
        return self._running.is_set()

    def _publish(self, topic, raw, pace):
        """Publish once there is room for it; False when the node is to stop."""
        began = None
        while not self._stop.is_set():
            tried = time.monotonic()
            try:
                self._made[topic].publish(raw)
            except rclpy_implementation.RCLError as error:
                if time.monotonic() - tried < FULL_S:
                    raise OSError(f'{topic} cannot be published: {error}') from None
                began = began or tried      # a reader has not confirmed what the queue holds
                continue
            if began is not None:
                held_s = time.monotonic() - began
                self.held_s += held_s
                pace.begin()
                if held_s > HELD_S:
                    self.get_logger().warning(
                        f'waited {held_s:.1f} s for a reader of {topic}; nothing is lost, a lower '
                        'rate keeps the pace', throttle_duration_sec=5.0)
            return True
        return False

    def publish_clock(self, stamp_ns):
        """Publish the bag's time."""
        if self._clock_publisher is not None:
            self._clock_publisher.publish(Clock(clock=time_of(stamp_ns)))

    def health(self):
        """Tell how far the player is."""
        text = f'{self.at_s:.1f} s of the bag at rate {self.rate:g}'
        if not self._running.is_set():
            text = f'paused at {self.at_s:.1f} s of the bag'
        return [status(f'{self.get_name()}: bag', 'ok', text, bag=self.settings[0].bag,
                       sent=self.sent, bag_s=float(self.at_s), rate=float(self.rate),
                       late_s=float(self.late_s), held_s=float(self.held_s))]


class _Pace:
    """Wall time against the bag's time, with pauses and changes of rate."""

    def __init__(self, node):
        self.node, self.clock_due = node, 0.0
        self.begin()

    def begin(self):
        """Let the bag's time go on from where it is, from now on."""
        node = self.node
        self.at, self.wall, self.rate = node.bag_s, time.monotonic(), node.rate

    def wait_until(self, due_s, stamp_ns):
        """Wait for a time of the bag; False when the node is to stop."""
        node = self.node
        while not node._stop.is_set() and node._seek_s is None:
            if not node._running.wait(timeout=0.0):
                self.at = node.bag_s
                node._running.wait(timeout=0.05)
                self.wall = time.monotonic()
                continue
            if node.rate != self.rate:
                self.begin()
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


def _pattern(text):
    """Return a regular expression of topic names; ValueError if it is none."""
    try:
        return re.compile(text)
    except re.error as error:
        raise ValueError(f'topics: {text!r} is not a regular expression: {error}') from None


def main(args=None, beside=None):
    """Run the node until the end of the bag, SIGINT or SIGTERM; `beside` as in `run`."""
    return run(PlayerNode, args, beside)


if __name__ == '__main__':
    raise SystemExit(main())
