"""
Find topics on which several publishers send at once, by the numbers of their messages.

Every publisher numbers its messages 1, 2, 3, ...; a message does not say which publisher sent it.
A number that is not above the last one comes from another publisher: once after a restart, again
and again where two send. The graph alone cannot tell: a publisher that was killed stays in it.
"""
from collections import Counter, deque
import time

from ssi_ros.ros.arrivals import RECENT
from ssi_ros.ros.twins import SHARED

BACKS = 3               # steps back within RECENT seconds that no restart explains
# topics on which many publish, by design
MANY = (*SHARED, '/tf', '/tf_static')


class Senders:
    """Whether several publishers send on one topic now; `take` the number of every message."""

    def __init__(self, clock=time.monotonic):
        self._newest, self._clock, self._backs = None, clock, deque(maxlen=BACKS)

    def take(self, number):
        """Take the number of a message, None where the middleware gives none."""
        if number is None:
            return
        if self._newest is not None and number <= self._newest:
            self._backs.append(self._clock())
        self._newest = number

    @property
    def mixed(self):
        """Whether the numbers have stepped back so often that it was no restart."""
        return len(self._backs) == BACKS and self._clock() < self._backs[0] + RECENT


class Mixing:
    """The topics of a node that several publishers share, and the samples left out for it."""

    def __init__(self, node, topics):
        """Begin with `topics`, a dict of topics to their names on the graph."""
        self._node, self._topics = node, topics
        self.begin()

    def begin(self):
        """Forget all."""
        self.senders = {t: Senders() for t in self._topics}
        self.now, self.left_out = set(), Counter()

    def look(self, pending):
        """Drop what waits of such topics, say who begins and ends; return whether one began."""
        mixed = {t for t, senders in self.senders.items() if senders.mixed}
        new, ended = sorted(mixed - self.now), sorted(self.now - mixed)
        self.now = mixed
        if new:
            self._node.get_logger().error(
                f'{self._words(new)}; their samples are left out and the window begins anew')
        if ended:
            self._node.get_logger().info(f'one publisher again of {", ".join(ended)}')
        for topic in mixed:
            self.left_out[topic] += len(pending[topic])
            pending[topic].clear()
        return bool(new)

    def _words(self, topics):
        return '; '.join(mixed_words(self._topics[t], self._node.count_publishers(self._topics[t]))
                         for t in sorted(topics))

    def words(self):
        """Return why nothing can be said while several publishers send; else empty."""
        return self._words(self.now)


def mixed_words(topic, publishers):
    """Return the words for a topic on which several publishers send at once."""
    return (f'{publishers if publishers > 1 else "several"} publishers send on {topic} at once: '
            'end one, or remap it')
