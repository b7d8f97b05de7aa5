"""
What a nonlinear candidate has to be so that it looks as the record does: eq. (120).

The expected spectrum of a hinge with play is that of its equivalent linear one, and a fit of it
errs where the motion is far from Gaussian. A fit of a simulated record errs alike, which corrects
it: indirect inference (Gourieroux, Monfort and Renault, J. Appl. Econometrics 8, 1993).
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import inject, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.fit import fit_again
from ssi_ros.gap.holes import excited, filled, without_rails
from ssi_ros.gap.likelihood import Evidence
from ssi_ros.gap.meter import measure
from ssi_ros.gap.spectra import spectra

ROUNDS = 8              # simulations and fits, at most
RECORDS = 2             # of a round
STEP = 0.9              # share of the difference that a round takes
ENOUGH = 1.5            # standard deviations: two of what the mean of two records scatters by
LONGEST = 2.0           # step over what is off, both in standard deviations
LEVEL_ENOUGH = 0.05     # share of a level that is left alone
LEAST = 0.1             # share of a fitted level that is left of it
FITTED_STEPS = 6        # of the fit of a simulated record
SEED = 9_100_000        # far from seeds that records are made with


@dataclass(frozen=True, eq=False)
class Made:
    """
    What a simulator has to be given so that a fit finds what it found in a record.

    Attributes
    ----------
    candidate : Candidate
        The effects.
    levels : ndarray
        Power over nominal: each random part of the excitation, sensor noise.
    spread : float
        By which its numbers scatter more than those of the fit.
    lost : float
        Log likelihood that the fit of such a record loses by its expected spectrum, roughly.

    """

    candidate: Candidate
    levels: np.ndarray
    spread: float = 1.0
    lost: float = 0.0


def records(simulator, made, seed, count):
    """Yield records made with effects and levels, treated as a record is, and their evidence."""
    effects = simulator.present + made.candidate.effects
    setup = inject(at_levels(simulator.spacecraft, made.levels), effects, simulator.duration_s)
    frame, level = simulator.frame, excited(simulator, made.levels)
    for i in range(count):
        samples = filled(simulator, *without_rails(simulate_setup(setup, seed + i), effects),
                         level)
        yield samples, Evidence(frame, spectra(samples, frame), frame.used)


def at_levels(spacecraft, levels):
    """Return a spacecraft whose torque, process noise and sensor noise have levels of power."""
    torque, process, noise = np.sqrt(levels)
    excitation = spacecraft.excitation
    return replace(
        spacecraft, noise_rms_m_s2=spacecraft.noise_rms_m_s2 * float(noise),
        excitation=replace(
            excitation, process_noise_rms=excitation.process_noise_rms * float(process),
            torque_rms_n_m=tuple(float(t * torque) for t in excitation.torque_rms_n_m)))


def made_by(simulator, fitted, tolerance, band_bins):
    """
    Correct the fit of a candidate by fits of records that it makes.

    Parameters
    ----------
    simulator : Simulator
        Model side.
    fitted : Fit
        Of the record.
    tolerance : Tolerance
        What is fitted beside.
    band_bins : int
        Bins of a band of the meter.

    Returns
    -------
    Made
        The fit itself where no effect of it is nonlinear.

    """
    found = Made(fitted.candidate, fitted.levels)
    if not fitted.candidate.nonlinear:
        return found
    spread = np.sqrt(np.maximum(np.diag(fitted.covariance), 1e-300))
    x, goal = np.array(fitted.candidate.point()), state(fitted)
    # by what is near enough: what rails or a rattle add to a level is a power, no ratio
    unit = np.append(ENOUGH * spread, LEVEL_ENOUGH * fitted.levels)
    again, slopes, before = fitted, np.eye(len(goal)) / STEP, None
    for _ in range(ROUNDS):
        first, *others = [e for _, e in records(simulator, found, SEED, RECORDS)]
        again = fit_again(simulator, replace(first, others=tuple(others)), again, FITTED_STEPS,
                          tolerance, far=True)
        if again is None:
            break
        found = replace(found, lost=measure(again.model, first, band_bins).lost)
        off = (goal - state(again)) / unit
        near = np.all(np.abs(off) <= 1.0)
        if near and before is None:
            break
        if before is not None:
            # the same random numbers in all rounds: what changed is what the step did (Broyden)
            moved, then = before
            slopes = slopes + np.outer(then - off - slopes @ moved, moved) / (moved @ moved)
        step = np.linalg.pinv(slopes) @ off
        step = step * min(1.0, LONGEST * np.linalg.norm(off) / np.linalg.norm(step))
        before = step, off
        step = step * unit
        x = x + step[:len(x)]
        levels = np.maximum(found.levels + step[len(x):], LEAST * fitted.levels)
        found = Made(fitted.candidate.moved(x), levels, np.sqrt(1 + 1 / RECORDS), found.lost)
        x = np.array(found.candidate.point())
        if near:
            break
    return found


def state(fitted):
    """Return the numbers and levels of a fit."""
    return np.append(fitted.candidate.point(), fitted.levels)
