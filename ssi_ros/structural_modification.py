"""
What a change of the structure makes of the motion of its modes under the same forces.

Structural modification in modal coordinates (Avitabile, Modal Testing, 2017): one mode moved, two
that mix, eq. (147a), and all of them by one spring or mass, eq. (147b). Accelerations; spectra and
ratios of bands are means over frequencies f (b, n) [Hz] in each.
"""
import numpy as np
from ssi_ros.hermitian import matrix_power

LEAST_POWER = 1e-3      # of the stronger force on two modes
ROUNDS = 40             # of alternating least squares
RIDGE = 1e-9            # of the trace of an information matrix


def response(f, frequencies_hz, damping_ratios):
    """Return the acceleration of modes under a force of fixed level; arrays are broadcast."""
    return f ** 2 / (frequencies_hz ** 2 - f ** 2 + 2j * damping_ratios * frequencies_hz * f)


def moved_mode(f, before, after):
    """
    Return the logarithm of what a mode makes of itself in each band, (b,), eq. (147).

    `before` and `after` are frequency [Hz] and damping ratio.
    """
    one, two = response(f, *before), response(f, *after)
    power = np.mean(np.abs(two) ** 2, axis=1) / np.mean(np.abs(one) ** 2, axis=1)
    # modes that one force excites add up by their phases
    return np.log(power) / 2 + 1j * np.angle(np.mean(two * one.conj(), axis=1))


class TwoModes:
    """Two close modes, of frequencies [Hz] and damping ratios (2,), that a change may mix."""

    def __init__(self, f, frequencies_hz, damping_ratios, motion):
        """Take frequencies (b, n) and the spectrum of the motion of both modes, (b, 2, 2)."""
        self.f0, self.xi, self.f = frequencies_hz, damping_ratios, f[..., None]
        before = 1 / (self.f0 ** 2 - self.f ** 2 + 2j * self.f * self.xi * self.f0)
        passed = np.mean(before[..., :, None] * before[..., None, :].conj(), axis=1)
        acting = _force(motion, passed)
        self.acting = np.linalg.cholesky(acting)
        self.root = matrix_power(passed * acting, 0.5)
        self.back = np.linalg.inv(self.root)

    def ratio(self, stiffness, force, loss):
        """
        Return what the motion is multiplied by, (b, 2, 2), eq. (147a).

        `stiffness` (2, 2) is relative to both; what moved more takes another force and another
        damping, logarithms. Of all filters that turn the power of both in a band into the power
        after it, this is the nearest to none.
        """
        f0, xi, f = self.f0, self.xi, self.f
        sizes, turn = np.linalg.eigh(stiffness)
        moved = turn[:, np.argmax(np.abs(np.log(np.maximum(sizes, 1e-12))))]
        moved = np.outer(moved, moved)
        lost = (np.eye(2) + np.expm1(loss) * moved) * np.sqrt(np.outer(xi * f0, xi * f0))
        push = np.eye(2) + np.expm1(force / 2) * moved
        # the inverse of so small a matrix, written out, takes a fifth of the time
        f, stiff, (one, two) = f[..., 0], stiffness * np.outer(f0, f0), push @ self.acting
        a, b, d = (stiff[i, j] + 2j * lost[i, j] * f - f ** 2 * (i == j)
                   for i, j in ((0, 0), (0, 1), (1, 1)))
        scale = 1 / (a * d - b * b)
        after = np.stack([np.hstack([scale * (d * u - b * v) for u, v in zip(one, two)]),
                          np.hstack([scale * (a * v - b * u) for u, v in zip(one, two)])], axis=1)
        there = after @ after.conj().swapaxes(-1, -2) / f.shape[1]
        return self.back @ matrix_power(self.root @ there @ self.root, 0.5) @ self.back


def _force(motion, passed):
    """Return the spectrum of the forces on two modes, (2, 2), that their motion shows best."""
    force = np.sum(motion * passed.conj(), axis=0) / np.sum(np.abs(passed) ** 2, axis=0)
    values, vectors = np.linalg.eigh((force + force.conj().T) / 2)
    return (vectors * np.maximum(values, LEAST_POWER * values.max())) @ vectors.conj().T


class LocalChange:
    """All modes, (m,), where a spring, mass or damper changes; what becomes of one's motion."""

    def __init__(self, f, frequencies_hz, damping_ratios, mode):
        """Take frequencies (b, n) at which `mode` moves."""
        f0, self.mode, self.f = frequencies_hz, mode, f
        # of unit stiffness
        self.response = response(f[..., None], f0, damping_ratios) * (f0 / f[..., None]) ** 2
        power = np.abs(self.response[..., mode]) ** 2
        self.weight = power / power.sum(axis=1, keepdims=True)

    def ratio(self, acts, reached, angle=0.0, hz=np.inf):
        """
        Return what all modes do beside the motion of this one, (b, m), eq. (147b).

        The stiffness changes by u v^T: u (m,) is how what is added acts on each mode, v (m,) how
        far each mode reaches it. A damper turns it by an `angle` [rad], pi / 2 of it alone, at
        `hz` as large as a spring. The entry of this mode is the logarithm of its own ratio.
        """
        k, turned = self.mode, self.turned(angle, hz)
        left = turned / (1 + turned * (self.response @ (acts * reached)))
        found = -acts * reached[k] * ((self.weight * left)[:, None] @ self.response)[:, 0]
        own = 1 - acts[k] * reached[k] * self.response[..., k] * left
        found[:, k] = (np.log(np.sum(np.abs(own) ** 2 * self.weight, axis=1)) / 2
                       + 1j * np.angle(1 + found[:, k]))
        return found

    def turned(self, angle, hz):
        """Return the stiffness of a unit spring that has a damper beside it, (b, n)."""
        return np.cos(angle) + 1j * np.sin(angle) * self.f / hz


def rank_one(score, information):
    """
    Return u and v (m,) of the likeliest matrix u v^T, and its gain of log likelihood.

    Score (m, m) and information (m, m, m, m) are of all entries of the matrix; u and v follow by
    alternating least squares from the columns of the likeliest matrix without that limit.
    """
    m, best = len(score), (0.0, np.zeros(len(score)), np.zeros(len(score)))
    flat = information.reshape(m * m, m * m)
    free = _solved(flat, score.ravel(), 1e3 * RIDGE).reshape(m, m)
    gains = np.diag(free) ** 2 * np.diag(np.diag(flat).reshape(m, m))
    for k in np.argsort(-gains)[:3]:
        if not gains[k] > 0.0:
            continue
        v = np.clip(free[k] / free[k, k], -5.0, 5.0)
        for _ in range(ROUNDS):
            u = _solved(np.einsum('ikjl,k,l->ij', information, v, v), score @ v)
            v = _solved(np.einsum('ikjl,i,j->kl', information, u, u), u @ score)
            v, u = v / (v[k] or 1.0), u * (v[k] or 1.0)
        gain = u @ score @ v - np.einsum('ikjl,i,k,j,l', information, u, v, u, v) / 2
        if gain > best[0]:
            best = gain, u, v
    return best[1], best[2], best[0]


def _solved(matrix, right, ridge=RIDGE):
    return np.linalg.solve(matrix + (ridge * np.trace(matrix) or 1.0) * np.eye(len(right)), right)
