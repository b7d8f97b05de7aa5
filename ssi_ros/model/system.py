"""
A linear system with its excitation and its sensor chain: the noun that the model hands on.

M X'' + D X' + K X = B u and y = S X'' (or S X', S X), eq. (16) and (17) of docs/theory.md.
"""
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

from ssi_ros.model.statespace import StateSpace
from ssi_ros.records import read_only

MEASURED = ('displacement', 'velocity', 'acceleration')     # by the number of derivatives
RIGID = 1e-11           # of the largest: a smaller stiffness or damping is a rounding error


@dataclass(frozen=True, eq=False)
class System:
    """
    Structure, excitation, sensor chain and sampling of what is simulated.

    Attributes
    ----------
    mass, damping, stiffness : ndarray, shape (n, n)
        M, D, K in SI units of the freedoms.
    input : ndarray, shape (n, m)
        B, from inputs to forces on the freedoms.
    sensor : ndarray, shape (l, n)
        S, from freedoms to what the channels measure.
    dofs, inputs, channels : tuple of str
        Names of the freedoms, of the inputs and of the channels.
    excitation : tuple
        Parts that add up to u, see `excitation.py`.
    chain : tuple
        Stages that the measured values pass through in order, see `sensors.py`.
    rate_hz : float
        Sampling rate [Hz].
    measured : str or tuple of str
        'acceleration', y = S X'', 'velocity', y = S X', or 'displacement', y = S X; one for all
        channels, or one a channel.
    quadrature : Quadrature or None
        Of a system that came as a state space: its freedoms are complex modes.
    shaping : StateSpace or None
        Filter that the whole excitation passes before it acts, eq. (24).
    conditioning : StateSpace or None
        Analogue filter that the channels pass before they are sampled.
    fitted : bool
        Whether errors of the model were fitted to a recording: they may have moved a mode, which
        nothing in it shows, above half of the rate.

    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    input: np.ndarray       # noqa: A003  (the name that the export promises)
    sensor: np.ndarray
    dofs: tuple
    inputs: tuple
    channels: tuple
    excitation: tuple = ()
    chain: tuple = ()
    rate_hz: float = 100.0
    measured: str = 'acceleration'
    quadrature: object = None
    shaping: StateSpace = None
    conditioning: StateSpace = None
    fitted: bool = False

    def __post_init__(self):
        for f in fields(self):
            if isinstance(getattr(self, f.name), np.ndarray):
                object.__setattr__(self, f.name, read_only(getattr(self, f.name)))
        n, m, channels = len(self.dofs), len(self.inputs), len(self.channels)
        for name, shape in (('mass', (n, n)), ('damping', (n, n)), ('stiffness', (n, n)),
                            ('input', (n, m)), ('sensor', (channels, n))):
            if getattr(self, name).shape != shape:
                raise ValueError(f'{name} has shape {getattr(self, name).shape}, but the names of '
                                 f'freedoms, inputs and channels ask for {shape}')
        if len(self.kinds) != channels or not set(self.kinds) <= set(MEASURED):
            raise ValueError(f'measured={self.measured!r} must be one of {", ".join(MEASURED)}, '
                             f'or one of them for each of the {channels} channels')
        for name, matrix in (('mass', self.mass), ('stiffness', self.stiffness)):
            _symmetric(name, matrix, self.dofs)
        least = np.linalg.eigvalsh(self.mass)[0]
        if least <= 0.0:
            raise ValueError(f'the mass matrix has the eigenvalue {least:g}; it must be positive '
                             'definite: look for a negative mass, or more modes than the mass of '
                             'the arrays can carry')
        low, high = np.linalg.eigvalsh(self.stiffness)[[0, -1]]
        if low < -1e-9 * max(high, 1.0):
            raise ValueError(f'the stiffness matrix has the eigenvalue {low:g}; it must not be '
                             'negative: look for a negative stiffness')

    @property
    def kinds(self):
        """Return what every channel measures, one of MEASURED each."""
        return ((self.measured,) * len(self.channels) if isinstance(self.measured, str)
                else self.measured)

    @cached_property
    def state_space(self):
        """Return the minimal state space with the filters before and behind, eq. (18)."""
        space = self.plant if self.shaping is None else self.shaping.then(self.plant)
        return space if self.conditioning is None else space.then(self.conditioning)

    @cached_property
    def turned(self):
        """Whether the plant has modes as its states: something moves as a rigid body."""
        return self.quadrature is None and _moves_freely(self.stiffness)

    @cached_property
    def plant(self):
        """Return the minimal continuous state space of the structure alone, eq. (18)."""
        if self.quadrature is not None:
            return self.quadrature.plant(self)
        if self.turned:
            return in_modes(self).plant
        factor = cho_factor(self.mass)
        positions, speeds = self.acting
        to_state = np.hstack([self.stiffness[:, positions], self.damping[:, speeds]])
        acceleration = -cho_solve(factor, to_state)
        feed = cho_solve(factor, self.input)
        n, k = len(positions), len(speeds)
        a = np.zeros((n + k, n + k))
        a[np.arange(n), n + np.searchsorted(speeds, positions)] = 1.0
        a[n:] = acceleration[speeds]
        b = np.vstack([np.zeros((n, len(self.inputs))), feed[speeds]])
        c, d = self.sensor @ acceleration, self.sensor @ feed
        for i, kind in enumerate(self.kinds):
            if kind != 'acceleration':
                c[i], d[i] = 0.0, 0.0
                at, first = (speeds, n) if kind == 'velocity' else (positions, 0)
                c[i, first + np.arange(len(at))] = self.sensor[i, at]
        # Scales that make the stored energy the norm of the state keep its eigenvectors sound.
        scale = np.concatenate([
            np.sqrt(np.maximum(np.diag(self.stiffness)[positions], 1e-12)),
            np.sqrt(np.diag(self.mass)[speeds])])
        names = tuple(self.dofs[i] for i in positions) + tuple(
            self.dofs[i] + '_rate' for i in speeds)
        return StateSpace(a, b, c, d, names, scale=scale)

    @cached_property
    def acting(self):
        """
        Return the freedoms that act by their position and those that act by their speed.

        A freedom without stiffness does not act by its position (the attitude of the hub), and
        one also without damping not by its speed: leaving those out keeps the state bounded.
        """
        positions = self._acting(self.stiffness, 'displacement')
        return positions, np.union1d(positions, self._acting(self.damping, 'velocity'))

    def _acting(self, matrix, kind):
        """Return the freedoms that act by a matrix, or that a channel of a kind reads."""
        read = self.sensor[[k == kind for k in self.kinds]].any(axis=0)
        return np.flatnonzero(matrix.any(axis=0) | read)

    def transfer(self, frequencies_hz, rate_hz=None, inputs=slice(None)):
        """
        Return the transfer function from inputs to every channel, eq. (19) and (22).

        Parameters
        ----------
        frequencies_hz : ndarray, shape (f,), [Hz]
            Where to evaluate it.
        rate_hz : float, optional
            Rate at which inputs are held and outputs sampled [Hz]. With it the result is the
            exact discrete transfer function of what `simulate` computes, aliases included;
            without, the continuous H(j omega). They differ by the hold, which takes 7 % of the
            amplitude at a fifth of the rate.
        inputs : slice or list of int
            Which of the m inputs; all if not given.

        Returns
        -------
        ndarray, shape (f, l, m), complex

        """
        space = self.state_space
        s = 2j * np.pi * np.atleast_1d(np.asarray(frequencies_hz, dtype=float))
        if rate_hz is None:
            return space.response(s, inputs)
        return space.discrete(rate_hz).response(np.exp(s / rate_hz), inputs)


@dataclass(frozen=True, eq=False)
class NaturalModes:
    """
    Vibration modes of a system, by rising frequency.

    Attributes
    ----------
    frequencies_hz : ndarray, shape (n,), [Hz]
        Natural frequencies |lambda| / 2 pi.
    damping_ratios : ndarray, shape (n,), [1]
        -Re(lambda) / |lambda|.
    shapes : ndarray, shape (l, n), complex, [1]
        Shapes at the channels, the largest component 1.
    eigenvalues : ndarray, shape (n,), complex, [rad/s]
        lambda, the one of each pair with positive imaginary part.

    """

    frequencies_hz: np.ndarray
    damping_ratios: np.ndarray
    shapes: np.ndarray
    eigenvalues: np.ndarray


def natural_modes(system):
    """Compute the vibration modes of a system without its filters, eq. (20)."""
    values, shapes = system.plant.modes()
    keep = np.flatnonzero(values.imag > 0)
    keep = keep[np.argsort(np.abs(values[keep]))]
    values, shapes = values[keep], shapes[:, keep]
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(len(values))]
    shapes = shapes / np.where(largest == 0, 1, largest)
    return NaturalModes(read_only(np.abs(values) / (2 * np.pi)),
                        read_only(-values.real / np.abs(values)),
                        read_only(shapes, complex), read_only(values, complex))


def undamped_modes(system):
    """Return squares of frequencies (n,) and modes of mass 1 as columns, (n, n), by frequency."""
    return eigh(system.stiffness, system.mass)


def is_held(system, row):
    """Return whether springs hold the distance that a row (n,) reads, so that it stays bounded."""
    squares, shapes = undamped_modes(system)
    share = row @ shapes
    free = squares <= RIGID * squares[-1]
    return not np.any(share[free] ** 2 > RIGID * (share @ share))


def in_modes(system):
    """
    Return a system in its undamped modes, of mass 1: freedoms mode_1, ... by rising frequency.

    What moves as a rigid body is then a freedom of its own, which acts by neither position nor
    speed, as the attitude of a hub does. Raises ValueError where the stiffness is indefinite.
    """
    squares, shapes = undamped_modes(system)
    if squares[0] < -RIGID * squares[-1]:
        raise ValueError(
            'the stiffness is indefinite: the structure buckles, as with a mode whose squared '
            f'frequency [rad^2/s^2] is {squares[0]:.3g}')
    squares = np.where(np.abs(squares) > RIGID * squares[-1], squares, 0.0)
    damping = shapes.T @ system.damping @ shapes
    damping = np.where(np.abs(damping) > RIGID * np.abs(damping).max(), damping, 0.0)
    return replace(
        system, mass=np.eye(len(squares)), damping=damping, stiffness=np.diag(squares),
        input=shapes.T @ system.input, sensor=system.sensor @ shapes,
        dofs=tuple(f'mode_{i + 1}' for i in range(len(squares))))


def _moves_freely(stiffness):
    """Return whether a combination of freedoms has no stiffness, each of which has some."""
    held = np.flatnonzero(stiffness.any(axis=0))
    scale = np.sqrt(np.maximum(np.diag(stiffness)[held], 1e-300))
    scaled = stiffness[np.ix_(held, held)] / np.outer(scale, scale)
    return len(held) > 0 and np.linalg.eigvalsh(scaled)[0] < RIGID


def _symmetric(name, matrix, dofs):
    gap = np.abs(matrix - matrix.T)
    i, j = np.unravel_index(np.argmax(gap), gap.shape)
    if gap[i, j] > 1e-9 * np.abs(matrix).max():
        raise ValueError(f'{name} is not symmetric: {matrix[i, j]:g} at ({dofs[i]}, {dofs[j]}) '
                         f'but {matrix[j, i]:g} at ({dofs[j]}, {dofs[i]})')
