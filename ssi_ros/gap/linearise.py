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
    extra = {law.hinge: (0.0, 0.0) for law in setup.laws}
    for _ in range(ROUNDS):
        sigmas = _motion(system, extra)
        for law in setup.laws:
            angle, speed = sigmas[law.hinge]
            i = base.dofs.index(law.hinge)
            stiffness, damping = extra[law.hinge]
            if law.kind == 'freeplay':
                target = (-base.stiffness[i, i] * math.erf(law.size / (angle * math.sqrt(2))), 0.0)
                # a hinge that never leaves its play would not hold the array at all
                target = (max(target[0], -0.995 * base.stiffness[i, i]), 0.0)
            elif law.kind == 'cubic':
                target = (3 * law.size * angle ** 2, 0.0)
            else:
                target = (0.0, law.size * math.sqrt(2 / math.pi) / speed)
            extra[law.hinge] = ((stiffness + target[0]) / 2, (damping + target[1]) / 2)
        system = _with(base, extra)
    return replace(setup, system=system, laws=())


def _with(system, extra):
    stiffness, damping = system.stiffness.copy(), system.damping.copy()
    for hinge, (k, c) in extra.items():
        i = system.dofs.index(hinge)
        stiffness[i, i] += k
        damping[i, i] += c
    return replace(system, stiffness=stiffness, damping=damping)


def _motion(system, hinges):
    """Return the stationary rms of angle and speed of every hinge."""
    space = system.plant
    covariance = space.discrete(system.rate_hz).state_covariance(
        total_covariance(system.excitation, system.rate_hz, system.inputs))
    rms = dict(zip(space.states, np.sqrt(np.maximum(np.diag(covariance), 1e-40))))
    return {h: (rms[h], rms[h + '_rate']) for h in hinges}
