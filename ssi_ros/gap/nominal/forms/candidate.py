"""Candidates where there is no geometry: effects as filters of the channels, eq. (145)."""
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np

from ssi_ros.effects import effect_class, ModalPattern
from ssi_ros.effects.registry import showing
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.size_prior import posterior_over_prior


@dataclass(frozen=True)
class Number:
    """A coordinate x that a fit moves."""

    name: str
    unit: str
    start: float            # where the fit begins: a size that is small but not null
    low: float
    high: float             # `low` and `high` are its range
    value: Callable = float         # of x, as the user reads it


@dataclass(frozen=True, eq=False)
class Form:
    """One effect at one place, as filter and power of the channels."""

    place: dict             # such as {'channel': 'a'}
    numbers: tuple          # of Number, the coordinates
    change: Callable = lambda nominal, x: (None, None)      # gain and added, (b, l, l) or None
    meaning: str = ''       # what it says of the structure, in words
    pattern: ModalPattern = None    # all effects that declare it have this form
    effect: str = ''        # name in the library, of the registry or of a detection
    places: int = 1         # of which this is one
    levels: np.ndarray = None       # (g,), power of each group of the record over its mean
    masked: np.ndarray = None       # (g, b), cells of the record that hold what comes and goes
    constants: dict = field(default_factory=dict)  # read off the samples, {name: (value, unit)}
    begin: np.ndarray = None        # (p,), where a fit begins if known better than `start`s
    on_samples: bool = False        # filters act on the noise of the channels as well
    variants: tuple = ()    # the same effect at the same place, by other filters
    each_mode: bool = False         # whether it has coordinates of its own for every mode
    measured: float = 0.0   # numbers taken from the record itself, at half a nat each
    odds: float = 0.0       # log odds that the frequencies of the modes give it
    bonus: float = 0.0      # log odds of the detection that it comes from
    near: Callable = lambda x: {}   # of x, the channels that move as its place does, and the MAC

    @property
    def equivalents(self):
        """Names of the other effects that have this same form without geometry."""
        names = () if self.pattern is None else showing(self.pattern)
        return tuple(n for n in names if n != self.effect)

    @property
    def start(self):
        """Return the coordinates at which a fit begins."""
        return [n.start for n in self.numbers] if self.begin is None else list(self.begin)

    @property
    def steps(self):
        """Return the steps of its numbers for difference quotients, (p,)."""
        return np.array([n.start for n in self.numbers]) / 10

    @property
    def kind(self):
        """Return what two forms have in common that differ by their numbers' values alone."""
        return self.effect, tuple(self.place.items()), tuple(n.name for n in self.numbers)


def slices_of(forms):
    """Return the slice of the coordinates of all forms that belongs to each."""
    ends = accumulate(len(f.numbers) for f in forms)
    return [slice(end - len(f.numbers), end) for f, end in zip(forms, ends)]


@dataclass(frozen=True, eq=False)
class ModalCandidate:
    """One effect or several at once, as modal forms that act one after the other."""

    forms: tuple = ()       # empty for the nominal itself
    nonlinear = False

    @property
    def names(self):
        """Names of the effects."""
        return tuple(f.effect for f in self.forms)

    @property
    def key(self):
        """Return what two candidates have in common that differ by their values alone."""
        return tuple(f.kind for f in self.forms)

    kinds = key

    def is_passed(self, begin, end):
        """Return whether another fit came past this one: forms have one start each."""
        return False

    @property
    def equivalents(self):
        """Names of the other effects that have one of these forms without geometry."""
        return tuple(dict.fromkeys(n for f in self.forms for n in f.equivalents
                                   if n not in self.names))

    @property
    def channels(self):
        """Names of the channels at which the effects are."""
        return tuple(f.place['channel'] for f in self.forms if 'channel' in f.place)

    @property
    def bonus(self):
        """Log odds of the detections that its forms come from."""
        return sum(f.bonus for f in self.forms)

    @property
    def odds_in_time(self):
        """Log odds of what moves through the record, which no mean of its spectra shows."""
        return sum(f.bonus for f in self.forms if f.pattern is ModalPattern.FREQUENCY_DRIFT)

    @property
    def exact(self):
        """Whether all are filters of single channels, which are what they are whatever moves."""
        return all(f.pattern is ModalPattern.CHANNEL_FILTER for f in self.forms)

    @property
    def approximation(self):
        """Share of the gap that a right candidate may leave: the error of its modal form."""
        # An equivalent linear form is Gaussian and a joint is not, nor are impulses, which excite
        # modes that the reference does not show; their detections name them.
        linearised = self.bonus > 0.0 and not all(effect_class(n).gaussian for n in self.names)
        return LIMITS.linearised_form.value if linearised else LIMITS.modal_form.value

    @property
    def slices(self):
        """Return the slice of the coordinates that belongs to each form."""
        return slices_of(self.forms)

    def log_prior_ratio(self, estimate, covariance):
        """
        Return the log of posterior over prior volume, with the odds of mode frequencies, (112).

        Where a form has a number for every mode, the modes have a change in common and each its
        own beside it, both of a size that all of them determine. `estimate` (p,), `covariance` (p,
        p).
        """
        # modes that moved count once, whichever of two forms moves them
        total = max((f.odds for f in self.forms if f.odds), default=0.0)
        for form, at in zip(self.forms, self.slices):
            total -= form.measured / 2 + np.log(form.places)
            if form.numbers:
                start = np.array([n.start for n in form.numbers])
                total += posterior_over_prior(
                    [n.name.split('_at_')[0] for n in form.numbers], estimate[at] / start,
                    covariance[at, at] / np.outer(start, start), LIMITS.size_range.value)
        return float(total)
