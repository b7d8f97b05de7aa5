"""Fit a candidate and the levels by Fisher scoring, eq. (100) of docs/theory-gap.md."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import inject
from ssi_ros.effects.base import is_log
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.expected import expected
from ssi_ros.gap.likelihood import whiten
from ssi_ros.gap.lively import liveliness
from ssi_ros.gap.tolerance import no_tolerance
from ssi_ros.model.excitation import source, White

STEPS = 12
ENOUGH = 0.02           # gain of the log likelihood below which a fit stops
PROBE = 1e-3            # share of the coordinate's scale for a difference quotient
EXCITATION_STD = 1.4    # of the logarithm of a power that is not known: 6 dB
LEAST_INFORMATION = 1e-4    # of a number in units of its scale: a hundred scales wide
EXCITATION_FAR_DB = 30.0    # beyond which a level is no nuisance but another unit
QUIET_DB = -12.0        # below which noise and excitation together are another unit
NOISE_FAR_DB = 35.0     # effects such as rails and jitter raise the noise by up to 26 dB
NOISE_STD = 0.7         # and of the noise of a sensor: 3 dB
LONGEST = 1.5           # step of a logarithm
# What a candidate raises that cannot exist, as a mass off the array does.
IMPOSSIBLE = (ValueError, np.linalg.LinAlgError, OverflowError)
FOLLOWED = 2            # times that noise is told anew from the motion that a fit has found


@dataclass(frozen=True, eq=False)
class Fit:
    """
    A candidate at its best values.

    Attributes
    ----------
    candidate : Candidate
        With the fitted values.
    levels : ndarray
        Fitted levels over nominal, power: each random part of the excitation, sensor noise.
    likelihood : float
        At the fit, of the evidence that was fitted, tolerances and their prior included.
    model : ndarray, shape (a, k, l, l)
        Expected periodograms, the tolerances at their most probable values.
    plain : ndarray, shape (a, k, l, l)
        The same with all tolerances at zero.
    shares : tuple of ndarray
        Its derivatives by the logarithms of the levels.
    covariance : ndarray, shape (p, p)
        Of the candidate's coordinates, levels and tolerances profiled out.
    known : tuple of Expected and list of ndarray, optional
        Its expected periodograms and their derivatives, of a nonlinear candidate: what another
        fit begins with.

    """

    candidate: Candidate
    levels: np.ndarray
    likelihood: float
    model: np.ndarray
    plain: np.ndarray
    shares: tuple
    covariance: np.ndarray
    known: tuple = None


class Simulator:
    """The model side of a diagnosis: spacecraft and frame; expected spectra of candidates."""

    def __init__(self, spacecraft, frame, duration_s, present=(), lively=None):
        self.spacecraft, self.frame, self.duration_s = spacecraft, frame, duration_s
        self.present, self.lively = tuple(present), lively

    def on(self, frame):
        """Return the same model side in another frame."""
        return Simulator(self.spacecraft, frame, self.duration_s, self.present)

    def following(self, candidate, levels, evidence):
        """Return the model side of a candidate whose noise follows the motion of this record."""
        if self.lively is not None:
            return self
        try:
            setup = self.setup(candidate, levels)
            if not setup.jitter_rms_s:
                return self
            lively = liveliness(self, setup, levels, evidence)
        except IMPOSSIBLE:
            return self
        return Simulator(self.spacecraft, self.frame, self.duration_s, self.present, lively)

    def setup(self, candidate, levels=None, near=None):
        """
        Return the setup of a candidate beside what is there, its hinges shaken at levels.

        `near` is that of the expected periodograms of a candidate like it.
        """
        found = inject(self.spacecraft, self.present + candidate.effects, self.duration_s)
        if levels is None or not found.laws:
            return found
        names = [p.name for p in found.system.excitation if isinstance(source(p), White)]
        return replace(found, powers=dict(zip(names, levels)), near=near)

    def expected(self, candidate, levels=None, near=None):
        """Return its expected periodograms; None where it cannot exist, as off the array."""
        try:
            found = self.spectrum(self.setup(candidate, levels, near))
        except IMPOSSIBLE:
            return None
        parts = (*found.shares, found.fixed)
        return found if all(np.all(np.isfinite(p)) for p in parts) else None

    def spectrum(self, setup):
        """Return the expected periodograms of a setup."""
        return expected(setup, self.frame, self.lively)


def fit_again(simulator, evidence, start, steps, tolerance, far=False):
    """
    Fit another record of the same length, or a part of it, from a fit: see `fit`.

    Near the fit its derivatives will do: where their product with what is seen vanishes is as
    good an estimate as where the likelihood is highest. `far` takes them anew after every step.
    """
    return fit(simulator, evidence, start.candidate, start.levels, steps, tolerance, start.known,
               far)


def fit(simulator, evidence, candidate=Candidate(), levels=None, steps=STEPS, tolerance=None,
        known=None, far=True):
    """
    Maximise the likelihood over a candidate's numbers and the levels.

    Parameters
    ----------
    simulator : Simulator
        Model side.
    evidence : Evidence
        Recorded side.
    candidate : Candidate
        Where to begin; without effects only the levels are fitted.
    levels : ndarray, optional
        Levels to begin with.
    steps : int
        Most steps.
    tolerance : Tolerance, optional
        What is fitted beside, eq. (117).
    known : tuple, optional
        Of a fit that ended there.
    far : bool
        Whether the derivatives by the candidate's numbers are taken anew after every step.

    Returns
    -------
    Fit or None
        None if the candidate cannot be computed where it begins.

    """
    side = simulator.following(candidate, levels, evidence)
    if side is simulator:
        return _climb(simulator, evidence, candidate, levels, steps, tolerance, known, far)
    found = _climb(side, evidence, candidate, levels, steps, tolerance)
    for _ in range(FOLLOWED):
        if found is not None:
            side = simulator.following(found.candidate, found.levels, evidence)
            found = _climb(side, evidence, found.candidate, found.levels, steps, tolerance)
    return found


def _climb(simulator, evidence, candidate, levels, steps, tolerance, known=None, far=True):
    """Fit with a model side that stays as it is."""
    now, changes = known or (simulator.expected(candidate, levels), None)
    if now is None:
        return None
    if tolerance is None:
        tolerance = no_tolerance(simulator.frame, now.fixed.shape[-1])
    x = np.array(candidate.point())
    logs = np.zeros(len(now.names)) if levels is None else np.log(levels)
    here = _Place(now, logs, evidence, tolerance)
    if not np.isfinite(here.value):
        return None
    damping = 1e-3
    scales = _scales(candidate)
    caps = np.concatenate([np.full(len(logs), LONGEST), LONGEST * scales])
    for step_number in range(steps + 1):
        slopes = [np.exp(g) * s for g, s in zip(here.logs, here.now.shares)]
        if changes is None:
            changes = _differences(simulator, candidate, x, scales, here.now, here.logs)
        slopes += changes
        score, information = here.gradient(slopes, evidence)
        likely = score @ np.linalg.pinv(information, hermitian=True) @ score / 2
        if likely < ENOUGH or step_number == steps:
            break
        diagonal = np.diag(np.diag(information) + 1e-12)
        # a direction that the record hardly knows must not take the whole of a step
        least = np.diag(1 / caps ** 2)
        gain = 0.0
        for _ in range(6):
            step = np.linalg.solve(information + damping * diagonal + least, score)
            if not np.all(np.isfinite(step)):
                return None
            step = step * min(1.0, np.min(caps / np.maximum(np.abs(step), 1e-300)))
            trial = candidate.moved(x + step[len(logs):])
            ahead = here.logs + step[:len(logs)]
            then = simulator.expected(trial, np.exp(ahead), here.now.near)
            if then is not None:
                there = _Place(then, ahead, evidence, tolerance)
                if there.value > here.value:
                    gain, here, candidate = there.value - here.value, there, trial
                    changes = None if far else changes
                    x = np.array(candidate.point())
                    damping = max(damping / 10, 1e-6)
                    break
            damping = min(10 * damping + 1e-3, 1e6)
        if gain < ENOUGH:
            break
    inverse = _covariance(information, caps)
    shares = tuple(np.exp(g) * s for g, s in zip(here.logs, here.now.shares))
    return Fit(candidate, np.exp(here.logs), here.value,
               tolerance.corrected(here.model, here.seen), here.model, shares,
               inverse[len(logs):, len(logs):],
               (here.now, changes) if here.now.near else None)


def _covariance(information, scales):
    """Invert an information; a direction without any has a variance of many scales, not none."""
    values, vectors = np.linalg.eigh(information * np.outer(scales, scales))
    spread = vectors * (scales[:, None] / np.sqrt(np.maximum(values, LEAST_INFORMATION)))
    return spread @ spread.T


class _Place:
    """Where a fit stands: model, record as it sees it, likelihood with tolerances."""

    def __init__(self, now, logs, evidence, tolerance):
        self.now, self.logs, self.tolerance = now, logs, tolerance
        self.model = now.at(np.exp(logs))
        self.seen = whiten(self.model, evidence)
        self.value = self.seen.likelihood
        self.prior = level_prior(len(logs))
        if np.isfinite(self.value):
            gain, self.most, self.inverse = tolerance.profile(self.seen)
            self.value += gain - float(self.prior @ logs ** 2) / 2

    def gradient(self, slopes, evidence):
        """Return score and information of slopes of S, the tolerances profiled out."""
        if max(map(len, slopes)) > len(self.model):
            # one number makes the pieces differ: all must be seen one by one
            self.model = np.repeat(self.model, evidence.frame.pieces, axis=0)
            self.seen = whiten(self.model, evidence)
        seen, tolerance = self.seen, self.tolerance
        flat = seen.directions(slopes)
        total = flat.reshape(len(flat), -1)
        score = seen.weight * (total @ seen.excess.ravel())
        information = seen.weight * (total @ total.T)
        mixed = seen.weight * (flat.sum(axis=1) @ tolerance.vectors.T)
        count = len(self.logs)
        score[:count] -= self.prior * self.logs
        information[:count, :count] += np.diag(self.prior)
        return (score - mixed @ self.most,
                information - mixed @ self.inverse @ mixed.T)


def level_gap(levels):
    """Return what is wrong with levels that no nuisance reaches, or an empty text."""
    decibels = 10 * np.log10(levels)
    excitation, noise = decibels[:-1].max(), decibels[-1]
    if max(excitation, noise) < QUIET_DB:
        return (f'excitation and noise are both {-max(excitation, noise):.0f} dB and more below '
                'the model: are the samples in g and not in m/s^2?')
    if abs(excitation) > EXCITATION_FAR_DB:
        return f'the excitation is {excitation:+.0f} dB off the model: wrong unit or wrong model?'
    if noise > NOISE_FAR_DB:
        return (f'noise on all channels is {noise:+.0f} dB above the model and hides it: wrong '
                'unit, or no accelerometer?')
    return ''


def level_prior(count):
    """Return the precision of the logarithms of so many levels, the sensor noise last."""
    return 1 / np.append(np.full(count - 1, EXCITATION_STD), NOISE_STD) ** 2


def _scales(candidate):
    """Return the longest step of every coordinate: a unit of a logarithm, or a starting value."""
    sizes = []
    for i, f in candidate.numbers():
        values = candidate.effects[i].starts[f.name]
        away = max(abs(v - f.default) for v in values)
        # a start at the default says nothing of the scale: a fifth of the value then
        away = away or 0.2 * abs(f.default) or 1e-6
        sizes.append(1.0 if is_log(f) else 5.0 * away)
    return np.array(sizes)


def _differences(simulator, candidate, x, scales, now, logs):
    """Return the derivative of S by every number of the candidate."""
    slopes, levels = [], np.exp(logs)
    here = now.at(levels)
    for i, scale in enumerate(scales):
        for sign in (1.0, -1.0):
            at = x.copy()
            at[i] += sign * PROBE * scale
            moved = candidate.moved(at)
            width = moved.point()[i] - x[i]
            there = simulator.expected(moved, levels, now.near) if width else None
            if there is not None:
                slopes.append((there.at(levels) - here) / width)
                break
        else:
            slopes.append(np.zeros_like(here))
    return slopes
