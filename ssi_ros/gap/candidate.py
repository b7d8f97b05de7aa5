"""Candidates: effects at a place, with the numbers that a fit may move and their coordinates."""
from dataclasses import dataclass, replace
from itertools import product
import math

from ssi_ros.effects.base import Effect, is_log


@dataclass(frozen=True)
class Candidate:
    """One effect or several at once, at definite places, at definite values."""

    effects: tuple = ()

    @property
    def names(self):
        """Names of the effects."""
        return tuple(e.name for e in self.effects)

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


def to_coordinate(f, value):
    """Return the coordinate that a fit moves for a value of a quantity."""
    return math.log(max(value, 1e-300)) if is_log(f) else value


def from_coordinate(f, x):
    """Return the value of a coordinate."""
    return math.exp(min(x, 700.0)) if is_log(f) else x


def places(cls, spacecraft):
    """Yield the words of an effect for every place on a spacecraft, as dicts."""
    choices = []
    for f in cls.words():
        if f.name == 'array':
            choices.append([a.name for a in spacecraft.arrays])
        else:
            names = [s.name for s in spacecraft.sensors]
            choices.append((['all'] if f.default == 'all' else []) + names)
    for words in product(*choices):
        if len(words) < 2 or words[0] != words[1]:
            yield dict(zip([f.name for f in cls.words()], words))


def starting_points(classes, spacecraft):
    """
    Return every effect at every place and every combination of its starting values.

    Parameters
    ----------
    classes : iterable of Effect classes
        Those with an expected spectrum count, the others are left out.
    spacecraft : Spacecraft
        Gives channels and arrays.

    Returns
    -------
    list of Effect

    """
    found: list[Effect] = []
    for cls in classes:
        if not cls.spectral:
            continue
        for place in places(cls, spacecraft):
            starts = cls.starts_on(spacecraft, place)
            found += [cls(**place, **dict(zip(starts, v))) for v in product(*starts.values())]
    return [e for e in found if not e.is_null]
