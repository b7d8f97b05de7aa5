"""
The steps of nonlinear hinges and of a turning hub, which `nonlinear.py` prepares.

Compiled by numba on first use and cached; imported by what steps, as a simulation of linear
hinges has no use for a compiler.
"""
from numba import njit
import numpy as np


@njit(cache=True)
def follow(kind, size, stiffness, angle, give):
    """Return the torque (n,) of one hinge along an angle (n,) as the loads turn it."""
    torque = np.empty(len(angle))
    before = angle[0]
    for i in range(len(angle)):
        torque[i] = _torque(kind, size, stiffness, angle[i], give, angle[i] - before, give)
        before = angle[i] + give * torque[i]
    return torque


@njit(cache=True, fastmath=True)
def march(z, poles, drive, kick, angle, speed, give, kinds, sizes, stiffness, substeps, momentum,
          inertia, inverse, turning, torques, step_s, kick_hub, gyroscopic):
    """Step through the record; return states, hinge and gyroscopic torques, and hub rates."""
    count, n = drive.shape
    hinges = len(kinds)
    states = np.empty((count, n), np.complex128)
    extra = np.zeros((count, hinges))
    gyro = np.zeros((count, 3))
    rates = np.zeros((count, 3))
    reach = np.zeros((hinges, hinges))
    reach_speed = np.zeros((hinges, hinges))
    reach_give = np.zeros(hinges)
    for i in range(hinges):
        for j in range(hinges):
            reach[i, j] = real_dot(angle[i], kick[j])
            reach_speed[i, j] = real_dot(speed[i], kick[j])
        reach_give[i] = real_dot(give[i], kick[i])
    tau = np.zeros(hinges)
    old, free, quick = np.zeros(hinges), np.zeros(hinges), np.zeros(hinges)
    given, gives = np.zeros(hinges), np.zeros(hinges)
    moment, omega, none = np.zeros(3), np.zeros(3), np.zeros(3)
    z, ahead, turning = z.copy(), z.copy(), turning.copy()
    for i in range(hinges):
        old[i] = real_dot(angle[i], z)
        given[i] = real_dot(give[i], z)
    for k in range(count):
        for s in range(n):
            states[k, s] = z[s]
        # The hinge has not moved yet when a load jumps at a sample: its torque is still the old.
        for i in range(hinges):
            extra[k, i] = tau[i]
        _hub_rate(inverse, turning, none, momentum, z, omega)
        for i in range(3):
            rates[k, i] = omega[i]
        for part in range(substeps):
            for s in range(n):
                ahead[s] = poles[s] * z[s] + drive[k, s]
            if gyroscopic:
                if part:
                    _hub_rate(inverse, turning, none, momentum, z, omega)
                _midpoint(ahead, omega, turning, torques[k], momentum, inertia, inverse, kick_hub,
                          step_s, moment)
                _pushed(ahead, moment, kick_hub, ahead)
                for i in range(3):
                    turning[i] += step_s * moment[i]
                    if part == 0:
                        gyro[k, i] = moment[i]
            for i in range(3):
                turning[i] += step_s * torques[k, i]
            for i in range(hinges):
                free[i] = real_dot(angle[i], ahead)
                gives[i] = real_dot(give[i], ahead)
                quick[i] = real_dot(speed[i], ahead) + (gives[i] - given[i]) / step_s
            for _ in range(4 if hinges > 1 else 1):      # hinges feel each other through the hub
                for i in range(hinges):
                    a, v = free[i], quick[i]
                    for j in range(hinges):
                        if j != i:
                            a += reach[i, j] * tau[j]
                            v += reach_speed[i, j] * tau[j]
                    tau[i] = _torque(kinds[i], sizes[i], stiffness[i],
                                     (old[i] + a) / 2 + gives[i],
                                     reach[i, i] / 2 + reach_give[i],
                                     v, reach_speed[i, i] + reach_give[i] / step_s)
            for i in range(hinges):
                for s in range(n):
                    ahead[s] += kick[i, s] * tau[i]
            z, ahead = ahead, z
            for i in range(hinges):
                old[i] = real_dot(angle[i], z)
                given[i] = real_dot(give[i], z)
    return states, extra, gyro, rates


@njit(cache=True)
def _torque(kind, size, stiffness, middle, give, speed, give_speed):
    """Solve the law of one hinge for its torque; `give` is motion a unit of torque."""
    if size == 0.0:
        return 0.0
    if kind == 0:       # freeplay: + k clip(alpha), which takes the linear moment away
        inside = middle / (1.0 - stiffness * give)
        return stiffness * min(max(inside, -size), size)
    if kind == 1:       # friction: stop the motion if the torque suffices
        return min(max(-speed / give_speed, -size), size)
    root = middle       # cubic: Newton on alpha + give k3 alpha^3 = middle, convex on each side
    for _ in range(50):
        change = (root + give * size * root ** 3 - middle) / (1 + 3 * give * size * root ** 2)
        root -= change
        if abs(change) <= 1e-15 * abs(root):
            break
    return -size * root ** 3


@njit(cache=True, fastmath=True)
def real_dot(row, z):
    """Return the real part of the product of complex (n,) with (n,)."""
    total = 0.0
    for s in range(len(z)):
        total += row[s].real * z[s].real - row[s].imag * z[s].imag
    return total


# Loops of three: numba takes ten seconds to compile what they are as products and np.cross.
@njit(cache=True, fastmath=True)
def _hub_rate(inverse, turning, push, momentum, z, out):
    """Write I^-1 (turning + push - momentum of the modes), (3,)."""
    for i in range(3):
        out[i] = 0.0
    for j in range(3):
        own = turning[j] + push[j] - real_dot(momentum[j], z)
        for i in range(3):
            out[i] += inverse[i, j] * own


@njit(cache=True, fastmath=True)
def _pushed(ahead, moment, kick_hub, out):
    """Write states (n,) as moved by a moment (3,) on the hub."""
    for s in range(len(ahead)):
        out[s] = ahead[s] + (moment[0] * kick_hub[0, s] + moment[1] * kick_hub[1, s]
                             + moment[2] * kick_hub[2, s])


@njit(cache=True, fastmath=True)
def _midpoint(ahead, omega, turning, torque, momentum, inertia, inverse, kick_hub, step_s, moment):
    """Write -omega x I omega at the middle of a step: twice through, from its begin."""
    middle, push, end = np.empty(3), np.empty(3), np.empty(3)
    spin, after = np.empty(3), np.empty(len(ahead), np.complex128)
    for i in range(3):
        middle[i] = omega[i]
    for _ in range(2):
        for i in range(3):
            spin[i] = (inertia[i, 0] * middle[0] + inertia[i, 1] * middle[1]
                       + inertia[i, 2] * middle[2])
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            moment[i] = middle[k] * spin[j] - middle[j] * spin[k]
            push[i] = step_s * (moment[i] + torque[i])
        _pushed(ahead, moment, kick_hub, after)
        _hub_rate(inverse, turning, push, momentum, after, end)
        for i in range(3):
            middle[i] = (omega[i] + end[i]) / 2
