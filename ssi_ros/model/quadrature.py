"""
State spaces of other people as modes: z' = lambda z + (B + j G) u, y = Re((S + j T) z) + D u.

The poles are kept as a mass of 1, damping and stiffness of each mode, B and S as input and sensor
of a `System`, so that what changes these numbers works on it too. What they cannot hold, the part
a quarter of a period behind and what does not vibrate, is a `Quadrature`.
"""
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ssi_ros.model.statespace import StateSpace, WORST_CONDITION

UNSEEN = 1e-9           # of the largest residue: a pole with less is in no channel
VANISHED = 40.0         # decay over a sample, in nepers, of a pole at 0: gone by the next sample
ON_CIRCLE = 1e-9        # a pole that decays by less in a sample, or a radian, does not decay


@dataclass(frozen=True, eq=False)
class Quadrature:
    """
    What a state space is beside a mass, damping and stiffness of its modes.

    Attributes
    ----------
    input : ndarray, shape (n, m)
        G, the imaginary part of what inputs do to the modes.
    shapes : ndarray, shape (l, n)
        T, the imaginary part of what channels show of them.
    rest : StateSpace
        Real poles and direct feedthrough.

    """

    input: np.ndarray       # noqa: A003
    shapes: np.ndarray
    rest: StateSpace

    def plant(self, system):
        """Return the state space of a system that has this part; ValueError if it was joined."""
        for matrix in (system.mass, system.damping, system.stiffness):
            if np.any(matrix != np.diag(np.diag(matrix))):
                raise ValueError('the modes of a state space cannot be joined by masses, dampers '
                                 'and springs; give the model by its matrices')
        mass = np.diag(system.mass)
        square, decay = np.diag(system.stiffness) / mass, -np.diag(system.damping) / mass / 2
        if np.any(square <= decay ** 2):
            raise ValueError('a mode of the state space is damped so much that it does not '
                             'vibrate; lower the damping')
        decay, omega = np.diag(decay), np.diag(np.sqrt(square - decay ** 2))
        rest, names = self.rest, system.dofs
        return StateSpace(
            block_diag(np.block([[decay, -omega], [omega, decay]]), rest.a),
            np.vstack([system.input, self.input, rest.b]),
            np.hstack([system.sensor, -self.shapes, rest.c]), rest.d,
            names + tuple(f'{n}_quadrature' for n in names) + rest.states)


def modes_of(a, b, c, d, rate_hz=None):
    """
    Turn a state space into modes.

    Parameters
    ----------
    a, b, c, d : ndarray, shapes (n, n), (n, m), (l, n), (l, m)
        Of x' = a x + b u, or with `rate_hz` of x(k + 1) = a x(k) + b u(k); y = c x + d u.
    rate_hz : float, optional
        Rate of a sampled state space [Hz]. The result is the continuous one that gives it where
        inputs are held over a sample, eq. (21).

    Returns
    -------
    eigenvalues : ndarray, shape (modes,), complex, [rad/s]
        Of positive imaginary part, by rising modulus.
    shapes : ndarray, shape (l, modes), complex
        S + j T.
    input : ndarray, shape (modes, m), complex
        B + j G.
    rest : StateSpace
        Real poles and direct feedthrough.

    Raises
    ------
    ValueError
        If it is not stable, has no mode, or no continuous system gives it.

    """
    values, right = np.linalg.eig(a)
    condition = np.linalg.cond(right)
    if not condition < WORST_CONDITION:
        raise ValueError(f'the modes of a are not independent (condition {condition:.1e} of its '
                         'eigenvectors): two poles coincide; give a minimal state space')
    into, out = np.linalg.solve(right, b.astype(complex)), c @ right
    size = np.linalg.norm(into, axis=1) * np.linalg.norm(out, axis=0)
    growth = np.abs(values) - 1 if rate_hz else values.real / np.maximum(np.abs(values), 1e-300)
    kept = (size > UNSEEN * size.max(initial=0.0)) | (growth > ON_CIRCLE)
    values, into, out, growth = values[kept], into[kept], out[:, kept], growth[kept]
    if np.any(growth >= -ON_CIRCLE if rate_hz is None else growth >= 0.0):
        worst = values[np.argmax(growth)]
        raise ValueError(f'the state space is not stable: a has the eigenvalue {worst:.6g}, but '
                         + ('all must be inside the unit circle' if rate_hz else
                            'all must have a negative real part')
                         + '; hold what drifts, or measure its acceleration')
    if rate_hz:
        values, into = _continuous(values, into, rate_hz)
    pairs = np.flatnonzero(values.imag > 0.0)
    pairs = pairs[np.argsort(np.abs(values[pairs]))]
    real = np.flatnonzero(values.imag == 0.0)
    if not len(pairs):
        raise ValueError('the state space has no mode that vibrates in a channel; at least one '
                         'pair of complex poles is needed')
    shapes, into_pairs = 2 * out[:, pairs], into[pairs]
    # both factors alike in size, and shapes as nearly real as they can be
    size = np.sqrt(np.linalg.norm(into_pairs, axis=1) / np.linalg.norm(shapes, axis=0))
    turn = np.exp(0.5j * np.angle((shapes ** 2).sum(axis=0)))
    shapes, into_pairs = shapes * size / turn, into_pairs * (turn / size)[:, None]
    rest = StateSpace(np.diag(values[real].real), into[real].real, out[:, real].real, d,
                      tuple(f'real_{i + 1}' for i in range(len(real))))
    return values[pairs], shapes, into_pairs, rest


def _continuous(values, into, rate_hz):
    """Return poles and inputs of the continuous system that gives a sampled one, eq. (21)."""
    negative = values[(values.imag == 0.0) & (values.real < -1e-6)]
    if len(negative):
        raise ValueError(f'a has the eigenvalue {negative[0].real:.4g}: it alternates from sample '
                         'to sample, which no continuous system does; give the continuous state '
                         'space, or one of a higher rate')
    gone = np.abs(values) < np.exp(-VANISHED)
    step = np.where(gone, -VANISHED, np.log(np.where(gone, 1.0, values.astype(complex))))
    held = np.expm1(step) / step / rate_hz
    return step * rate_hz, into / held[:, None]
