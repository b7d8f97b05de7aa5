"""
How many messages of a topic were lost on the way, by the numbers that its publishers give them.

Every publisher numbers its messages 1, 2, 3, ...; a message does not say which publisher sent it.
So each number continues the run that it follows, and what it skips there is lost.
"""
import inspect

RUNS = 8                # publishers of one topic that are kept apart, those that ended included


class Losses:
    """Count what is lost of one topic; `take` the number of every message."""

    def __init__(self):
        self.received, self.lost, self.unnumbered = 0, 0, 0
        self._newest, self._others = None, []       # the run of the last message; the other ones

    def take(self, number):
        """Take the number of a message, None where the middleware gives none."""
        self.received += 1
        if number is None:
            self.unnumbered += 1
        elif self._newest is not None and number == self._newest + 1:
            self._newest = number
        else:
            self._take_other(number)

    def _take_other(self, number):
        """Take a number that does not follow the last message's."""
        runs = [*self._others, self._newest] if self._newest is not None else self._others
        before = [n for n in runs if n < number]
        if before:
            newest = max(before)
            self.lost += number - newest - 1
            runs.remove(newest)
        # a publisher that is new; what it sent before the first that came is not known
        self._others, self._newest = runs[-(RUNS - 1):], number


def with_number(take):
    """
    Return a callback of a raw subscription that calls `take(raw, publication number or None)`.

    rclpy looks at the signature to find out whether a callback wants the MessageInfo; the events
    executor of Jazzy then gives both as one argument, the others as two.
    """
    def callback(raw, info=None):
        if info is None:
            raw, info = raw
        take(raw, info['publication_sequence_number'])
    either = inspect.Parameter.POSITIONAL_OR_KEYWORD
    callback.__signature__ = inspect.Signature(
        [inspect.Parameter(name, either) for name in ('raw', 'info')])
    return callback
