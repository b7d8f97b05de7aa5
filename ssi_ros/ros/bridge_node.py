"""
Bridge node: topics as they are to Foxglove, over a WebSocket of this machine alone.

Every topic is offered; a topic is subscribed to only while somebody looks at it, so an idle bridge
costs next to nothing. The CDR bytes go through untouched. Nobody can publish through it, and pages
of other web sites cannot listen.
"""
from dataclasses import dataclass
import random
import re
import time

from ssi_ros.bag import definition_of
from ssi_ros.quantity import check, quantity, shown
from ssi_ros.ros.arrivals import Silence
from ssi_ros.ros.channels import message_class
from ssi_ros.ros.front_door import FrontDoor
from ssi_ros.ros.losses import Losses, with_number
from ssi_ros.ros.messages import status
from ssi_ros.ros.node import run, StageNode
from ssi_ros.ros.recorder_node import adapted_qos

LOOK_S = 0.25             # how often new topics and new listeners are looked for
DEPTH = 1000              # messages a topic that wait while the process is busy
HOST = '127.0.0.1'        # never another: the protocol knows no passwords


@dataclass(frozen=True)
class Bridging:
    """What to show, and where."""

    port: int = quantity(8765, low=0, high=65535, live=False,
                         doc='port of the WebSocket on 127.0.0.1, 0 = a free one')
    topics: tuple = quantity(('.*',), live=False,
                             doc='regular expressions of the topic names to offer')

    origins: tuple = quantity(
        (r'https://app\.foxglove\.(dev|com)', r'https?://(localhost|127\.0\.0\.1)(:\d+)?',
         r'file://', r'[a-z]+-desktop://.*|foxglove://.*'), live=False,
        doc='regular expressions of the web origins whose pages may listen; programs that are no '
        'browser have none and always may')

    def __post_init__(self):
        check(self)
        for pattern in self.topics + self.origins:
            try:
                re.compile(pattern)
            except re.error as error:
                raise ValueError(f'{pattern!r} is not a regular expression: {error}') from None

    def allows(self, origin):
        """Return whether pages of a web origin may listen; None has no page."""
        return origin is None or any(re.fullmatch(p, origin) for p in self.origins)


class BridgeNode(StageNode):
    """Offer topics to Foxglove."""

    settings_classes = (Bridging,)

    def __init__(self, **kwargs):
        super().__init__('bridge', **kwargs)
        self._channels, self._heard, self._refused = {}, {}, set()
        self._losses, self._silences, self._counted, self._quiet = {}, {}, {}, set()
        self._server = self._look = self._door = None
        self.sent = self.refused = 0

    def configure(self, settings):
        """Open the WebSocket and look for topics."""
        try:
            import foxglove
        except ImportError:
            raise ValueError('the bridge needs the Foxglove SDK: pip install foxglove-sdk') \
                from None
        self._foxglove, self._room = foxglove, foxglove.Context()
        self._server = self._start_server()
        try:
            self._door = FrontDoor(HOST, settings.port, (self._inner, self._server.port),
                                   settings.allows, self._turned_away)
        except OSError as error:
            raise OSError(f'port {settings.port} of {HOST} cannot be opened ({error}); give '
                          'another port, or 0 for a free one') from None
        self.sent = self.refused = 0
        self._looked = time.monotonic()
        self._look = self.every(LOOK_S, self._follow)
        self.get_logger().info(f'open in Foxglove: ws://{HOST}:{self._door.port}')

    def _start_server(self):
        """
        Start the server behind the door, at an address of the loopback that no page can guess.

        Where a system has 127.0.0.1 alone, only the port is unknown.
        """
        for inner in (f'127.{random.randint(1, 254)}.{random.randint(1, 254)}.'
                      f'{random.randint(1, 254)}', HOST):
            try:
                self._inner = inner
                return self._foxglove.start_server(name='ssi_ros', host=inner, port=0,
                                                   context=self._room)
            except RuntimeError as error:
                reason = error
        raise OSError(f'the WebSocket cannot be opened ({reason})')

    def _turned_away(self, origin):
        self.refused += 1
        self.get_logger().warning(
            f'a page of {shown(origin)[:100]} was turned away; the parameter origins says whose '
            'pages may listen', throttle_duration_sec=10.0)

    def cleanup(self):
        """Close the WebSocket."""
        if self._door is not None:
            self._door.close()
        if self._look is not None:
            self.destroy_timer(self._look)
        for subscription in self._heard.values():
            self.destroy_subscription(subscription)
        if self._server is not None:
            self._server.stop()
        self._channels, self._heard, self._quiet = {}, {}, set()
        self._server = self._look = self._door = None

    def _follow(self):
        """Offer new topics; subscribe to those that somebody looks at, and to no others."""
        for topic, types in self.get_topic_names_and_types():
            if topic not in self._channels and topic not in self._refused and any(
                    re.fullmatch(p, topic) for p in self.settings[0].topics):
                self._offer(topic, types)
        for topic, (channel, type_name) in self._channels.items():
            wanted = channel.has_sinks()
            if wanted and topic not in self._heard:
                self._hear(topic, channel, type_name)
            elif not wanted and topic in self._heard:
                self.destroy_subscription(self._heard.pop(topic))
        self._report_silence()

    def _report_silence(self):
        """Say once which topics that came steadily have stopped, and once that they are back."""
        now = time.monotonic()
        passed_s, self._looked = now - self._looked, now
        for topic in self._heard:
            received, before = self._losses[topic].received, self._counted[topic]
            self._silences[topic].look(passed_s, received > before)
            self._counted[topic] = received
        quiet = {t for t in self._heard if self._silences[t].silent and self._silences[t].regular}
        if new := sorted(quiet - self._quiet):
            self.get_logger().warning(f'no message any more of {", ".join(new)}')
        if back := sorted((self._quiet - quiet) & self._heard.keys()):
            self.get_logger().info(f'messages again of {", ".join(back)}')
        self._quiet = quiet

    def _offer(self, topic, types):
        try:
            if len(types) > 1:
                raise ValueError(f'its publishers disagree on the type: {", ".join(types)}')
            message_class(types[0])
            schema = self._foxglove.Schema(name=types[0], encoding='ros2msg',
                                           data=definition_of(types[0]).encode())
        except ValueError as error:
            self._refused.add(topic)
            self.get_logger().warning(f'{topic} is not offered: {error}')
            return
        self._channels[topic] = (self._foxglove.Channel(
            topic, schema=schema, message_encoding='cdr', context=self._room), types[0])

    def _hear(self, topic, channel, type_name):
        offers = self.get_publishers_info_by_topic(topic)
        if not offers:
            return

        losses = self._losses[topic] = Losses()
        self._silences[topic], self._counted[topic] = Silence(), 0

        def send(raw, number):
            losses.take(number)
            channel.log(raw, log_time=time.time_ns())
            self.sent += 1
        self._heard[topic] = self.create_subscription(
            message_class(type_name), topic, with_number(send),
            adapted_qos([o.qos_profile for o in offers], DEPTH), raw=True)

    def health(self):
        """Tell where it listens and what has gone through."""
        text = f'ws://{HOST}:{self._door.port}: {len(self._heard)} of {len(self._channels)} ' \
               'topics are looked at'
        lost = {t: self._losses[t].lost for t in self._heard if self._losses[t].lost}
        if lost:
            text += f'; {sum(lost.values())} messages lost on the way of {", ".join(sorted(lost))}'
        if quiet := sorted(self._quiet):
            idle_s = max(self._silences[t].idle_s for t in quiet)
            text += f'; no message for {idle_s:.0f} s of {", ".join(quiet)}, which came steadily'
        return [status(f'{self.get_name()}: websocket', 'warn' if lost or quiet else 'ok', text,
                       port=self._door.port,
                       topics=len(self._channels), heard=len(self._heard), sent=self.sent,
                       lost=sum(lost.values()), silent=', '.join(quiet), refused=self.refused)]


def main(args=None):
    """Run the node until SIGINT or SIGTERM."""
    return run(BridgeNode, args)


if __name__ == '__main__':
    raise SystemExit(main())
