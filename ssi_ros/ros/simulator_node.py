"""
Simulator node: the accelerometers of a flexible spacecraft, in real time or faster.

Every sample carries the stamp of an exact grid. With `speed` other than 1 the node is the clock
of the simulation and publishes /clock, so that the others run with use_sim_time. Effects of the
library are injected by the parameter `effects` or by the list of that name in `config`; the
samples are those of `ssi_ros simulate` for the same seed.
"""
from dataclasses import dataclass
import math
import time

from geometry_msgs.msg import AccelStamped, WrenchStamped
import numpy as np
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from ssi_ros.bag import encode_accel
from ssi_ros.bag.names import check_topic
from ssi_ros.effects import load_configuration, parse_effect
from ssi_ros.effects.stream import stream_setup
from ssi_ros.quantity import quantity
from ssi_ros.ros.messages import status, time_of
from ssi_ros.ros.node import Audience, run, StageNode
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

TICK_S = 0.01             # how often due samples are published
BLOCK_S = 1.0             # how much is simulated at once
CATCH_UP_S = 0.25         # how much may be published at once after the machine was busy
LEAST_BEHIND_S = 0.1      # a delay that nobody would notice is not worth a line
RELIABLE_S = 10.0        # how long a reader may stand still before samples that it lacks are lost


@dataclass(frozen=True)
class Simulation:
    """What the simulator can be told."""

    config: str = quantity('', doc='spacecraft YAML; empty = the one that comes with the package',
                           live=False)
    effects: tuple = quantity(
        ('',), doc='effects of `ssi_ros effects` to inject, entries name:param=value,...; those '
        'of config come first; an empty entry is none', live=False)
    seed: int = quantity(1, low=0, high=2 ** 31 - 1, doc='seed of all random numbers', live=False)
    speed: float = quantity(1.0, low=0.0, high=1e4,
                            doc='simulated seconds a second; 0 = as fast as the machine allows')
    duration_s: float = quantity(0.0, unit='s', low=0.0, high=1e9, live=False,
                                 doc='length of the simulation, 0 = endless')
    at_rest: bool = quantity(False, live=False,
                             doc='start at rest in place of the stationary state')
    start_s: float = quantity(-1.0, unit='s', low=-1.0, high=2147483647.0, live=False,
                              doc='stamp of the first sample, -1 = now, to the millisecond')
    publish_clock: bool = quantity(False, live=False,
                                   doc='publish /clock also at speed 1')
    batch: bool = quantity(False, live=False,
                           doc='publish accelerometer/batch too: blocks of rows in one message')
    record_input: bool = quantity(
        False, live=False, doc='publish what drives the model too, each input that has a level: '
        'topics /input/NAME, WrenchStamped, for `inputs` of the gap node')
    reliable: bool = quantity(False, live=False,
                              doc='publish reliable in place of sensor-data quality of service')
    wait_for_subscribers: int = quantity(
        0, low=0, high=100, live=False,
        doc='begin when every accelerometer topic has so many subscribers')
    namespace: str = quantity('accelerometer', doc='prefix of the topics', live=False)


class SimulatorNode(StageNode):
    """Publish simulated accelerations."""

    settings_classes = (Simulation,)

    def __init__(self, **kwargs):
        super().__init__('simulator', **kwargs)
        self._made, self._timer, self._clock_publisher = [], None, None

    def configure(self, settings):
        """Build the spacecraft and advertise its sensors."""
        spacecraft, effects = load_configuration(settings.config or None)
        self._effects = effects + tuple(parse_effect(e) for e in settings.effects if e)
        self._names, self._rate_hz, self._blocks = stream_setup(
            spacecraft, self._effects, settings.seed, block_s=BLOCK_S, at_rest=settings.at_rest,
            duration_s=settings.duration_s or math.inf)
        for effect in self._effects:
            self.get_logger().info(f'effect {effect.text()}')
        hold_s = RELIABLE_S if settings.reliable else 2.0       # on the wall
        depth = max(5, int(hold_s * self._rate_hz * max(1.0, settings.speed)))
        qos = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=(
            ReliabilityPolicy.RELIABLE if settings.reliable else ReliabilityPolicy.BEST_EFFORT))
        for name in self._names:
            check_topic(f'/{settings.namespace.lstrip("/")}/{name}')
        if settings.start_s + settings.duration_s >= 2 ** 31:
            raise ValueError(f'start_s={settings.start_s:g} and duration_s='
                             f'{settings.duration_s:g} go beyond 2147483647 s, the year 2038, '
                             'where ROS times end')
        self._sensors = [self._advertise(AccelStamped, f'{settings.namespace}/{name}', qos)
                         for name in self._names]
        self._batch = (self._advertise(Float64MultiArray, f'{settings.namespace}/batch', qos)
                       if settings.batch else None)
        self._drawn = None
        if settings.record_input:
            # half a second, which a node without them saves at its start
            from ssi_ros.ros.drawn_inputs import DrawnInputs
            self._drawn = DrawnInputs(spacecraft, self._effects, settings)
            self._drawn.publishers = [self._advertise(WrenchStamped, topic, qos)
                                      for topic, _ in self._drawn.channels]
            self.get_logger().info('inputs ' + ' '.join(map(':'.join, self._drawn.channels)))
        if settings.publish_clock or settings.speed != 1.0:
            self._clock_publisher = self._advertise(Clock, '/clock', 10)
        self._audience = Audience(self._sensors, settings.wait_for_subscribers)
        self._block, self._at, self._start_ns = None, 0, None
        self.sent, self.behind_s = 0, 0.0

    def _advertise(self, message_class, topic, qos):
        publisher = self.create_publisher(message_class, topic, qos)
        self._made.append(publisher)
        return publisher

    def activate(self):
        """Begin, or go on where it was paused."""
        settings = self.settings[0]
        self._pace = None
        self._timer = self.every(TICK_S if settings.speed > 0.0 else 0.001, self._tick)

    def announcement(self):
        """Say what is published, and whether it waits for readers."""
        s = self.settings[0]
        waits = f', when {s.wait_for_subscribers} subscribers are there' * bool(
            s.wait_for_subscribers)
        return (f'publishing {len(self._sensors)} accelerometers at {self._rate_hz:g} Hz, speed '
                f'{s.speed:g}, seed {s.seed}, '
                + (f'for {s.duration_s:g} s' if s.duration_s else 'until it is stopped') + waits)

    def deactivate(self):
        """Pause."""
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None

    def cleanup(self):
        """Release all that `configure` created."""
        for publisher in self._made:
            self.destroy_publisher(publisher)
        self._made, self._clock_publisher, self._blocks = [], None, None

    def settings_changed(self, settings):
        """Take another speed."""
        if settings.speed != 1.0 and self._clock_publisher is None:
            raise ValueError(f'speed={settings.speed:g} needs /clock; start the node with '
                             'publish_clock:=true or a speed other than 1')
        self._pace = None

    def _next_block(self):
        self._block = next(self._blocks)
        if self._start_ns is None:        # not before: nothing is due while the first is made
            start_s = self.settings[0].start_s
            self._start_ns = (round(start_s * 1e9) if start_s >= 0.0
                              else time.time_ns() // 1_000_000 * 1_000_000)
        stamps = self._start_ns + self._block.stamps_ns()
        self._encoded = [encode_accel(stamps, self._block.values[:, i], name)
                         for i, name in enumerate(self._names)]
        if self._drawn is not None:
            self._drawn.draw(len(stamps))
        self._stamps, self._there = stamps, ~np.isnan(self._block.values).any(axis=1)
        self._at = 0

    def _due(self, settings):
        """Return how many samples are due now."""
        if settings.speed == 0.0:
            return len(self._block.values)
        now = time.monotonic()
        if self._pace is None:
            self._pace = (now, self.sent)
        began, sent = self._pace
        due = sent + 1 + int((now - began) * settings.speed * self._rate_hz) - self.sent
        most = max(1, int(CATCH_UP_S * settings.speed * self._rate_hz))
        if due > most:            # the machine is too slow: keep every sample, lose the pace
            self.behind_s += (due - most) / (settings.speed * self._rate_hz)
            self._pace = (now, self.sent + most - 1)
            if self.behind_s >= LEAST_BEHIND_S:
                self.get_logger().warning(
                    f'{self.behind_s:.1f} s behind the pace of speed={settings.speed:g}; no '
                    'sample is left out, lower speed to keep the pace', throttle_duration_sec=5.0)
        return min(due, most)

    def _tick(self):
        settings = self.settings[0]
        if self.sent == 0 and not self._audience.ready():
            return
        if self._start_ns is None:        # not before: the wait for readers is not simulated
            self._next_block()
        due = self._due(settings)
        if settings.duration_s:
            due = min(due, round(settings.duration_s * self._rate_hz) - self.sent)
        if due > 0 and self._clock_publisher is not None:
            ahead = self._start_ns + round((self.sent + due - 1) * 1e9 / self._rate_hz)
            self._clock_publisher.publish(Clock(clock=time_of(ahead)))
        while due > 0:
            if self._at == len(self._block.values):
                self._next_block()
            n = min(due, len(self._block.values) - self._at)
            self._publish(n)
            due -= n
        if settings.duration_s and self.sent >= round(settings.duration_s * self._rate_hz):
            self.get_logger().info(f'{self.sent} samples a channel sent, '
                                   f'{settings.duration_s:g} s: done')
            self.deactivate()
            self.done.set()

    def _publish(self, n):
        for k in range(self._at, self._at + n):
            if self._there[k]:               # else the row was dropped
                for publisher, encoded in zip(self._sensors, self._encoded):
                    publisher.publish(encoded[k])
                if self._drawn is not None:
                    self._drawn.publish(k, int(self._stamps[k]))
        if self._batch is not None:
            rows = self._block.values[self._at:self._at + n]
            first = self._start_ns + int(self._block.stamps_ns()[self._at])
            self._batch.publish(batch_message(rows, self._names, first))
        self._at += n
        self.sent += n

    def health(self):
        """Tell how far the simulation is."""
        speed = self.settings[0].speed
        waiting = self._timer is not None and self.sent == 0 and not self._audience.ready()
        level = 'warn' if self.behind_s >= LEAST_BEHIND_S or waiting else 'ok'
        text = ('waiting for subscribers' if waiting else
                f'{self.sent / self._rate_hz:.1f} s simulated at speed {speed:g}')
        return [status(f'{self.get_name()}: samples', level, text, samples=self.sent,
                       rate_hz=float(self._rate_hz), speed=float(speed),
                       behind_s=float(self.behind_s), seed=self.settings[0].seed,
                       effects=' '.join(e.text() for e in self._effects))]


def batch_message(rows, names, first_ns):
    """Return rows (n, l) as one message; the labels name the channels and the first stamp."""
    n, width = rows.shape
    layout = MultiArrayLayout(dim=[
        MultiArrayDimension(label=f'first_stamp_ns={first_ns}', size=n, stride=n * width),
        MultiArrayDimension(label=','.join(names), size=width, stride=width)])
    message = Float64MultiArray(layout=layout)
    message.data.frombytes(rows.tobytes())
    return message


def main(args=None):
    """Run the node until SIGINT or SIGTERM, or to the end of `duration_s`."""
    return run(SimulatorNode, args)


if __name__ == '__main__':
    raise SystemExit(main())
