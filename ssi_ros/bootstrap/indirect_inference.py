"""
What a nonlinear candidate has to be so that its fit is that of the record, eq. (120).

The expected spectrum of a hinge with play is that of its equivalent linear one, and a fit of it
errs where the motion is far from Gaussian. A fit of a simulated record errs alike, which corrects
it: indirect inference (Gourieroux, Monfort and Renault, J. Appl. Econometrics 8, 1993).
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.goodness_of_fit import measure
from ssi_ros.gap.inference.model_fit import fit_again
from ssi_ros.gap.inference.thresholds import LIMITS
from ssi_ros.gap.nominal.simulator import at_levels
from ssi_ros.gap.spectra.imputation import filled, without_clipped
from ssi_ros.inputs.beside import simulated_beside

ROUNDS = 8              # simulations and fits, at most
RECORDS = 2             # of a round
STEP = 0.9              # share of the difference that a round takes
LONGEST = 2.0           # step over the difference, both in standard deviations
AWAY = 2.0              # times the least difference so far: the rounds lead away
LEAST = 0.1             # share of a fitted level that is kept of it
FIT_STEPS = 6           # of the fit of a simulated record
SEED = 9_100_000        # far from seeds that records are made with


@dataclass(frozen=True, eq=False)
class IndirectEstimate:
    """What a simulator has to be given so that a fit finds what it found in a record."""

    candidate: Candidate
    levels: np.ndarray      # power over nominal: each random part of the excitation, sensor noise
    spread: float = 1.0     # standard deviation of its numbers over that of the fit
    deficit: float = 0.0    # log likelihood that such a fit loses by its spectrum, roughly


def simulated_records(simulator, estimate, seed, count):
    """Yield simulated records of an estimate, treated as a record is, and their evidence."""
    effects = simulator.present + estimate.candidate.effects
    setup = simulator.injected(at_levels(simulator.spacecraft, estimate.levels),
                               estimate.candidate)
    levels = np.append(estimate.levels[:-1], 1.0)       # as `completed` fills a record
    for i in range(count):
        samples, limits = simulated_beside(
            simulator, setup, seed + i, effects) if simulator.recorded else without_clipped(
            simulate_setup(setup, seed + i), effects)
        samples = filled(simulator, samples, levels, limits=limits)
        yield samples, simulator.evidence(samples)


def indirect_estimate(simulator, fitted, uncertainty, band_bins):
    """Correct the Fit of a candidate, if it is nonlinear, by fits of records that it simulates."""
    found = IndirectEstimate(fitted.candidate, fitted.levels)
    if not fitted.candidate.nonlinear:
        return found
    spread = np.sqrt(np.maximum(np.diag(fitted.covariance), 1e-300))
    x, goal = np.array(fitted.candidate.point()), _state(fitted)
    # what clipping or a loose hinge adds to a level is a power, no ratio
    unit = np.append(LIMITS.estimate_std.value * spread,
                     LIMITS.estimate_level.value * fitted.levels)
    again, slopes, before = fitted, np.eye(len(goal)) / STEP, None
    best, least = found, np.inf
    for _ in range(ROUNDS):
        first, *others = [e for _, e in simulated_records(simulator, found, SEED, RECORDS)]
        again = fit_again(simulator, replace(first, others=tuple(others)), again, FIT_STEPS,
                          uncertainty, far=True)
        if again is None:
            break
        found = replace(found, deficit=measure(again.model, first, band_bins).lost)
        off = (goal - _state(again)) / unit
        near, distance = np.all(np.abs(off) <= 1.0), np.linalg.norm(off)
        if distance > AWAY * least:
            return best
        if distance < least:
            best, least = found, distance
        if near and before is None:
            break
        if before is not None:
            # the same random numbers in all rounds: what changed is the step's (Broyden)
            moved, then = before
            slopes = slopes + np.outer(then - off - slopes @ moved, moved) / (moved @ moved)
        step = np.linalg.pinv(slopes) @ off
        step = step * min(1.0, LONGEST * np.linalg.norm(off) / np.linalg.norm(step))
        before, x = (step, off), x + (step * unit)[:len(x)]
        there = fitted.candidate.moved(x)
        if simulator.expected(there) is None:
            break               # such as a sensor off its array: what was found before stays
        levels = np.maximum(found.levels + (step * unit)[len(x):], LEAST * fitted.levels)
        found = IndirectEstimate(there, levels, np.sqrt(1 + 1 / RECORDS),
                                 found.deficit)
        x = np.array(found.candidate.point())
        if near:
            break
    return found


def _state(fitted):
    """Return the numbers and levels of a fit."""
    return np.append(fitted.candidate.point(), fitted.levels)
