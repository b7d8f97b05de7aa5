"""
Nonlinear hinges as the linear ones that come nearest, eq. (96).

The torque of a hinge is found along a made-up motion that has the spectrum of the linear system,
and what of it follows angle, speed and the jolts of the load is put into that system, again and
again until both agree. The rest of the torque becomes a noise of its own.
"""
from dataclasses import dataclass, replace
from functools import lru_cache

from numba import njit
import numpy as np

from ssi_ros.model.excitation import columns
from ssi_ros.model.nonlinear import torques

ROUNDS = 30
ENOUGH = 1e-6           # relative change of an equivalent hinge at which it stands
LENGTH = 1 << 15        # samples of the motion; their phases are always the same
FINER = 4               # steps a sample for a law with memory
SEED = 1


@dataclass(frozen=True)
class Rattle:
    """What a hinge does that follows nothing: a white torque, at the level of a part."""

    input: str              # noqa: A003
    rms: float
    name: str

    def covariance(self, rate_hz, inputs):
        """Return the covariance of one sample of the inputs, (m, m)."""
        values = np.zeros((len(inputs), len(inputs)))
        (where,) = columns((self.input,), inputs)
        values[where, where] = self.rms ** 2
        return values


def linearise(setup):
    """
    Return the setup with every hinge law replaced by its equivalent linear hinge.

    Statistical linearisation (Caughey, J. Acoust. Soc. Am. 35, 1963), by regression along a
    Gaussian motion of the modes, so that a law with memory, such as friction that sticks, has
    its stiffness and its damping from the same place, mode by mode.
    """
    if not setup.laws:
        return setup
    base, system = setup.system, setup.system
    hinges = [_Hinge(base, law) for law in setup.laws]
    covariance = sum(setup.powers.get(p.name, 1.0) * p.covariance(base.rate_hz, base.inputs)
                     for p in base.excitation)
    # What jolts the hinges takes the rest of their torque along when its level changes.
    loudest = max(base.excitation, key=lambda p: sum(
        h.jolts @ p.covariance(base.rate_hz, base.inputs) @ h.jolts for h in hinges)).name
    at, before = np.zeros((len(hinges), 2, len(base.dofs))), None
    for _ in range(ROUNDS):
        sampled = system.plant.discrete(base.rate_hz)
        found = [h.follow(sampled, covariance, system) for h in hinges]
        off = np.array([f[0] for f in found]) - at
        if np.all(np.abs(off) <= ENOUGH * np.abs(at).max(axis=-1, keepdims=True)):
            break
        step = off / 2
        if before is not None:
            # secant: the root of what is off, as if each number minded only itself
            moved, change = before
            slope = np.where(moved != 0.0, (off - change) / np.where(moved, moved, 1.0), -2.0)
            step = np.where(slope < -0.1, -off / np.minimum(slope, -0.1), off / 2)
        before, at = (step, off), at + step
        system = base
        for hinge, shares in zip(hinges, at):
            system = hinge.put(system, *shares)
    lags = ()
    for hinge, (_, jolt, rest) in zip(hinges, found):
        rest /= np.sqrt(setup.powers.get(loudest, 1.0))
        system = hinge.leave(system, jolt, Rattle(hinge.law.hinge, float(rest), loudest))
        lags += (hinge.lag(system, jolt),)
    return replace(setup, system=system, laws=(), lags=lags)


class _Hinge:
    """One hinge of a system: how modes, loads and its torque turn it."""

    def __init__(self, system, law):
        self.law = law
        column = system.input[:, system.inputs.index(law.hinge)]
        give = system.dofs.index(law.hinge.removesuffix('_hinge') + '_give')
        self.modes = np.where(np.arange(len(column)) == give, 0.0, column)      # rad by freedom
        each = column[give] / system.stiffness[give, give]
        self.give = each * column[give]                                         # rad/(N m)
        self.jolts = each * system.input[give]                                  # rad by input
        self.jolts[system.inputs.index(law.hinge)] = 0.0
        modes = np.flatnonzero(self.modes)
        self.bands = ((modes, 0.0, np.inf),)
        # What has no memory answers all of a Gaussian motion alike (Bussgang 1952).
        if law.kind == 'friction':
            modes = modes[np.argsort(np.diag(system.stiffness)[modes])]
            own = np.sqrt(np.diag(system.stiffness)[modes])                     # rad/s
            edges = np.concatenate([[0.0], np.sqrt(own[1:] * own[:-1]), [np.inf]])
            self.bands = tuple(zip(modes, edges[:-1], edges[1:]))

    def follow(self, sampled, covariance, system):
        """Return stiffness and damping by mode, (2, n), share of the jolts, rms of the rest."""
        finer = FINER if self.law.kind == 'friction' else 1
        lines, omega = self._motion(sampled, covariance, system, finer)
        jolts = np.sqrt(self.jolts @ covariance @ self.jolts) * np.repeat(_chance()[0], finer)
        torque = torques(self.law, np.fft.irfft(lines) + jolts, self.give)
        answer = np.fft.rfft(torque)
        both, power = answer * lines.conj(), np.abs(lines) ** 2
        shares, rest = np.zeros((2, len(self.modes))), answer.copy()
        for modes, start, stop in self.bands:
            band = slice(*np.searchsorted(omega, (start, stop)))
            w, p, c = omega[band], power[band], both[band]
            stiffness, damping = -c.real.sum() / p.sum(), 0.0
            if finer > 1:
                stiffness = max(stiffness, 0.0)
                damping = max(-(w * c.imag).sum() / (w ** 2 * p).sum(), 0.0)
            shares[0, modes], shares[1, modes] = stiffness, damping
            rest[band] += (stiffness + 1j * w * damping) * lines[band]
        rest = np.fft.irfft(rest)
        jolt = 0.0 if not jolts.any() else -(rest @ jolts) / (jolts @ jolts)
        rest = (rest + jolt * jolts).reshape(LENGTH, finer).mean(axis=1)
        return shares, jolt, rest.std()

    def put(self, system, stiffness, damping):
        """Return the system with stiffness and damping about the hinge, each by mode."""
        stiff, damp = (self.modes * np.sqrt(np.abs(s)) for s in (stiffness, damping))
        sign = -1.0 if self.law.kind == 'freeplay' else 1.0
        return replace(system, stiffness=system.stiffness + sign * np.outer(stiff, stiff),
                       damping=system.damping + np.outer(damp, damp))

    def leave(self, system, jolt, rest):
        """Return the system with what jolts and the rest of the torque do to it."""
        return replace(
            system, input=system.input - jolt * np.outer(self.modes, self.jolts),
            excitation=system.excitation + (rest,))

    def lag(self, system, jolt):
        """Return row and column of what of the torque the channels feel a sample late."""
        row = -jolt * self.jolts
        row[system.inputs.index(self.law.hinge)] = 1.0
        return row, system.sensor @ np.linalg.solve(system.mass, self.modes)

    def _motion(self, sampled, covariance, system, finer):
        """Return the lines of the angle that the modes give, and their frequencies [rad/s]."""
        states = {name: i for i, name in enumerate(system.plant.states)}
        row = np.zeros(len(states))
        for dof, turn in zip(system.dofs, self.modes):
            if turn:
                row[states[dof]] = turn
        variance = sampled.state_covariance(covariance)
        weights = (row @ sampled.vectors) * (sampled.inverse @ variance @ row) * sampled.weight
        power = _power(sampled.poles, sampled.poles * weights, row @ variance @ row, LENGTH)
        lines = np.zeros(LENGTH * finer // 2 + 1, complex)
        lines[1:len(power)] = (np.sqrt(power) * _chance()[1])[1:]
        scale = np.sqrt(row @ variance @ row) / np.fft.irfft(lines).std()
        return scale * lines, 2 * np.pi * np.arange(len(lines)) * system.rate_hz / LENGTH


@lru_cache
def _chance():
    """Return the jolts, unit variance, and the phases of all motions."""
    return (np.random.default_rng(SEED).standard_normal(LENGTH),
            np.exp(2j * np.pi * np.random.default_rng(SEED + 1).random(LENGTH // 2)))


@njit(cache=True, fastmath=True, error_model='numpy')
def _power(poles, weights, variance, length):
    """
    Return the spectrum of R(m) = Re sum_s weight_s pole_s^(m - 1), R(0) = variance, (length / 2,).

    A radius above 1 makes every peak as wide as the lines are apart.
    """
    power, radius = np.empty(length // 2), np.exp(np.pi / length)
    for k in range(len(power)):
        turn = 2 * np.pi * k / length
        x, y = radius * np.cos(turn), radius * np.sin(turn)
        total = variance
        for pole, weight in zip(poles, weights):
            # weight / (x + jy - pole) and that of the conjugates, over one denominator
            twice, square = 2 * pole.real, pole.real ** 2 + pole.imag ** 2
            below = x * x - y * y - twice * x + square
            beside = 2 * x * y - twice * y
            top = weight.real * x - weight.real * pole.real - weight.imag * pole.imag
            total += 2 * (top * below + weight.real * y * beside) / (below ** 2 + beside ** 2)
        power[k] = max(total, 0.0)
    return power
