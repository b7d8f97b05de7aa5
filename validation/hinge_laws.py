"""
Nonlinear hinges integrated by Runge and Kutta: none of the package's hinge code.

Mass, damping and stiffness with the angle of the hinge as a freedom are those of the package, and
so are the random forces, held over a sample. What the hinge does beside its linear stiffness is
here.
The fastest freedom of the array stands for the give of all that are left out: neither channels nor
hub feel it, as in the modes of a linear hinge.
"""
from dataclasses import dataclass
from functools import lru_cache

from numba import njit
import numpy as np
from scipy.linalg import eigh
from ssi_ros.effects.edits import change_array
from ssi_ros.model import load_spacecraft
from ssi_ros.model.excitation import begin_all, generator, total_covariance
from ssi_ros.model.structure import assemble
from ssi_ros.records import Samples

SUBSTEPS = 50, 200, 800     # of a sample: 20 a period of the fastest freedom, or what a law needs
WARM_UP_S = 150.0       # from rest: the slowest mode has decayed by e^-1.7 then, power by e^-3.4
SLIDERS = 8             # of an Iwan element
CHAIN = 6               # springs with dashpots that make a fractional derivative of order 1/2
LAWS = ('linear', 'dahl', 'lugre', 'iwan', 'smooth stop', 'hertz', 'quadratic damping',
        'root damping', 'fractional damping', 'softening spring', 'quintic spring')


@dataclass(frozen=True)
class Hinge:
    """
    A hinge at the root of an array.

    `size` is in units of the motion of the linear hinge, of rms angle a and rms speed b: friction
    torque over k a; play over a; torque of a damper at b over k a; stiffness lost or gained at a
    over k. `presliding` is the stiffness of friction before it slides, over k.
    """

    law: str
    size: float
    array: str = 'E1'
    stiffness_n_m_rad: float = 3e5
    presliding: float = 2.0


def simulate_hinge(spacecraft, hinge, duration_s, seed):
    """Return Samples of a spacecraft with a nonlinear hinge, and without its noise (n, l)."""
    numbers = np.zeros(1) if hinge.law == 'linear' else numbers_of(
        hinge, *linear_motion(hinge.array, hinge.stiffness_n_m_rad))
    system = _system(spacecraft, hinge.array, hinge.stiffness_n_m_rad)
    for parts in SUBSTEPS:
        acceleration = integrate(system, hinge.array, duration_s, seed, hinge.law, numbers, parts)
        if np.isfinite(acceleration).all():
            break
    else:
        raise ValueError(f'{hinge} is too stiff for the step; raise SUBSTEPS')
    noise = next(s for s in system.chain if s.name == 'sensor_noise').begin(
        system.rate_hz, generator(seed, 'sensor_noise'))(np.zeros_like(acceleration))
    return Samples(acceleration + noise, system.rate_hz, system.channels), acceleration


@lru_cache
def linear_motion(array, stiffness):
    """Return the rms angle [rad] and speed [rad/s] of a linear hinge of the default spacecraft."""
    system = _system(load_spacecraft(), array, stiffness)
    sampled = system.plant.discrete(system.rate_hz)
    variance = sampled.state_covariance(total_covariance(
        system.excitation, system.rate_hz, system.inputs))
    at = [system.plant.states.index(f'{array}_hinge{end}') for end in ('', '_rate')]
    return np.sqrt(np.diag(variance)[at])


def _system(spacecraft, array, stiffness):
    return assemble(change_array(spacecraft, array, hinge_n_m_rad=stiffness),
                    explicit_hinges=True)


def integrate(system, array, duration_s, seed, law, numbers, parts):
    """Return channels without noise, (n, l), in so many steps a sample."""
    before, rows = round(WARM_UP_S * system.rate_hz), round(duration_s * system.rate_hz)
    forces = begin_all(system.excitation, system.rate_hz, system.inputs, seed)(0, before + rows)
    mass, damping, stiffness, act, sensor, turn = matrices_of(system, array)
    inverse = np.linalg.inv(mass)
    acceleration = _march(
        -inverse @ stiffness, -inverse @ damping, forces @ (inverse @ act).T, inverse @ turn,
        turn, 1 / system.rate_hz, parts, LAWS.index(law), numbers)
    return (acceleration @ sensor.T)[before:]


def matrices_of(system, array):
    """Return mass, damping, stiffness, input, sensor and the row of the angle of the hinge."""
    own = [i for i, d in enumerate(system.dofs) if d.startswith(array)]
    pick, turned = np.ix_(own, own), np.eye(len(system.dofs))
    _, turned[pick] = eigh(system.stiffness[pick], system.mass[pick])
    mass, damping, stiffness = (turned.T @ m @ turned for m in (
        system.mass, system.damping, system.stiffness))
    sensor, give = system.sensor @ turned, own[-1]
    mass[give, :3] = mass[:3, give] = sensor[:, give] = 0.0
    return (mass, damping, stiffness, turned.T @ system.input, sensor,
            turned[system.dofs.index(f'{array}_hinge')])


def numbers_of(hinge, angle, speed):
    """Return the numbers that a law needs, from the rms of angle [rad] and speed [rad/s]."""
    k, size = hinge.stiffness_n_m_rad, hinge.size
    torque, sigma = size * k * angle, hinge.presliding * hinge.stiffness_n_m_rad
    if hinge.law in ('dahl', 'iwan'):
        return np.array([sigma, torque])
    if hinge.law == 'lugre':            # bristles with damping; starts at 1.4 times the torque
        return np.array([sigma, torque, 1.4 * torque, speed / 10, 1e-3 * sigma])
    if hinge.law in ('smooth stop', 'hertz'):       # play, corner, damping in contact
        return np.array([k, size * angle, 0.1 * size * angle, 0.05 * k * angle / speed, angle])
    power = {'quadratic damping': 2.0, 'root damping': 0.5}.get(hinge.law)
    if power:
        return np.array([torque / speed ** power, power, 1e-3 * speed])
    if hinge.law == 'fractional damping':
        rates = np.geomspace(0.3, 300.0, CHAIN) * speed / angle / 10
        shares = np.sqrt(rates)
        middle = speed / angle
        loss = np.sum(shares * middle / np.hypot(rates, middle) ** 2 * rates)
        return np.concatenate([rates, size * k * shares / loss])
    return np.array([k, size, angle])


@njit(cache=True)
def _torque(kind, p, angle, speed, inner, rate):
    """Return the torque of a law, and fill the rates of its inner states."""
    for i in range(len(inner)):
        rate[i] = 0.0
    if kind == 1:
        rate[0] = p[0] * speed * (1 - np.sign(speed) * inner[0] / p[1])
        return -inner[0]
    if kind == 2:
        top = (p[1] + (p[2] - p[1]) * np.exp(-(speed / p[3]) ** 2)) / p[0]
        rate[0] = speed - abs(speed) / top * inner[0]
        return -p[0] * inner[0] - p[4] * rate[0]
    if kind == 3:
        total = 0.0
        for i in range(SLIDERS):
            limit = 2 * p[1] * (i + 0.5) / SLIDERS ** 2
            total += min(max(p[0] / SLIDERS * (angle - inner[i]), -limit), limit)
        return -total
    if kind == 4 or kind == 5:
        over, sign = abs(angle) - p[1], np.sign(angle)
        if kind == 5:
            return p[0] * angle - sign * p[0] * np.sqrt(max(over, 0.0) / p[4]) * max(over, 0.0)
        x = over / p[2]
        soft = p[2] * (np.log1p(np.exp(-abs(x))) + max(x, 0.0))
        contact = 1 / (1 + np.exp(-x)) if x > -30 else 0.0
        return p[0] * angle - sign * p[0] * soft - p[3] * contact * speed
    if kind == 6 or kind == 7:
        return -p[0] * (speed ** 2 + p[2] ** 2) ** ((p[1] - 1) / 2) * speed
    if kind == 8:
        total = 0.0
        for i in range(CHAIN):
            rate[i] = speed - p[i] * inner[i]
            total -= p[CHAIN + i] * inner[i]
        return total
    if kind == 9:       # elastic, softer outside: the secant at the rms has lost the size
        u = angle / p[2]
        return p[0] * p[1] * angle * (1 / (1 + u * u) - 1)
    if kind == 10:
        return -p[0] * p[1] * angle * (angle / p[2]) ** 4
    return 0.0


@njit(cache=True, fastmath={'contract', 'reassoc', 'nsz'})
def _march(stiff, damp, drive, kick, turn, sample_s, parts, kind, p):
    """Integrate by the classical scheme of order 4; return accelerations."""
    step, (count, n) = sample_s / parts, drive.shape
    q, v, inner = np.zeros(n), np.zeros(n), np.zeros(SLIDERS)
    x, y, z, a, rate = q.copy(), q.copy(), inner.copy(), q.copy(), inner.copy()
    sums = np.zeros((2, n)), np.zeros(SLIDERS)
    out = np.empty((count, n))
    ahead, weights = (0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)
    for k in range(count):
        for part in range(parts):
            sums[0][:], sums[1][:] = 0.0, 0.0
            for s in range(4):
                w = ahead[s] * step
                for i in range(n):
                    x[i], y[i] = q[i] + w * y[i], v[i] + w * a[i]
                for i in range(SLIDERS):
                    z[i] = inner[i] + w * rate[i]
                angle, speed = 0.0, 0.0
                for i in range(n):
                    angle += turn[i] * x[i]
                    speed += turn[i] * y[i]
                torque = _torque(kind, p, angle, speed, z, rate)
                for i in range(n):
                    total = drive[k, i] + kick[i] * torque
                    for j in range(n):
                        total += stiff[i, j] * x[j] + damp[i, j] * y[j]
                    a[i] = total
                    sums[0][0, i] += weights[s] * y[i]
                    sums[0][1, i] += weights[s] * total
                for i in range(SLIDERS):
                    sums[1][i] += weights[s] * rate[i]
                if s == 0 and part == 0:
                    out[k] = a
            for i in range(n):
                q[i] += step * sums[0][0, i]
                v[i] += step * sums[0][1, i]
            for i in range(SLIDERS):
                inner[i] += step * sums[1][i]
            if kind == 3:
                angle = 0.0
                for i in range(n):
                    angle += turn[i] * q[i]
                for i in range(SLIDERS):
                    reach = 2 * p[1] * (i + 0.5) / SLIDERS / p[0]
                    inner[i] = min(max(inner[i], angle - reach), angle + reach)
    return out
