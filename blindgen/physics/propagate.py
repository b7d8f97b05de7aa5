# Licensed under the Apache License, Version 2.0.
"""From the matrices of a spacecraft to its state, its poles and its steps in time."""
from blindgen.physics.assemble import assemble
import numpy as np


def state_matrices(craft):
    """
    Return A (2n, 2n), B (2n, k), L (2n, m), C (c, 2n), D (c, k), E (c, m) in continuous time.

    x = [q, q']; x' = A x + B u + L f, y = C x + D u + E f: acceleration has feedthrough.
    """
    n = len(craft.mass)
    solved = np.linalg.solve(craft.mass, np.hstack(
        [-craft.stiffness, -craft.damping, craft.loads, craft.directions]))
    m = craft.loads.shape[1]
    a = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), solved[:, :2 * n]])
    b = np.vstack([np.zeros((n, m)), solved[:, 2 * n:2 * n + m]])
    ell = np.vstack([np.zeros_like(craft.directions), solved[:, 2 * n + m:]])
    out = craft.sensors @ solved
    return a, b, ell, out[:, :2 * n], out[:, 2 * n:2 * n + m], out[:, 2 * n + m:]


def propagators(a, step_s):
    """
    Return E = exp(A h), P0 and P1 of the first-order hold.

    x(h) = E x + P0 g(0) + P1 g(h) for a right-hand side g linear over the step, by the series of
    phi_1 and phi_2 on a step small enough to converge, then by doubling. phi_1 = (e^z - 1) / z,
    phi_2 = (e^z - 1 - z) / z^2.
    """
    doublings = max(0, int(np.ceil(np.log2(max(np.linalg.norm(a, np.inf) * step_s, 1e-300)))) - 1)
    doublings = min(doublings, 30)
    h = step_s / 2**doublings
    z = a * h
    identity = np.eye(len(a))
    e, phi1, phi2, term = identity.copy(), identity.copy(), identity / 2, identity.copy()
    for k in range(1, 30):
        term = term @ z / k
        e = e + term
        phi1 = phi1 + term / (k + 1)
        phi2 = phi2 + term / ((k + 1) * (k + 2))
    for _ in range(doublings):
        phi2 = (e @ phi2 + phi1 + phi2) / 4
        phi1 = (e @ phi1 + phi1) / 2
        e = e @ e
    return e, step_s * (phi1 - phi2), step_s * phi2


def frequencies(craft):
    """Return natural frequencies [Hz] and damping ratios of the oscillating modes, ascending."""
    poles = np.linalg.eigvals(state_matrices(craft)[0])
    poles = poles[poles.imag > 1e-3]
    poles = poles[np.argsort(np.abs(poles))]
    return np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)


def modes_of(scenario):
    """Return natural frequencies [Hz] and damping ratios of a scenario in mid-record."""
    return frequencies(assemble(scenario))
