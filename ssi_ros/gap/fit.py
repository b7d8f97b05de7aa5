"""Fit a candidate and the levels by Fisher scoring, eq. (100) of docs/theory-gap.md."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.effects import inject
from ssi_ros.effects.base import is_log
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.expected import expected
from ssi_ros.gap.likelihood import gradient, log_likelihood

STEPS = 12
ENOUGH = 0.02           # gain of the log likelihood below which a fit stops
PROBE = 1e-3            # share of the coordinate's scale for a difference quotient
LONGEST = 1.0           # step of a logarithm


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
        At the fit, of the evidence that was fitted.
    model : ndarray, shape (a, k, l, l)
        Expected periodograms.
    covariance : ndarray, shape (p, p)
        Of the candidate's coordinates, the levels profiled out.

    """

    candidate: Candidate
    levels: np.ndarray
    likelihood: float
    model: np.ndarray
    covariance: np.ndarray


class Simulator:
    """The model side of a diagnosis: spacecraft and frame; expected spectra of candidates."""

    def __init__(self, spacecraft, frame, duration_s, present=()):
        self.spacecraft, self.frame, self.duration_s = spacecraft, frame, duration_s
        self.present = tuple(present)

    def setup(self, candidate):
        """Return the setup of a candidate, on top of the effects that are already there."""
        return inject(self.spacecraft, self.present + candidate.effects, self.duration_s)

    def expected(self, candidate):
        """Return its expected periodograms; None where it cannot exist, as off the array."""
        try:
            found = expected(self.setup(candidate), self.frame)
        except (ValueError, np.linalg.LinAlgError, OverflowError):
            return None
        parts = (*found.shares, found.fixed)
        return found if all(np.all(np.isfinite(p)) for p in parts) else None


def fit(simulator, evidence, candidate=Candidate(), levels=None, steps=STEPS):
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

    Returns
    -------
    Fit or None
        None if the candidate cannot be computed where it begins.

    """
    now = simulator.expected(candidate)
    if now is None:
        return None
    x = np.array(candidate.point())
    logs = np.zeros(len(now.names)) if levels is None else np.log(levels)
    model = now.at(np.exp(logs))
    best = log_likelihood(model, evidence)
    damping, information = 1e-3, None
    scales = _scales(candidate)
    for _ in range(steps):
        slopes = [np.exp(g) * s for g, s in zip(logs, now.shares)]
        slopes += _differences(simulator, candidate, x, scales, now, logs)
        score, information = gradient(model, slopes, evidence)
        if score @ np.linalg.pinv(information, hermitian=True) @ score / 2 < ENOUGH:
            break
        diagonal = np.diag(np.diag(information) + 1e-12)
        gain = 0.0
        for _ in range(6):
            step = np.linalg.solve(information + damping * diagonal, score)
            if not np.all(np.isfinite(step)):
                return None
            cap = np.concatenate([np.full(len(logs), LONGEST), LONGEST * scales])
            step = step * min(1.0, np.min(cap / np.maximum(np.abs(step), 1e-300)))
            trial = candidate.moved(x + step[len(logs):])
            then = simulator.expected(trial)
            if then is not None:
                there = then.at(np.exp(logs + step[:len(logs)]))
                value = log_likelihood(there, evidence)
                if value > best:
                    gain, best = value - best, value
                    candidate, now, model = trial, then, there
                    x, logs = np.array(candidate.point()), logs + step[:len(logs)]
                    damping = max(damping / 10, 1e-6)
                    break
            damping = min(10 * damping + 1e-3, 1e6)
        if gain < ENOUGH:
            break
    inverse = np.linalg.pinv(information, hermitian=True)
    return Fit(candidate, np.exp(logs), best, model, inverse[len(logs):, len(logs):])


def _scales(candidate):
    """Return the longest step of every coordinate: a unit of a logarithm, or a starting value."""
    sizes = []
    for i, f in candidate.numbers():
        values = candidate.effects[i].starts[f.name]
        away = max(abs(v - f.default) for v in values)
        sizes.append(1.0 if is_log(f) else 5.0 * max(away, 1e-6 * abs(f.default), 1e-9))
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
            there = simulator.expected(moved) if width else None
            if there is not None:
                slopes.append((there.at(levels) - here) / width)
                break
        else:
            slopes.append(np.zeros_like(here))
    return slopes
