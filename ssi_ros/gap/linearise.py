"""Nonlinear hinges as the linear ones that come nearest under Gaussian motion, eq. (96)."""
from dataclasses import replace
import math

import numpy as np

from ssi_ros.model.excitation import total_covariance

ROUNDS = 25


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
    extra = {law.hinge: (0.0, 0.0) for law in setup.laws}
    for _ in range(ROUNDS):
        covariance = _covariance(system)
        before = dict(extra)
        for law in setup.laws:
            angle, speed = _motion(system, covariance, rows[law.hinge])
            k = law.stiffness_n_m_rad
            if law.kind == 'freeplay':
                # a hinge that never leaves its play would not hold the array at all
                target = (max(-k * math.erf(law.size / (angle * math.sqrt(2))), -0.995 * k), 0.0)
            elif law.kind == 'cubic':
                target = (3 * law.size * angle ** 2, 0.0)
            else:
                target = (0.0, law.size * math.sqrt(2 / math.pi) / speed)
            extra[law.hinge] = tuple((a + b) / 2 for a, b in zip(extra[law.hinge], target))
        system = _with(base, extra, rows)
        if all(np.allclose(extra[h], before[h], rtol=1e-9, atol=0.0) for h in extra):
            break
    return replace(setup, system=system, laws=())


def _with(system, extra, rows):
    stiffness, damping = system.stiffness.copy(), system.damping.copy()
    for hinge, (k, c) in extra.items():
        both = np.outer(rows[hinge], rows[hinge])
        stiffness += k * both
        damping += c * both
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
