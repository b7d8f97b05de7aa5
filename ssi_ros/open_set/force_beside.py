"""A force that follows the motion along a curve, as it did not in an earlier recording."""
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.fft import irfft, rfft
from scipy.linalg import toeplitz

from ssi_ros.open_set.families import Finding, NEW, of_short_record
from ssi_ros.past_motion import (
    DISPLACEMENT, integrated, LARGE, level_of_inputs, points_of, VELOCITY)
from ssi_ros.tails import chi2

FAMILY = 'nonlinear force'
ORDERS = 2, 3           # even and odd
LAGS = 8                # rows in which a force is seen in what its past does not predict
ALIKE = 0.1             # of a correlation, by which it may change
BEFORE = 1e-3           # p-value below which the reference has a nonlinear force too
LEAST_RANK = 0.01       # of the largest variance of lags, below which they repeat each other
BINS, ABOVE_NOISE = 24, 4.0     # of a spectrum, and its least power that is no noise
CYCLES = 60             # of the slowest motion: fewer are no sample of a distribution
SHORT_S = 80.0, 160.0   # beside a recording and a model: python -m validation.gap_odd_channels


@dataclass(frozen=True, eq=False)
class Driven:
    """Accelerations of l channels, and what their past does not predict."""

    values: np.ndarray      # (n, l), without their means
    errors: np.ndarray      # (n - k, l), white
    rate_hz: float
    lowest_hz: float

    @cached_property
    def spectra(self):
        """Spectra of the channels, (f, l), of twice the rows: filters do not come round."""
        return rfft(self.values, 2 * len(self.values), axis=0)

    @cached_property
    def frequencies_hz(self):
        """Frequencies of those, (f,)."""
        return np.fft.rfftfreq(2 * len(self.values), 1 / self.rate_hz)

    @cached_property
    def corners_hz(self):
        """Lowest frequency at which every channel is above its noise, (l,)."""
        lowest = max(self.lowest_hz, CYCLES * self.rate_hz / len(self.values))
        edges = np.geomspace(lowest, self.rate_hz / 2, BINS + 1)
        begins = np.searchsorted(self.frequencies_hz, edges)
        power = np.add.reduceat(np.abs(self.spectra) ** 2, begins[:-1], axis=0)
        power /= np.diff(begins)[:, None]
        seen = power > ABOVE_NOISE * power.min(axis=0)
        return edges[np.argmax(seen[:-1] & seen[1:], axis=0)]

    @cached_property
    def level(self):
        """Slow level of the inputs, (n - k,), that of what is new."""
        return level_of_inputs(self.errors)

    @cached_property
    def states(self):
        """Velocities and displacements of all channels one row before, (n - k - 1, 2 l)."""
        return np.transpose([integrated(
            self.spectra[:, i], len(self.values), self.rate_hz, corner, order)
            for i, corner in enumerate(self.corners_hz)
            for order in (VELOCITY, DISPLACEMENT)])[-len(self.errors):-1]

    @cached_property
    def new(self):
        """Innovations, at every level of the inputs alike, (n - k, l), and their spectra."""
        # the prediction knows too few rows of what is slow
        errors, states = self.errors[1:], self.states
        errors = errors - states @ np.linalg.lstsq(states, errors, rcond=None)[0]
        new = np.pad(errors, ((1, 0), (0, 0))) / self.level[:, None]
        new = np.clip(new, -LARGE, LARGE)
        new = new - new.mean(axis=0)
        return new, _power(new)

    def curves(self, points, integrals):
        """Return an even and an odd curve of how channels move, two of them against each other."""
        weights = np.zeros(len(self.corners_hz))
        weights[list(points)] = (1.0, -1.0)[:len(points)]
        # the past alone, so that what is new has no correlation with it, whatever the levels are
        motion = integrated(
            self.spectra @ weights, len(self.values), self.rate_hz,
            self.corners_hz[list(points)].max(), integrals)[-len(self.errors):] / self.level
        motion = np.clip(motion / max(motion.std(), 1e-300), -LARGE, LARGE)
        for order in ORDERS:
            curve = motion ** order
            # a straight line is none, of motion whose level varies too
            curve -= curve.mean() + (curve @ motion) / (motion @ motion) * motion
            yield curve / max(curve.std(), 1e-300)

    def correlations(self, curve):
        """Return those of what is new with a curve before, (g, l), and their covariance."""
        new, powers = self.new
        n = len(curve)
        seen = np.array([new[k:].T @ curve[:n - k] for k in range(LAGS)]) / n
        # as chance makes them at all shifts in time, or of what is white if that is more
        power = _power(curve[:, None])
        white = irfft(power, n, axis=0)[:LAGS] / n
        shared = irfft(power * powers, n, axis=0)[:LAGS] / (n * (new ** 2).sum(axis=0))
        shared = np.where(shared[0] > white[0], shared, white)
        return seen, shared * new.var(axis=0) / n


def force_beside(reference, record, channels, sensors=()):
    """
    Return the Finding of a force that follows the motion along a curve, eq. (188c).

    Of a linear structure under any forces, what is new has no correlation with anything before;
    beside a nonlinear one it follows a polynomial of a displacement or of a velocity, at once and
    for some rows. Motion near the force is known by channels and by differences of two of them.

    Parameters
    ----------
    reference, record : Driven
        Of the same channels; the reference is None beside a model, whose forces are linear.
    channels : sequence of str
        Their names.
    sensors : sequence of str, optional
        Channels that follow a curve alone: what theirs make of the rest is no force.

    Returns
    -------
    Finding
        Of the family 'nonlinear force'; of a reference that has such a force already, p is 1.

    """
    points = [p for p in points_of(len(channels)) if not {channels[i] for i in p} & set(sensors)]
    keys = list(product(points, (VELOCITY, DISPLACEMENT)))
    if not keys:
        return Finding(FAMILY, 1.0, 'No channel was asked for a force.')
    found = np.array([_tests(reference, record, key) for key in keys])
    duration_s = min(len(m.values) / m.rate_hz for m in (reference or record, record))
    before, now = (of_short_record(min(1.0, p.size * p.min()), SHORT_S[not reference], duration_s)
                   for p in found.transpose(2, 0, 1))
    at, order = np.unravel_index(np.argmin(found[:, :, 1]), found.shape[:2])
    named = [channels[i] for i in keys[at][0]]
    how = f'channels {named[0]} and {named[1]} move against each other' if len(named) == 2 else (
        f'channel {named[0]} moves')
    curve = ('one direction differs from the other', 'large motion differs from small')[order]
    return Finding(FAMILY, 1.0 if before < BEFORE else now,
                   f'A force in the structure depends on how {how} along a curve, no straight '
                   f'line{NEW * bool(reference)}: {curve}.')


def _tests(reference, record, key):
    """Return p-values of the reference and of the change, (2,), for every order."""
    if reference is None:
        return [(1.0, _chance(*record.correlations(c))) for c in record.curves(*key)]
    found = []
    for one, two in zip(*(m.curves(*key) for m in (reference, record))):
        (before, scatter), (now, more) = (m.correlations(c) for m, c in (
            (reference, one), (record, two)))
        found.append((_chance(before, scatter),
                      _chance(now - before, scatter + more, ALIKE * before)))
    return found


def _chance(seen, scatter, usual=None):
    """Return the p-value of correlations (g, l), whose covariances over lags are `scatter`."""
    squares = freedom = 0
    for i, numbers in enumerate(seen.T):
        covariance = toeplitz(scatter[:, i])
        if usual is not None:
            covariance = covariance + np.outer(usual[:, i], usual[:, i])
        values, vectors = np.linalg.eigh(covariance)
        known = values > LEAST_RANK * values.max()
        squares += np.sum((numbers @ vectors[:, known]) ** 2 / values[known])
        freedom += known.sum()
    return chi2.sf(squares, freedom)


def _power(series):
    """Return the power of series (n, q), (f, q)."""
    return np.abs(rfft(series, axis=0)) ** 2
