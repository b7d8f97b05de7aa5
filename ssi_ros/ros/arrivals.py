"""What came in the last seconds, and what has fallen silent; looked at a few times a second."""
from collections import deque
from dataclasses import dataclass, fields
import statistics

from ssi_ros.identify.stamps import ChannelCount

SILENT_S = 2.0          # without a message, of what came more often than that
TIMES = 4.0             # and so many times the usual pause between messages
PAUSES = 20             # of which the usual one is the median
ENOUGH = 8              # pauses that make a topic a steady one
LOOKED_S = 0.5          # a look so long after the one before was late itself: nobody listened
RECENT = 10             # seconds that levels and losses speak of


class Silence:
    """Whether a topic has fallen silent; `look` at it several times a second."""

    def __init__(self):
        self.idle_s, self.heard, self._pauses = 0.0, False, deque(maxlen=PAUSES)

    def look(self, passed_s, came):
        """Take whether a message came since the last look, `passed_s` ago [s]."""
        idle_s = self.idle_s + min(passed_s, LOOKED_S)
        if came and self.heard:
            self._pauses.append(idle_s)
        self.heard = self.heard or came
        self.idle_s = 0.0 if came else idle_s

    @property
    def silent(self):
        """Whether messages came once, and do not any more."""
        usual = statistics.median(self._pauses) if self._pauses else 0.0
        return self.heard and self.idle_s > max(SILENT_S, TIMES * usual)

    @property
    def regular(self):
        """Whether messages came often enough to expect more."""
        return len(self._pauses) >= ENOUGH


@dataclass(frozen=True)
class ChannelState:
    """One channel at this moment; `lately` counts the last RECENT seconds alone."""

    source: object
    publishers: int
    other_types: tuple
    count: ChannelCount
    lately: ChannelCount
    silent_s: float             # 0 while samples come
    off_rate: bool
    grid_rate_hz: float
    up_s: float
    runs_away: bool = False     # its clock from that of the first channel
    offset_s: float = 0.0       # sampled so much later than the first channel
    mixed: bool = False         # several publishers send at once
    left_out: int = 0           # samples of that time

    @property
    def lost(self):
        """Return samples of the last seconds that were lost or could not be used."""
        c = self.lately
        return c.missing + c.late + c.not_finite + c.bad_stamps

    @property
    def doubled(self):
        """Return the share of samples of the last seconds that have the stamp of another one."""
        return self.lately.duplicates / max(1, self.lately.received)

    @property
    def lost_share(self):
        """Return the share of them, 0 to 1."""
        c = self.lately
        return min(1.0, self.lost / max(1, c.received + c.missing))


class Lately:
    """Counts of the last RECENT seconds; `keep` the counts once a second."""

    def __init__(self):
        self._kept = deque(maxlen=RECENT + 1)

    def keep(self, counts):
        """Remember the counts of all channels as they are now."""
        self._kept.append(tuple(counts))

    def since(self, channel, count):
        """Return what was counted since the oldest that is remembered."""
        if not self._kept:
            return ChannelCount()
        old = self._kept[0][channel]
        numbers = {f.name: getattr(count, f.name) - getattr(old, f.name) for f in fields(count)
                   if isinstance(f.default, int)}
        return ChannelCount(**numbers, rate_hz=count.rate_hz)
