"""
Nonlinear hinges as the linear ones that come nearest, eq. (96).

The torque of a hinge is computed along a simulated motion that has the spectrum of the linear
system. Its regression on angle, speed and the direct feedthrough of the load is put into that
system, again and again until both agree. The residual torque becomes a noise.
"""
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.fft import irfft, rfft

from ssi_ros.model.excitation import columns
from ssi_ros.model.joints import JointLaw
from ssi_ros.model.system import in_modes

ROUNDS = 30
CONVERGED = 1e-5        # relative change of an equivalent hinge
LENGTH = 1 << 15        # samples of the motion; their phases are always the same
FINER = 4               # steps a sample for a law with memory
SEED = 1


@dataclass(frozen=True)
class LinearisationResidual:
    """The torque of a hinge that no regressor explains: white, at the level of a part."""

    input: str  # noqa: A003
    rms: float
    name: str

    def covariance(self, rate_hz, inputs):
        """Return the covariance of one sample of the inputs, (m, m)."""
        values = np.zeros((len(inputs), len(inputs)))
        (where,) = columns((self.input,), inputs)
        values[where, where] = self.rms ** 2
        return values


def linearise(setup):
    """Return the setup with every hinge law replaced by its equivalent linear hinge."""
    # Statistical linearisation (Caughey, J. Acoust. Soc. Am. 35, 1963), by regression along a
    # Gaussian motion of the modes, so that a law with memory, such as friction that sticks, has
    # its stiffness and its damping from the same place, mode by mode.
    if not setup.laws:
        return setup
    # the shares of a law go by modes: a model whose freedoms are others is turned into its modes
    base = system = in_modes(setup.system) if isinstance(
        setup.laws[0], JointLaw) else setup.system
    hinges = [_Hinge(base, law) for law in setup.laws]
    covariance = _covariance(setup, base)
    # The residual torque has the level of the part that feeds most through to the hinges.
    loudest = max(base.excitation, key=lambda p: sum(
        h.feedthrough @ p.covariance(base.rate_hz, base.inputs) @ h.feedthrough
        for h in hinges)).name
    at, slope = setup.near or (np.zeros((len(hinges), 2, len(base.dofs))), -2.0)
    before = None
    for _ in range(ROUNDS):
        system = base
        for hinge, shares in zip(hinges, at):
            system = hinge.linear(system, *shares)
        sampled = system.plant.discrete(base.rate_hz)
        paths = [h.follow(sampled, covariance, system) for h in hinges]
        off = np.array([p.shares for p in paths]) - at
        if np.all(np.abs(off) <= CONVERGED * np.abs(at).max(axis=-1, keepdims=True)):
            break
        if before is not None:
            # secant: the root of the difference, as if each number had no influence on others
            moved, change = before
            slope = np.where(moved != 0.0, (off - change) / np.where(moved, moved, 1.0), -2.0)
        step = np.where(slope < -0.1, -off / np.minimum(slope, -0.1), off / 2)
        before, at = (step, off), at + step
    lags = ()
    for hinge, path in zip(hinges, paths):
        share, rest = hinge.residual(path)
        rest /= np.sqrt(setup.powers.get(loudest, 1.0))
        system = replace(
            system, input=system.input - share * np.outer(hinge.modes, hinge.feedthrough),
            excitation=(*system.excitation,
                        LinearisationResidual(hinge.law.hinge, float(rest), loudest)))
        lags += (hinge.lag(system, share),)
    return replace(setup, system=system, laws=(), lags=lags, near=(at, slope))


def angle_rms(setup):
    """Return the rms of the angle of the one hinge of a setup, its law left out [rad]."""
    system = setup.system
    covariance = _covariance(setup, system)
    hinge = _Hinge(system, setup.laws[0])
    lines, _ = hinge.motion(system.plant.discrete(system.rate_hz), covariance, system, 1)
    direct = hinge.feedthrough @ covariance @ hinge.feedthrough
    return float(np.sqrt(np.mean(irfft(lines, LENGTH) ** 2) + direct))


def _covariance(setup, system):
    """Return the covariance of a sample of the inputs at the powers of a setup, (m, m)."""
    return sum(setup.powers.get(p.name, 1.0) * p.covariance(system.rate_hz, system.inputs)
               for p in system.excitation)


@dataclass(frozen=True, eq=False)
class _Path:
    """A motion of a hinge: lines of angle and torque, direct feedthrough, shares by mode."""

    lines: np.ndarray
    torque: np.ndarray
    feedthrough: np.ndarray
    omega: np.ndarray
    shares: np.ndarray


class _Hinge:
    """One hinge of a system: how modes, loads and its own torque turn it."""

    def __init__(self, system, law):
        self.law = law
        column = system.input[:, system.inputs.index(law.hinge)]
        gives = np.array([d == law.hinge.removesuffix('_hinge') + '_give' for d in system.dofs])
        stiffness = np.diag(system.stiffness)
        self.modes = np.where(gives | (stiffness == 0.0), 0.0, column)          # rad by freedom
        each = np.where(gives, column / np.where(gives, stiffness, 1.0), 0.0)
        self.compliance = each @ column                                         # rad/(N m)
        self.feedthrough = each @ system.input                                  # rad by input
        self.feedthrough[system.inputs.index(law.hinge)] = 0.0
        modes = np.flatnonzero(self.modes)
        self.bands = ((modes, 0.0, np.inf),)
        # A law without memory has one gain for all of a Gaussian motion (Bussgang 1952).
        if law.kind == 'friction':
            modes = modes[np.argsort(np.diag(system.stiffness)[modes])]
            own = np.sqrt(np.diag(system.stiffness)[modes])                     # rad/s
            edges = np.concatenate([[0.0], np.sqrt(own[1:] * own[:-1]), [np.inf]])
            self.bands = tuple(zip(modes, edges[:-1], edges[1:]))

    def follow(self, sampled, covariance, system):
        """Return a motion, its torque, and stiffness and damping by mode, (2, n)."""
        finer = FINER if self.law.kind == 'friction' else 1
        lines, omega = self.motion(sampled, covariance, system, finer)
        size = np.sqrt(self.feedthrough @ covariance @ self.feedthrough)
        feedthrough = size * _held(finer)
        angle = irfft(lines, LENGTH * finer)
        torque = rfft(self.law.torques(angle + feedthrough, self.compliance))
        # the motion ends at half of the rate, the torque does not
        own = torque[:len(lines)]
        real = own.real * lines.real + own.imag * lines.imag
        imag = own.imag * lines.real - own.real * lines.imag
        power = lines.real ** 2 + lines.imag ** 2
        shares = np.zeros((2, len(self.modes)))
        for modes, start, stop in self.bands:
            band = slice(*np.searchsorted(omega, (start, stop)))
            w, p = omega[band], power[band]
            if not 0.0 < p.sum() < np.inf:
                raise ValueError(f'{self.law.hinge} does not move, or without end: what its '
                                 f'{self.law.kind} does has no linear equivalent')
            stiffness, damping = -real[band].sum() / p.sum(), 0.0
            if finer > 1:
                stiffness = max(stiffness, 0.0)
                damping = max(-(w @ imag[band]) / (w ** 2 @ p), 0.0)
            shares[0, modes], shares[1, modes] = stiffness, damping
        return _Path(lines, torque, feedthrough, omega, shares)

    def residual(self, path):
        """Return the regression of the torque on the feedthrough, and the rms of the residual."""
        rest, direct = path.torque.copy(), path.feedthrough
        for modes, start, stop in self.bands:
            band = slice(*np.searchsorted(path.omega, (start, stop)))
            stiffness, damping = path.shares[:, np.ravel(modes)[0]]
            rest[band] += (stiffness + 1j * path.omega[band] * damping) * path.lines[band]
        rest = irfft(rest, len(direct))
        share = 0.0 if not direct.any() else -(rest @ direct) / (direct @ direct)
        rest = (rest + share * direct).reshape(LENGTH, -1).mean(axis=1)
        return share, rest.std()

    def linear(self, system, stiffness, damping):
        """Return the system with stiffness and damping about the hinge, each by mode."""
        stiff, damp = (self.modes * np.sqrt(np.abs(s)) for s in (stiffness, damping))
        sign = -1.0 if self.law.kind == 'freeplay' else 1.0
        return replace(system, stiffness=system.stiffness + sign * np.outer(stiff, stiff),
                       damping=system.damping + np.outer(damp, damp))

    def lag(self, system, share):
        """Return row and column of the torque that acts on the channels one sample late."""
        row = -share * self.feedthrough
        row[system.inputs.index(self.law.hinge)] = 1.0
        column = system.sensor @ np.linalg.solve(system.mass, self.modes)
        return row, column * [k == 'acceleration' for k in system.kinds]

    def motion(self, sampled, covariance, system, finer):
        """Return the lines of the angle that the modes give, and their frequencies [rad/s]."""
        from ssi_ros.effects.power_of_poles import power_of_poles

        turns = dict(zip(system.dofs, self.modes))
        row = np.array([turns.get(name, 0.0) for name in system.plant.states])
        variance = sampled.state_covariance(covariance)
        weights = (row @ sampled.vectors) * (sampled.inverse @ variance @ row) * sampled.weight
        power = power_of_poles(sampled.poles, sampled.poles * weights, row @ variance @ row,
                               *_circle())
        power[0] = 0.0
        lines = np.sqrt(power) * _phases()
        # the variance of the series that the lines give, by Parseval
        total = 2 * power.sum()         # 0 where no input has any power
        scale = np.sqrt(row @ variance @ row / total) * LENGTH * finer if total else 0.0
        return scale * lines, 2 * np.pi * np.arange(len(lines)) * system.rate_hz / LENGTH


@lru_cache
def _phases():
    """Return the phases of all motions."""
    return np.exp(2j * np.pi * np.random.default_rng(SEED + 1).random(LENGTH // 2))


@lru_cache
def _held(finer):
    """Return a white series of unit variance, held over so many steps a sample."""
    return np.repeat(np.random.default_rng(SEED).standard_normal(LENGTH), finer)


@lru_cache
def _circle():
    """Return cosine and sine of the lines, times a radius above 1, (LENGTH / 2,) each."""
    # so that every peak is as wide as the lines are apart
    turn = 2 * np.pi * np.arange(LENGTH // 2) / LENGTH
    return np.exp(np.pi / LENGTH) * np.cos(turn), np.exp(np.pi / LENGTH) * np.sin(turn)
