"""Nonlinear hinges as the linear ones that come nearest under Gaussian motion, eq. (96)."""
from dataclasses import replace
import math

import numpy as np

from ssi_ros.model.excitation import total_covariance

ROUNDS = 40
ENOUGH = 1e-7           # relative change of an equivalent hinge at which it stands


def linearise(setup):
    """
    Return the setup with every hinge law replaced by its equivalent stiffness and damping.

    Statistical linearisation (Caughey, J. Acoust. Soc. Am. 35, 1963): freeplay takes k
    erf(gap / sigma sqrt 2) away, k3 adds 3 k3 sigma^2, friction adds the damping
    torque sqrt(2/pi) / sigma', with sigma and sigma' the rms of angle and speed that the
    linear system then has.
    """
    if not setup.laws:
        return setup
    base, system = setup.system, setup.system
    rows = {law.hinge: base.input[:, base.inputs.index(law.hinge)] for law in setup.laws}
    at, before, system = np.zeros(len(setup.laws)), None, base
    for _ in range(ROUNDS):
        covariance = _covariance(system)
        off = np.array([_equivalent(law, *_motion(system, covariance, rows[law.hinge]))
                        for law in setup.laws]) - at
        step = off / 2
        if before is not None:
            # secant: the root of what is off, as if each hinge minded only itself
            moved, change = before
            slope = np.where(moved != 0.0, (off - change) / np.where(moved, moved, 1.0), -2.0)
            step = np.where(slope < -0.1, -off / np.minimum(slope, -0.1), off / 2)
        before, at = (step, off), at + step
        system = _with(base, setup.laws, at, rows)
        if np.all(np.abs(step) <= ENOUGH * np.abs(at)):
            break
    return replace(setup, system=system, laws=())


def _equivalent(law, angle, speed):
    """Return the stiffness that a law adds to its hinge, of friction the damping, eq. (96)."""
    if law.kind == 'freeplay':
        # a hinge that never leaves its play would not hold the array at all
        return -law.stiffness_n_m_rad * min(math.erf(law.size / (angle * math.sqrt(2))), 0.995)
    if law.kind == 'cubic':
        return 3 * law.size * angle ** 2
    return law.size * math.sqrt(2 / math.pi) / speed


def _with(system, laws, sizes, rows):
    stiffness, damping = system.stiffness.copy(), system.damping.copy()
    for law, size in zip(laws, sizes):
        matrix = damping if law.kind == 'friction' else stiffness
        matrix += size * np.outer(rows[law.hinge], rows[law.hinge])
    return replace(system, stiffness=stiffness, damping=damping)


def _covariance(system):
    """Return the stationary covariance of the states."""
    return system.plant.discrete(system.rate_hz).state_covariance(
        total_covariance(system.excitation, system.rate_hz, system.inputs))


def _motion(system, covariance, row):
    """Return the stationary rms of angle and speed of a hinge."""
    where = {name: i for i, name in enumerate(system.plant.states)}
    found = []
    for end in ('', '_rate'):
        full = np.zeros(len(where))
        for d, share in zip(system.dofs, row):
            if share:
                full[where[d + end]] = share
        found.append(math.sqrt(max(full @ covariance @ full, 1e-40)))
    return found
