"""
How a sampled system changes with its matrices, to first order, for many changes at once.

Modal coordinates turn a change of the state matrix into changes of poles, its diagonal, and of
eigenvectors, the rest over differences of poles: eq. (166) of docs/theory-gap.md.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.model.system import in_modes, undamped_modes

APART = 1e-9            # relative: nearer poles are one, whose vectors no first order turns


@dataclass(frozen=True, eq=False)
class Tangent:
    """
    A sampled system and p changes of it; of each pair of poles one is kept, with weight 2.

    z(k+1) = poles z(k) + b u(k), y = Re(c weight z) + d u; the changes have one more axis in
    front.
    """

    poles: np.ndarray       # (n,)
    weight: np.ndarray      # (n,), 1 of a real pole
    b: np.ndarray           # (n, m)
    c: np.ndarray           # (l, n)
    d: np.ndarray           # (l, m)
    of_poles: np.ndarray    # (p, n)
    of_b: np.ndarray        # (p, n, m)
    of_c: np.ndarray        # (p, l, n)
    of_d: np.ndarray        # (p, l, m)


def tangent(system, mass, damping, stiffness, sensor, forces):
    """
    Return the Tangent of a System for p changes of its matrices.

    Parameters
    ----------
    system : System
        Without filters before and behind, its freedoms held as `System.plant` has them.
    mass, damping, stiffness : ndarray, shape (p, n, n)
        Changes of the matrices.
    sensor : ndarray, shape (p, l, n)
        Changes of the rows of the channels.
    forces : ndarray, shape (p, n, m)
        Changes of the input matrix.

    Returns
    -------
    Tangent

    """
    if system.turned:
        # the states of its plant are modes; they are a choice of coordinates, the same of a
        # system and of all its changes
        shapes, system = undamped_modes(system)[1], in_modes(system)
        mass, damping, stiffness = (shapes.T @ m @ shapes for m in (mass, damping, stiffness))
        sensor, forces = sensor @ shapes, shapes.T @ forces
    positions, speeds = system.acting
    n, rate_hz = len(positions), system.rate_hz
    inverse = np.linalg.inv(system.mass)
    acceleration = -inverse @ np.hstack([system.stiffness[:, positions],
                                         system.damping[:, speeds]])
    feed = inverse @ system.input
    to_state = np.concatenate([stiffness[:, :, positions], damping[:, :, speeds]], axis=2)
    of_acceleration = -inverse @ (to_state + mass @ acceleration)
    of_feed = inverse @ (forces - mass @ feed)
    of_c = sensor @ acceleration + system.sensor @ of_acceleration
    of_d = sensor @ feed + system.sensor @ of_feed
    for i, kind in enumerate(system.kinds):
        if kind != 'acceleration':
            at, first = (speeds, n) if kind == 'velocity' else (positions, 0)
            of_c[:, i], of_d[:, i] = 0.0, 0.0
            of_c[:, i, first + np.arange(len(at))] = sensor[:, i, at]
    values, vectors, back = system.plant.diagonal
    keep = values.imag >= 0
    values, vectors, back = values[keep], vectors[:, keep], back[keep]
    pair = values.imag > 0
    c, b, into = system.plant.c @ vectors, back @ system.plant.b, back[:, n:]
    # towards each vector, and towards its conjugate
    moved = _by_complex(of_acceleration[:, speeds], vectors)
    real = _by_complex(np.ascontiguousarray(into.real), moved)
    imag = _by_complex(np.ascontiguousarray(into.imag), 1j * moved)
    own, other = real + imag, real - imag
    of_values = np.einsum('pii->pi', own).copy()
    own *= _over(values[None, :] - values[:, None], values)
    other *= _over(values[None, :] - values[:, None].conj(), values)
    of_b = (_by_complex(of_feed[:, speeds].swapaxes(1, 2), into.T).swapaxes(1, 2) - own @ b
            - (other @ (pair[:, None] * b)).conj())
    of_c = _by_complex(of_c, vectors) + c @ own + (pair * c.conj()) @ other
    step = values / rate_hz
    poles, held = np.exp(step), np.expm1(step) / values
    of_held = (poles / rate_hz - held) / values * of_values
    return Tangent(poles, 1.0 + pair, held[:, None] * b, c, system.plant.d,
                   poles / rate_hz * of_values,
                   held[:, None] * of_b + of_held[:, :, None] * b, of_c, of_d)


def _by_complex(real, other):
    """Return a real (..., n) times a complex (n, h) matrix, as a product of real ones."""
    return (real @ np.ascontiguousarray(other).view(float)).view(complex)


def _over(away, values):
    """Return the reciprocals of differences of poles, zero where two are one."""
    near = np.abs(away) <= APART * np.abs(values).max()
    return np.where(near, 0.0, 1 / np.where(near, 1.0, away))
