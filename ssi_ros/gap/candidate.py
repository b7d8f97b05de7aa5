"""Candidates: effects at a place, with the numbers that a fit may move and their coordinates."""
from dataclasses import dataclass, replace
import math

from ssi_ros.effects.base import is_log
from ssi_ros.gap.selection.evidence import RangePrior, SizePrior
from ssi_ros.gap.selection.thresholds import SELECTION as LIMITS


@dataclass(frozen=True)
class Candidate:
    """One effect or several at once, at definite places, at definite values."""

    effects: tuple = ()
    equivalents = ()        # with geometry no two effects have one form by construction
    approximation = 0.0     # share of the gap that its form may leave
    exact = False           # whether no error of its law is in question
    odds_in_time = 0.0      # log odds of what no mean of spectra shows

    @property
    def key(self):
        """Return what two candidates have in common that compete with each other."""
        return tuple(sorted(self.names))

    @property
    def kinds(self):
        """Return what two candidates have in common that differ by their numbers alone."""
        return tuple(sorted(e.kind() for e in self.effects))

    @property
    def channels(self):
        """Names of the channels that the effects act on."""
        return tuple(e.channel for e in self.effects if hasattr(e, 'channel'))

    @property
    def names(self):
        """Names of the effects."""
        return tuple(e.answer for e in self.effects)

    @property
    def nonlinear(self):
        """Whether the expected spectrum is not exact, of any of the effects."""
        return any(e.nonlinear for e in self.effects)

    def numbers(self):
        """Yield (index of the effect, field) of every number that a fit of spectra may move."""
        for i, e in enumerate(self.effects):
            if not e.spectral:
                continue
            for f in e.numbers():
                if f.name in e.starts:
                    yield i, f

    def point(self):
        """Return the coordinates of the numbers: logarithms of the positive ones."""
        return [to_coordinate(f, getattr(self.effects[i], f.name)) for i, f in self.numbers()]

    def is_passed(self, begin, end):
        """Return whether a fit from one candidate to another came past this, in every number."""
        here = self.point()
        return bool(here) and self.kinds == begin.kinds and all(
            min(ends) <= x <= max(ends) for x, *ends in zip(here, begin.point(), end.point()))

    def moved(self, point):
        """Return the candidate at other coordinates, kept inside the declared ranges."""
        effects = list(self.effects)
        for (i, f), x in zip(self.numbers(), point):
            low, high = f.metadata['low'], f.metadata['high']
            value = min(max(from_coordinate(f, x), low), high)
            effects[i] = replace(effects[i], **{f.name: value})
        return Candidate(tuple(effects))

    def with_one_more(self, effect):
        """Return the candidate with one effect more."""
        return Candidate(self.effects + (effect,))


def is_approximate(candidate):
    """Return whether the expected spectrum of a candidate leaves some of its own records."""
    return bool(candidate.approximation or candidate.nonlinear)


def to_coordinate(f, value):
    """Return the coordinate that a fit moves for a value of a quantity."""
    return math.log(max(value, 1e-300)) if is_log(f) else value


def from_coordinate(f, x):
    """Return the value of a coordinate."""
    return math.exp(min(x, 700.0)) if is_log(f) else x


def priors_of(candidate):
    """Return the prior of every coordinate of a candidate, eq. (112)."""
    # The prior of a size is even in the logarithm of its deviations; that of a place even in the
    # range that its starting values span.
    found, decades = [], LIMITS['size_range'].value
    for (i, f), x in zip(candidate.numbers(), candidate.point()):
        e = candidate.effects[i]
        starts = sorted(e.starts[f.name])
        if f.name == e.size:
            found.append(SizePrior(None if is_log(f) else x - f.default, e.one_sided(), e.power))
        elif e.hinge or (is_log(f) and len(starts) == 1):
            # the stiffness of a hinge is the same quantity, whatever its law
            found.append(RangePrior(decades))
        elif e.law_of and f.name in e.together:     # anything that it may be
            found.append(RangePrior(f.metadata['high'] - f.metadata['low']))
        elif len(starts) == 1:
            found.append(RangePrior(2 * max(abs(starts[0]), 1e-12)))
        else:
            found.append(RangePrior(
                2 * (to_coordinate(f, starts[-1]) - to_coordinate(f, starts[0]))))
    return tuple(found)
