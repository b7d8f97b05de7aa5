"""
Bridge node: topics as they are to Foxglove, over a WebSocket of this machine alone.

Every topic is offered; a topic is subscribed to only while somebody looks at it, so an idle bridge
costs next to nothing. The CDR bytes go through untouched. Nobody can publish through it.
"""
from dataclasses import dataclass
import re
import time

from ssi_ros.bag import definition_of
from ssi_ros.quantity import check, quantity
from ssi_ros.ros.channels import message_class
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

    def __post_init__(self):
        check(self)
        for pattern in self.topics:
            try:
                re.compile(pattern)
            except re.error as error:
                raise ValueError(f'{pattern!r} is not a regular expression: {error}') from None


class BridgeNode(StageNode):
    """Offer topics to Foxglove."""

    settings_classes = (Bridging,)

    def __init__(self, **kwargs):
        super().__init__('bridge', **kwargs)
        self._channels, self._heard, self._refused = {}, {}, set()
        self._server = self._look = None
        self.sent = 0

    def configure(self, settings):
        """Open the WebSocket and look for topics."""
        try:
            import foxglove
        except ImportError:
            raise ValueError('the bridge needs the Foxglove SDK: pip install foxglove-sdk') \
                from None
        self._foxglove, self._room = foxglove, foxglove.Context()
        try:
            self._server = foxglove.start_server(name='ssi_ros', host=HOST, port=settings.port,
                                                 context=self._room)
        except RuntimeError as error:
            raise OSError(f'port {settings.port} of {HOST} cannot be opened ({error}); give '
                          'another port, or 0 for a free one') from None
        self.sent = 0
        self._look = self.every(LOOK_S, self._follow)
        self.get_logger().info(f'open in Foxglove: ws://{HOST}:{self._server.port}')

    def cleanup(self):
        """Close the WebSocket."""
        if self._look is not None:
            self.destroy_timer(self._look)
        for subscription in self._heard.values():
            self.destroy_subscription(subscription)
        if self._server is not None:
            self._server.stop()
        self._channels, self._heard, self._server, self._look = {}, {}, None, None

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

        def send(raw):
            channel.log(raw, log_time=time.time_ns())
            self.sent += 1
        self._heard[topic] = self.create_subscription(
            message_class(type_name), topic, send,
            adapted_qos([o.qos_profile for o in offers], DEPTH), raw=True)

    def health(self):
        """Tell where it listens and what has gone through."""
        text = f'ws://{HOST}:{self._server.port}: {len(self._heard)} of {len(self._channels)} ' \
               'topics are looked at'
        return [status(f'{self.get_name()}: websocket', 'ok', text, port=self._server.port,
                       topics=len(self._channels), heard=len(self._heard), sent=self.sent)]


def main(args=None):
    """Run the node until SIGINT or SIGTERM."""
    return run(BridgeNode, args)


if __name__ == '__main__':
    raise SystemExit(main())
