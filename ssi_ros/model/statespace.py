"""
State spaces, continuous and sampled, in modal coordinates: eq. (18) to (26) of docs/theory.md.

The diagonal form makes exact discretisation, transfer functions and propagation one line each.
"""
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

SETTLES_S = 3600.0
NUTATES = 1e-3          # damping ratio below which a pole is a nutation, not a mode of an array
LEAST_TURN = 0.1        # radians in a record, from which a pole turns at all
WORST_CONDITION = 1e8       # of the eigenvectors; half of the digits of a double are left
TOGETHER = 1024         # frequencies at once, which stay in the cache


@dataclass(frozen=True, eq=False)
class StateSpace:
    """
    Continuous state space x' = A x + B u, y = C x + D u.

    Attributes
    ----------
    a, b, c, d : ndarray, shapes (n, n), (n, m), (l, n), (l, m)
        The four matrices.
    states : tuple of str
        Names of the states.
    scale : ndarray, shape (n,)
        Sizes that make the states comparable; they only serve the numerics.
    front, back : StateSpace or None
        The two spaces in series that this one was made of by `then`.

    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    states: tuple = ()
    scale: np.ndarray = None
    front: 'StateSpace' = None
    back: 'StateSpace' = None

    def then(self, back):
        """Return this space in front of another: the augmented system, eq. (25)."""
        if self.c.shape[0] != back.b.shape[1]:
            raise ValueError(f'the first of two systems in series has {self.c.shape[0]} outputs, '
                             f'but the second has {back.b.shape[1]} inputs; make them equal')
        a = np.block([[self.a, np.zeros((len(self.a), len(back.a)))],
                      [back.b @ self.c, back.a]])
        return StateSpace(a, np.vstack([self.b, back.b @ self.d]),
                          np.hstack([back.d @ self.c, back.c]), back.d @ self.d,
                          self.states + back.states, front=self, back=back)

    @cached_property
    def diagonal(self):
        """
        Eigenvalues (n,), right eigenvectors (n, n) and their inverse.

        Two spaces in series are diagonalised one at a time and joined by eq. (26), which stays
        sound when a filter repeats one pole on every input.
        """
        if self.front is not None:
            (lf, vf, wf), (lb, vb, wb) = self.front.diagonal, self.back.diagonal
            if np.min(np.abs(lf[:, None] - lb[None, :])) <= 1e-9 * np.max(np.abs(lb)):
                raise ValueError('a pole of the filter equals a pole of the system; move the '
                                 'corner of the filter a little')
            coupled = wb @ (self.back.b @ self.front.c) @ vf / (lf[None, :] - lb[:, None])
            none = np.zeros((len(lf), len(lb)))
            return (np.concatenate([lf, lb]), np.block([[vf, none], [vb @ coupled, vb]]),
                    np.block([[wf, none], [-coupled @ wf, wb]]))
        scale = np.ones(len(self.a)) if self.scale is None else self.scale
        values, vectors = np.linalg.eig(self.a * scale[:, None] / scale[None, :])
        # LAPACK gives the pair of a complex value as exact conjugates, and this keeps it so.
        try:
            inverse = np.linalg.inv(vectors)
            condition = np.linalg.norm(vectors) * np.linalg.norm(inverse)
        except np.linalg.LinAlgError:       # two vectors are one
            condition = np.inf
        if not condition < WORST_CONDITION:
            raise ValueError(f'the modes of the system are not independent (condition '
                             f'{condition:.1e} of the eigenvectors): two of its poles coincide; '
                             'change a damping, a stiffness or a controller a little')
        return values.astype(complex), vectors / scale[:, None], inverse * scale[None, :]

    def modes(self):
        """Return the eigenvalues (n,) and the shapes C v at the outputs (l, n)."""
        values, vectors, _ = self.diagonal
        return values, self.c @ vectors

    def response(self, s, inputs=slice(None)):
        """Return C (s I - A)^-1 B + D at every s, of some inputs, shape (f, l, m), eq. (19)."""
        values, vectors, inverse = self.diagonal
        return _response(values, self.c @ vectors, inverse @ self.b[:, inputs],
                         self.d[:, inputs], s)

    def lasting_hz(self, duration_s):
        """
        Return the frequencies of modes that decay more slowly than a record lasts, (m,), [Hz].

        Momentum of wheels lets a craft nutate without damping.
        """
        poles = self.diagonal[0]
        slow = (poles.imag > 0) & (-poles.real < 1 / duration_s)
        return poles.imag[slow] / (2 * np.pi)

    def discrete(self, rate_hz):
        """Return the exact sampled system for inputs held over a sample, eq. (21)."""
        values, vectors, inverse = self.diagonal
        step = values / rate_hz
        # (e^z - 1) / z by its series near 0, where the quotient loses its digits.
        small = np.abs(step) < 1e-6
        safe = np.where(small, 1.0, step)
        held = np.where(small, 1 + step / 2, np.expm1(safe) / safe) / rate_hz
        pole = np.exp(step)
        # One of each conjugate pair is enough: the real part of the sum is doubled for it.
        keep = values.imag >= 0
        weight = np.where(values.imag > 0, 2.0, 1.0)[keep]
        return Sampled(
            rate_hz=rate_hz, poles=pole[keep], weight=weight,
            b=(held[:, None] * (inverse @ self.b))[keep], c=(self.c @ vectors)[:, keep],
            d=self.d, vectors=vectors[:, keep], inverse=inverse[keep])


@dataclass(frozen=True, eq=False)
class Sampled:
    """
    Sampled system in modal coordinates, z(k+1) = poles z(k) + b u(k), eq. (21).

    y(k) = Re(c weight z(k)) + d u(k); only one of each conjugate pair is kept, with weight 2.
    `vectors` and `inverse` lead to and from the physical state.
    """

    rate_hz: float
    poles: np.ndarray
    weight: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    vectors: np.ndarray
    inverse: np.ndarray

    def with_lag(self, row, column):
        """Return the system whose outputs feel `column` (row u) a sample late, not at once."""
        return replace(
            self, poles=np.append(self.poles, 0.0), weight=np.append(self.weight, 1.0),
            b=np.vstack([self.b, row]), c=np.column_stack([self.c, column]),
            d=self.d - np.outer(column, row), vectors=np.pad(self.vectors, ((0, 0), (0, 1))),
            inverse=np.pad(self.inverse, ((0, 1), (0, 0))))

    def within(self, rows):
        """
        Return the system whose poles that turn and hardly decay settle in so many rows, eq. (23b).

        A nutation from rest grows over a record of n rows to n / 2 times what one sample excites
        in the mean, as a mode of the pole e^(-1/n) has it at all times.
        """
        factors = settling(self.poles, self.rate_hz, rows)
        return self if np.all(factors == 1.0) else replace(self, poles=self.poles * factors)

    @property
    def nutates(self):
        """Which poles (p,) turn and hardly decay."""
        turn = np.abs(np.angle(self.poles))
        return (turn > 0.0) & (1 - np.abs(self.poles) < NUTATES * turn)

    def response(self, z, inputs=slice(None)):
        """Return the transfer function of some inputs at every z = exp(j omega dt), (f, l, m)."""
        poles, c, b, _ = self._both()       # eq. (22)
        return _response(poles, c, b[:, inputs], self.d[:, inputs], z)

    def state_covariance(self, input_covariance):
        """
        Return the stationary covariance of the physical state, (n, n), eq. (23).

        A mode that takes longer than an hour to settle counts as zero, see `stationary_divisor`.
        """
        poles, _, b, vectors = self._both()
        away = stationary_divisor(poles, self.rate_hz)
        return (vectors @ ((b @ input_covariance @ b.conj().T) / away) @ vectors.conj().T).real

    def _both(self):
        """Return poles, c, b and vectors with both of each conjugate pair."""
        pair = self.weight > 1
        return (np.concatenate([self.poles, self.poles[pair].conj()]),
                np.hstack([self.c, self.c[:, pair].conj()]),
                np.vstack([self.b, self.b[pair].conj()]),
                np.hstack([self.vectors, self.vectors[:, pair].conj()]))


def settling(poles, rate_hz, rows):
    """Return the factors of poles (n,) that settle within so many rows; see `Sampled.within`."""
    lasting = _lasting(poles, rate_hz) & (np.abs(np.angle(poles)) * rows > LEAST_TURN)
    return np.where(lasting, np.exp(-1 / rows) / np.where(lasting, np.abs(poles), 1.0), 1.0)


def _lasting(poles, rate_hz):
    """Return which poles (n,) take over an hour to settle."""
    return 1 - np.abs(poles) < 1 / (SETTLES_S * rate_hz)


def stationary_divisor(poles, rate_hz, turn=1.0):
    """
    Return turn - p_i p_j^*, (n, n), by which a stationary covariance is divided, eq. (23).

    It is infinite for a pole that takes over an hour to settle: that has no stationary state on
    the time scale of a record, and counts as zero. `turn` as of eq. (95a).
    """
    slow = _lasting(poles, rate_hz)
    return np.where(slow[:, None] | slow[None, :], np.inf,
                    turn - poles[:, None] * poles.conj()[None, :])


def _response(poles, c, b, d, s):
    s, residues = np.asarray(s), (c.T[:, :, None] * b[:, None, :]).reshape(len(poles), -1)
    out = np.empty((len(s), residues.shape[1]), complex)
    for begin in range(0, len(s), TOGETHER):
        part = slice(begin, begin + TOGETHER)
        out[part] = (1.0 / (s[part, None] - poles)) @ residues
    return out.reshape(-1, *d.shape) + d


def powers_of(poles, count):
    """Return the powers 0, 1, ... of poles, shape (count, poles), as products of two tables."""
    return _powers(np.asarray(poles, complex).tobytes(), count)


@lru_cache(maxsize=1)
def _powers(poles, count):
    # every random input of a system asks for the same
    poles = np.frombuffer(poles, complex)
    logs = np.log(np.where(np.abs(poles) < 1e-300, 1e-300, poles))
    width = int(np.sqrt(count)) + 1
    fine, coarse = (np.exp(np.arange(width)[:, None] * step * logs) for step in (1, width))
    found = (coarse[:, None] * fine[None]).reshape(-1, len(poles))[:count]
    found.flags.writeable = False
    return found
