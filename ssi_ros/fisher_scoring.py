"""Damped Fisher scoring (Levenberg and Marquardt) with capped steps, eq. (100) and (152)."""
from typing import Protocol

import numpy as np

GAIN = 0.02             # of the log likelihood: less moves no estimate by more than 0.2 deviations
LEAST_INFORMATION = 1e-4    # coordinates that are not determined deviate by 100 of their scales
TRIALS = 6              # of a step, each more damped than the one before
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-6, 1e6     # of the information's diagonal
SHORTENS = 0.05         # a tenth of the damping that shortens a step by a third
AS_PROMISED = 0.5       # share of what a quadratic promises of a capped step: the next is longer
LONGER = 2.0            # times as long
HOPE = 4.0              # times what a quadratic promises: more is not expected of a climb
GOES_ON = 3.0           # times the last gain, in every step left: more is not expected either


class Place(Protocol):
    """Where a fit stands; `value` is the log likelihood, None where only its slopes are known."""

    x: np.ndarray
    value: float

    def gradient(self):
        """Return score, shape (p,), and Fisher information, shape (p, p)."""

    def at(self, x):
        """Return the place at other coordinates; None where the model cannot exist."""


def maximise(here, caps, steps, least=-np.inf):
    """
    Climb from a Place to the nearest maximum of the likelihood, at first by at most `caps`, (p,).

    After a capped step that gains as promised the next may be longer, so that few steps reach a
    maximum at many caps from the start (Conn, Gould and Toint, Trust-Region Methods, 2000). The
    climb ends where it will hardly come to a likelihood of `least`. Returns the place, None where
    a step is not finite, and the Fisher information (p, p) last used.
    """
    damping, limit, gain, longest = FIRST_DAMPING, GAIN, np.inf, 1.0
    # a direction that the record hardly determines must not take the whole of a step
    weak = np.diag(1 / caps ** 2)
    for number in range(steps + 1):
        score, information = here.gradient()
        promised = score @ np.linalg.pinv(information, hermitian=True) @ score / 2
        if promised < limit or number == steps:
            break
        if number and here.value is not None and here.value + min(
                HOPE * promised, GOES_ON * (steps - number) * gain) < least:
            break
        diagonal = np.diag(np.diag(information) + 1e-12)
        gain = 0.0
        for _ in range(TRIALS):
            step = np.linalg.solve(information + damping * diagonal + weak, score)
            if not np.all(np.isfinite(step)):
                return None, information
            share = min(1.0, longest * np.min(caps / np.maximum(np.abs(step), 1e-12 * caps)))
            step = share * step
            hoped = (score - information @ step / 2) @ step
            if gain < 0.0 and hoped < limit:
                break           # so short a step gains nothing that counts
            there = here.at(here.x + step)
            gain = -np.inf if there is None else _gain(here, there, score)
            if gain > 0.0:
                here, damping = there, max(damping / 10, LEAST_DAMPING)
                if share < 1.0 and gain > AS_PROMISED * hoped:
                    longest *= LONGER
                break
            # less damping than this hardly shortens a step
            damping = min(10 * max(damping, SHORTENS), MOST_DAMPING)
        if not gain >= limit:
            break
    return here, information


def _gain(here, there, score):
    """Return the gain of a step: of the likelihood, or by its slopes at both ends."""
    if here.value is not None:
        return there.value - here.value
    return float((score + there.gradient()[0]) @ (there.x - here.x)) / 2


def held_inside(x, bounds, score, information):
    """Return score and information without coordinates that are at a bound and would pass it."""
    # the others go on as if these were fixed
    if bounds is None:
        return score, information
    (low, high), score, information = bounds, score.copy(), information.copy()
    held = np.flatnonzero((x <= low) & (score < 0) | (x >= high) & (score > 0))
    score[held], information[held], information[:, held] = 0.0, 0.0, 0.0
    information[held, held] = 1.0
    return score, information


def covariance(information, scales):
    """Invert an information; a direction without any has a variance of many scales, not none."""
    values, vectors = np.linalg.eigh(information * np.outer(scales, scales))
    least = LEAST_INFORMATION
    spread = vectors * (scales[:, None] / np.sqrt(np.maximum(values, least)))
    return spread @ spread.T
