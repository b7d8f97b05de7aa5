"""
Signs that no spectrum shows: steps, rails, losses.

Each test says how sure it is and at which size the effect explains the sign.
"""
from dataclasses import dataclass, field

import numpy as np

from ssi_ros.effects import effect_class

SURE = 0.01             # p-value above which no sign is reported
RAIL_HITS = 3           # times that a channel must show exactly its extreme


@dataclass(frozen=True, eq=False)
class Symptom:
    """
    A sign of one effect that no expected spectrum shows.

    Attributes
    ----------
    effect : Effect
        At the size that the sign speaks for.
    p_value : float
        Of the sign where the effect is absent.
    text : str
        What was seen.
    stds : dict of str to float
        Standard deviations of the effect's quantities, where they are known.
    when : tuple of ndarray, shape (n,)
        Times of single events [s], and how surely each is one; empty where there are none.
    look : tuple of float
        Log likelihood that a swing gains, and in how many cells it was sought; else empty.

    """

    effect: object
    p_value: float
    text: str
    stds: dict = field(default_factory=dict)
    when: tuple = ()
    look: tuple = ()


@dataclass(frozen=True)
class Oddity:
    """A sign of something that is not in the library: its name, p-value and text."""

    name: str
    p_value: float
    text: str


def within(cls, **values):
    """Return an effect with its quantities kept inside their declared ranges."""
    ranges = {f.name: f.metadata for f in cls.numbers()}
    return cls(**{k: float(min(max(v, ranges[k]['low']), ranges[k]['high']))
                  for k, v in values.items()})


def moments(values, weights):
    """Return mean and standard deviation of a distribution on an uneven grid."""
    weights = weights * np.gradient(values)
    mean = np.sum(weights * values) / np.sum(weights)
    return float(mean), float(np.sqrt(np.sum(weights * (values - mean) ** 2) / np.sum(weights)))


def symptoms(samples):
    """
    Look for signs in the samples alone.

    Parameters
    ----------
    samples : Samples
        The record.

    Returns
    -------
    tuple of Symptom
        Those that are there.

    """
    found = [test(samples) for test in (_losses, _rails, _steps)]
    return tuple(s for s in found if s is not None)


def _losses(samples):
    missing = np.isnan(samples.values).any(axis=1)
    fraction = float(missing.mean())
    if fraction == 0.0:
        return None
    # rows lost at random make so many runs; a long gap makes one
    runs = np.count_nonzero(np.diff(missing.astype(int)) == 1) + missing[0]
    if runs < 0.5 * missing.sum() * (1 - fraction):
        return None
    return Symptom(effect_class('dropped_samples')(fraction=fraction), 0.0,
                   f'{100 * fraction:.2g} % of the rows are missing')


def _steps(samples):
    """Find a step of which all values are multiples: they are few and evenly spaced."""
    steps = []
    for column in samples.values.T:
        column = column[np.isfinite(column)]
        values = np.unique(column)
        inner = values[1:-1]                       # the rails need not be multiples
        if len(inner) < 3 or len(values) > 0.5 * len(column):
            return None
        gaps = np.diff(inner)
        step = gaps[gaps > 1e-6 * gaps.max()].min()
        step = np.median(gaps[gaps < 1.5 * step])
        step = (inner[-1] - inner[0]) / np.rint((inner[-1] - inner[0]) / step)
        if np.abs(inner / step - np.rint(inner / step)).max() > 0.01:
            return None
        steps.append(step)
    step = float(np.median(steps))
    return Symptom(effect_class('quantisation')(step_m_s2=step), 0.0,
                   f'all values are multiples of {step:.4g} m/s^2')


def _rails(samples):
    limits = []
    for column in samples.values.T:
        column = column[np.isfinite(column)]
        top = np.abs(column).max()
        hits = np.count_nonzero(np.abs(column) == top)
        distinct = len(np.unique(column))
        # of rounded values the extreme may come twice; at a rail it comes more than its neighbour
        below = np.abs(column)[np.abs(column) < top]
        next_hits = np.count_nonzero(np.abs(column) == below.max()) if len(below) else 0
        if hits >= RAIL_HITS and (distinct > 0.5 * len(column) or hits > 5 * next_hits + 5):
            limits.append(top)
    if not limits:
        # few values, on several channels: of unrounded ones no two are the same by chance
        values = np.abs(samples.values[np.isfinite(samples.values)])
        top = values.max()
        if (np.count_nonzero(values == top) < RAIL_HITS
                or len(np.unique(values)) < 0.5 * len(values)):
            return None
        limits.append(top)
    limit = float(min(limits))
    hits = np.abs(samples.values) >= limit
    share = hits.sum() / np.isfinite(samples.values).sum()
    rows = np.flatnonzero(hits.any(axis=1))
    return Symptom(effect_class('saturation')(limit_m_s2=limit), 0.0,
                   f'{100 * share:.2g} % of the values are at the rails of {limit:.4g} m/s^2',
                   when=(rows / samples.rate_hz, np.ones(len(rows))))


def chance(power, cells):
    """Return the chance of so large an exponential variable in so many cells."""
    return float(-np.expm1(cells * np.log1p(-min(np.exp(-power), 1 - 1e-16))))
