"""
Recorder node: raw messages of any topics to an MCAP bag that survives a crash.

A callback appends to the writer's buffer (about 1 us); the writer's own thread compresses, flushes
every half second and syncs to the disk. Topics that appear later are joined as they come, with
the quality of service that their publishers offer, so that a best-effort sensor and a latched
status are both heard.
"""
from dataclasses import dataclass
import re
import threading
import time

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from ssi_ros.bag import BagWriter
from ssi_ros.quantity import quantity
from ssi_ros.ros.arrivals import Silence
from ssi_ros.ros.channels import message_class
from ssi_ros.ros.losses import Losses, with_number
from ssi_ros.ros.messages import status
from ssi_ros.ros.mixed import MANY, Senders
from ssi_ros.ros.node import run, StageNode

LOOK_S = 0.25             # how often new topics are looked for
WORST = 6                 # topics that are named in one sentence
NEVER = {'/clock', '/rosout', '/parameter_events'}


@dataclass(frozen=True)
class Recording:
    """What to record and where to."""

    bag: str = quantity('', doc='folder of the new bag; empty = recording_<date>_<time>',
                        live=False)
    topics: tuple = quantity(('.*',), live=False,
                             doc='regular expressions of the topic names to record')
    exclude: tuple = quantity(('.*/transition_event',), live=False,
                              doc='regular expressions of the topic names to leave out')
    compression: str = quantity('zstd', doc="'zstd', 'lz4' or 'none'", live=False)
    flush_s: float = quantity(0.5, unit='s', low=0.01, high=60.0, live=False,
                              doc='a crash loses at most so much')
    split_bytes: int = quantity(0, unit='B', low=0, live=False,
                                doc='begin a new file at this size, 0 = never')
    split_s: float = quantity(0.0, unit='s', low=0.0, high=1e6, live=False,
                              doc='begin a new file after this time, 0 = never')
    queue_depth: int = quantity(5000, low=1, high=1_000_000, live=False,
                                doc='messages a topic that wait while the process is busy')

    def __post_init__(self):
        for pattern in (*self.topics, *self.exclude):
            try:
                re.compile(pattern)
            except re.error as error:
                raise ValueError(f'{pattern!r} is not a regular expression: {error}') from None

    def wants(self, topic):
        """Return whether a topic is to be recorded."""
        if topic in NEVER and topic not in self.topics:
            return False
        return (any(re.fullmatch(p, topic) for p in self.topics)
                and not any(re.fullmatch(p, topic) for p in self.exclude))


class RecorderNode(StageNode):
    """Record topics to a bag."""

    settings_classes = (Recording,)

    def __init__(self, **kwargs):
        super().__init__('recorder', **kwargs)
        self._joined, self._look, self._bag, self._refused = {}, None, None, set()
        self.written, self.failure, self._early = 0, '', []
        self._losses, self._silences, self._counted = {}, {}, {}

    def configure(self, settings):
        """Open the bag and look for topics."""
        name = settings.bag or time.strftime('recording_%Y-%m-%d_%H-%M-%S')
        self._bag = BagWriter(name, split_bytes=settings.split_bytes, split_s=settings.split_s,
                              compression=settings.compression, flush_s=settings.flush_s,
                              patient=True)
        self.written, self.failure, self._early = 0, '', []
        self._losses, self._silences, self._counted = {}, {}, {}
        self._senders, self._mixed = {}, {}
        self._say_at, self._full, self._quiet = 1, '', set()
        self._looked = time.monotonic()
        self._sim_time = self.get_parameter('use_sim_time').value
        self._gate = threading.Event()
        self._look = self.every(LOOK_S, self._look_round)
        self.get_logger().info(f'recording to {name}')

    def activate(self):
        """Let the messages in."""
        self._gate.set()

    def deactivate(self):
        """Keep the messages out."""
        if self._bag is not None:
            self._gate.clear()

    def cleanup(self):
        """Close the bag."""
        if self._look is not None:
            self.destroy_timer(self._look)
        for subscription, _ in self._joined.values():
            self.destroy_subscription(subscription)
        if self._bag is not None:
            self._close()
        self._joined, self._look, self._bag = {}, None, None

    def _close(self):
        if self._early:
            self.get_logger().warning(f'/clock never came: {len(self._early)} messages are '
                                      'stamped by the time of this machine')
            early, self._early = self._early, []
            for topic, raw in early:
                self._write(topic, raw, time.time_ns())
        try:
            self._bag.close()
        except OSError as error:
            self._fail(error)
        quiet = sorted(self._quiet)
        ended = (f'{len(quiet)} topics had stopped, the longest '
                 f'{max(self._silences[t].idle_s for t in quiet):.0f} s before the end: '
                 + ', '.join(quiet[:WORST]) + (', ...' if len(quiet) > WORST else '')
                 if quiet else '')
        self.get_logger().info('; '.join(filter(None, (
            f'{self._bag.kept} messages in {self._bag.folder}', self._missing_words(), ended))))

    def _fail(self, error):
        """Stop recording, once and for all: what was flushed is kept."""
        self.failure, self.exit_code = str(error.strerror or error), 1
        self._gate.clear()
        self.get_logger().error(f'recording stopped: {self.failure}')

    def _look_round(self):
        """Join topics that are new, and see which have fallen silent or lost messages."""
        now = time.monotonic()
        passed_s, self._looked = now - self._looked, now
        for topic, losses in self._losses.items():
            came = losses.received > self._counted[topic]
            self._counted[topic] = losses.received
            if self._gate.is_set():
                self._silences[topic].look(passed_s, came)
        try:
            if not self.failure:
                self._join_new_topics()
                self._bag.flush_if_due()
        except OSError as error:
            self._fail(error)
        self._say_what_is_missing()
        self._say_what_mixes()

    def _say_what_mixes(self):
        """Say once of a topic that several publishers send on it, and note it in the bag."""
        for topic, senders in self._senders.items():
            if topic not in self._mixed and senders.mixed:
                self._mixed[topic] = max(2, self.count_publishers(topic))
                self._bag.note('mixed_publishers', ', '.join(sorted(self._mixed)))
                self.get_logger().warning(f'{self._mixed_words([topic])} at once: the bag holds '
                                          'their messages mixed')

    def _mixed_words(self, topics):
        """Return who sends on topics of which several publishers have sent; empty for none."""
        return '; '.join(f'{self._mixed[t]} publishers send on {t}'
                         for t in sorted(topics)[:WORST])

    def _say_what_is_missing(self):
        """Say losses when they have doubled, and once that the disk is full or has room again."""
        lost = sum(x.lost for x in self._losses.values())
        if lost >= self._say_at:
            self._say_at = 2 * lost
            self.get_logger().warning(f'{self._lost_words()}; raise queue_depth, record fewer '
                                      'topics, or let this process run before others')
        if bool(self._bag.full) != bool(self._full):
            self._full, self.exit_code = self._bag.full, 1
            self.get_logger().error(
                f'{self._bag.folder}: {self._full}: messages are left out until there is room'
                if self._full else f'{self._bag.folder}: there is room again; {self._bag.dropped} '
                'messages were left out in all')
        quiet = {t for t in self._silences if self._is_silent(t)}
        if new := sorted(quiet - self._quiet):
            self.get_logger().warning(f'no message any more of {", ".join(new)}')
        if back := sorted(self._quiet - quiet):
            self.get_logger().info(f'messages again of {", ".join(back)}')
        self._quiet = quiet

    def _is_silent(self, topic):
        """Return whether a topic that came steadily has stopped."""
        return self._silences[topic].silent and self._silences[topic].regular

    def _lost_words(self):
        """Return how many messages were lost on the way, and of which topics; empty for none."""
        lost = {t: x.lost for t, x in self._losses.items() if x.lost}
        total = sum(lost.values())
        if not total:
            return ''
        share = total / (total + sum(x.received for x in self._losses.values()))
        worst = sorted(lost, key=lambda t: -lost[t])
        return (f'{total} messages lost on the way ({100 * share:.2g} %: '
                + ', '.join(f'{t} {lost[t]}' for t in worst[:WORST])
                + (f' and {len(worst) - WORST} topics more)' if len(worst) > WORST else ')'))

    def _missing_words(self):
        """Return what the bag lacks or mixes, in words; empty where it does neither."""
        dropped = (f'{self._bag.dropped} messages left out while the disk was full'
                   if self._bag.dropped else '')
        return '; '.join(filter(None, (
            self._lost_words(), dropped, self._mixed_words(self._mixed))))

    def _join_new_topics(self):
        for topic, types in self.get_topic_names_and_types():
            if topic in self._joined or not self.settings[0].wants(topic):
                continue
            offers = self.get_publishers_info_by_topic(topic)
            if not offers or topic in self._refused:
                continue
            try:
                self._join(topic, types, offers)
            except ValueError as error:
                self._refused.add(topic)
                self.get_logger().warning(f'{topic} is not recorded: {error}')

    def _join(self, topic, types, offers):
        if len(types) > 1:
            raise ValueError(f'its publishers disagree on the type: {", ".join(types)}')
        self._bag.add_topic(topic, types[0], [offered_qos(o.qos_profile) for o in offers])
        qos = adapted_qos([o.qos_profile for o in offers], self.settings[0].queue_depth)
        write, gate, now = self._write, self._gate, self._now
        losses = self._losses[topic] = Losses()
        senders = Senders()
        if topic not in MANY:
            self._senders[topic] = senders
        self._silences[topic], self._counted[topic] = Silence(), 0

        def collect(raw, number):
            if gate.is_set():
                losses.take(number)
                senders.take(number)
                write(topic, raw, now())
        self._joined[topic] = (self.create_subscription(
            message_class(types[0]), topic, with_number(collect), qos, raw=True), types[0])
        self.get_logger().info(f'joined {topic} [{types[0]}]')

    def _now(self):
        """Return the time to log [ns], 0 while simulated time has not begun."""
        if self._sim_time:
            return self.get_clock().now().nanoseconds
        return time.time_ns()

    def _write(self, topic, raw, log_ns):
        """
        Write a message.

        Log and publish time are both the time of receipt. What comes before simulated time begins
        is stamped by its first moment: in 1970 no player would find it.
        """
        if log_ns == 0:
            self._early.append((topic, raw))
            return
        early, self._early = self._early, []
        try:
            for before in early:
                self._bag.write(*before, log_ns, log_ns)
            self._bag.write(topic, raw, log_ns, log_ns)
        except OSError as error:
            self._fail(error)
        else:
            self.written += 1 + len(early)

    def health(self):
        """Tell what has been written."""
        n = self.written - self._bag.dropped
        level, text = 'ok', f'{n} messages of {len(self._joined)} topics'
        quiet = sorted(self._quiet)
        missing = self._missing_words()
        if self.failure:
            level, text = 'error', f'stopped: {self.failure}'
        elif self._bag.full:
            level, text = 'error', (f'{self._bag.full}: {self._bag.dropped} messages left out, '
                                    f'{self._bag.kept} are in {self._bag.folder}')
        elif quiet:
            brought = sum(self._losses[t].received for t in quiet)
            longest = max(self._silences[t].idle_s for t in quiet)
            level = 'error' if brought > 0.5 * self.written else 'warn'
            text = (f'no message for {longest:.0f} s of {len(quiet)} topics that came steadily: '
                    + ', '.join(quiet[:WORST]) + (', ...' if len(quiet) > WORST else '')
                    + f'; {text}' + (f'; {missing}' if missing else ''))
        elif missing:
            # left out is a hole in the bag, also when there is room again
            level, text = 'error' if self._bag.dropped else 'warn', f'{text}; {missing}'
        elif not self.written:
            level, text = 'warn', 'no message yet: ' + (
                'no topic matches' if not self._joined else 'the topics are silent')
        return [status(f'{self.get_name()}: bag', level, text, bag=str(self._bag.folder),
                       topics=len(self._joined), written=self.written, kept=self._bag.kept,
                       lost=sum(x.lost for x in self._losses.values()),
                       unnumbered=sum(x.unnumbered for x in self._losses.values()),
                       dropped=self._bag.dropped, silent=', '.join(quiet),
                       mixed=', '.join(sorted(self._mixed)))]


def offered_qos(profile):
    """Return an offered quality of service as rosbag2 writes it, a mapping of words."""
    def ns(duration):
        seconds, rest = divmod(duration.nanoseconds, 1_000_000_000)
        return {'sec': seconds, 'nsec': rest}
    return {
        'history': profile.history.name.lower(), 'depth': profile.depth,
        'reliability': profile.reliability.name.lower(),
        'durability': profile.durability.name.lower(),
        'deadline': ns(profile.deadline), 'lifespan': ns(profile.lifespan),
        'liveliness': profile.liveliness.name.lower(),
        'liveliness_lease_duration': ns(profile.liveliness_lease_duration),
        'avoid_ros_namespace_conventions': profile.avoid_ros_namespace_conventions}


def adapted_qos(offers, depth):
    """Return the strictest quality of service that every offer satisfies."""
    reliable = all(o.reliability == ReliabilityPolicy.RELIABLE for o in offers)
    latched = all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE))


def main(args=None):
    """Run the node until SIGINT or SIGTERM."""
    return run(RecorderNode, args)


if __name__ == '__main__':
    raise SystemExit(main())
