# Licensed under the Apache License, Version 2.0.
"""
Equations of motion of the hub with two arrays, paper section 2, in second-order form.

Letters: q = [theta_x, theta_y, theta_z, eta_1 (n), eta_2 (n), alpha_i of each hinge, zeta of each
slosh mass]; M q'' + C q' + K q = B u + L f. s distance from the root, x lateral position; array i
points along side_i y_b with its root 1 m from the hub's centre; a point of it is at
y = side_i (1 + s). An array turned by gamma about y_b has the normal (sin gamma, 0, cos gamma).
The modal coordinates are those of the nominal clamped plate whatever the effect, so that the
process noise stays the same physical force. Translation is ignored as in the paper.
"""
from dataclasses import dataclass
from functools import lru_cache

from blindgen.plate import clamped_modes, gauss_points
from blindgen.scenario import SENSOR_ALONG_M, SENSOR_ARRAY, SENSOR_LATERAL_M
import numpy as np
from scipy.linalg import eigh

MODES = 10
ROOT_M = 1.0
HUB_INERTIA = (600.0, 400.0, 600.0)
DAMPING = 0.005
SIDES = (1.0, -1.0)
SHAPES = clamped_modes(count=MODES)
POINTS = gauss_points(SHAPES.plate, 20, 12)
POINT_SHAPES = SHAPES.at(*POINTS[:2])
# Clamped frequencies of the published table, Hz, to its last digit: what a ground test of the
# arrays told. Our own mesh differs from the table's by up to 0.1 %, many times the spread of an
# identified frequency, and a spacecraft flies with tested frequencies, not with a mesh's.
GROUND_TEST_HZ = np.array([0.361, 2.260, 2.918, 6.345, 9.009, 12.484, 15.828, 20.707, 23.768,
                           30.978])
LAST_DIGIT_HZ = 0.0005
LAST_RATIO = 0.3            # damping of the last mode of a hinged array: it must not ring


@dataclass(frozen=True)
class Craft:
    """
    Matrices of one frozen state of the spacecraft.

    mass, damping, stiffness (n, n); loads (n, 22): torque about x_b, about y_b and 20 process
    forces; directions (n, m): direction of each local force; sensors (4, n): acceleration of each
    channel is sensors @ q''.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    loads: np.ndarray
    directions: np.ndarray
    sensors: np.ndarray


@lru_cache(maxsize=256)
def _shapes_at(along_m, lateral_m):
    """Return the shapes at one point; sensors stay where they are while matrices drift."""
    return SHAPES.at(along_m, lateral_m)


def clamped_omega(scenario):
    """Return the clamped frequencies (10,) [rad/s]: ours, moved into the table's last digit."""
    if scenario.own_mesh:
        return SHAPES.omega
    return 2 * np.pi * np.clip(SHAPES.omega / (2 * np.pi), GROUND_TEST_HZ - LAST_DIGIT_HZ,
                               GROUND_TEST_HZ + LAST_DIGIT_HZ)


def assemble(scenario, progress=0.0):
    """
    Return the matrices of a scenario at a moment of its record.

    Parameters
    ----------
    scenario : Scenario
        What the spacecraft is.
    progress : float
        Share of the record gone, 0 to 1; it moves the drifting and the turning scenarios.

    """
    gamma = scenario.rotation_rad * progress
    hinged = [i for i in range(2) if np.isfinite(scenario.hinge[i])]
    n = 3 + 2 * MODES + len(hinged) + len(scenario.slosh)
    mass, damping, stiffness = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    mass[:3, :3] = np.diag(HUB_INERTIA) * scenario.hub_scale

    def row(array, s, x):
        """Deflection along the array's normal of points of an array, per coordinate."""
        rows = np.zeros((len(s), n))
        y = SIDES[array] * (ROOT_M + s)
        rows[:, 0], rows[:, 1], rows[:, 2] = y * np.cos(gamma), -x, -y * np.sin(gamma)
        begin = 3 + array * MODES
        rows[:, begin:begin + MODES] = (
            POINT_SHAPES if s is POINTS[0] else
            np.vstack([_shapes_at(*point) for point in zip(s.tolist(), x.tolist())]))
        if array in hinged:
            rows[:, 3 + 2 * MODES + hinged.index(array)] = s
        return rows

    s, x, area = POINTS
    for i in range(2):
        r = row(i, s, x)
        rho = SHAPES.plate.mass_per_area_kg_m2 * area
        mass += r.T @ (rho[:, None] * r)
        # Motion in the array's own plane loads the hub only: rigid inertia about z_b and,
        # through gamma, about x_b.
        y = ROOT_M + s
        plane = np.array([np.sin(gamma), 0.0, np.cos(gamma)])
        mass[:3, :3] += (rho @ (x**2 + y**2)) * np.outer(plane, plane)
        block = slice(3 + i * MODES, 3 + (i + 1) * MODES)
        square = scenario.plate_scale[i] * (1 + scenario.drift * progress)
        omega = clamped_omega(scenario) * np.sqrt(square)
        stiffness[block, block] += np.diag(omega**2)
        damping[block, block] += np.diag(2 * DAMPING * scenario.damping_scale * omega)
    hinge_modes = {}
    for j, i in enumerate(hinged):
        block, k = slice(3 + i * MODES, 3 + (i + 1) * MODES), 3 + 2 * MODES + j
        stiffness[k, k] = scenario.hinge[i]
        index = [*range(block.start, block.stop), k]
        square, t = eigh(stiffness[np.ix_(index, index)], mass[np.ix_(index, index)])
        hinge_modes[i] = t
        # every mode of the hinged array has its damping ratio: t is mass-normalised
        ratio = np.append(np.full(MODES, DAMPING * scenario.damping_scale), LAST_RATIO)
        inertia = mass[np.ix_(index, index)] @ t
        damping[np.ix_(index, index)] = inertia @ np.diag(2 * ratio * np.sqrt(square)) @ inertia.T
    for array, added, along, lateral in scenario.masses:
        r = row(array, np.array([along]), np.array([lateral]))
        mass += added * r.T @ r
    for j, (added, frequency, ratio, arm) in enumerate(scenario.slosh):
        k = 3 + 2 * MODES + len(hinged) + j
        r = np.zeros((1, n))
        r[0, 0], r[0, k] = arm, 1.0
        omega = 2 * np.pi * frequency
        mass += added * r.T @ r
        stiffness[k, k] += added * omega**2
        damping[k, k] += 2 * ratio * omega * added
    if scenario.controller:
        bandwidth, ratio = scenario.controller
        omega = 2 * np.pi * bandwidth
        for k in range(2):
            stiffness[k, k] += mass[k, k] * omega**2
            damping[k, k] += 2 * ratio * omega * mass[k, k]
    # theta' x h with h along z_b
    damping[0, 1] += scenario.momentum
    damping[1, 0] -= scenario.momentum

    keep = np.eye(n)
    for j, i in enumerate(hinged):
        block, k = slice(3 + i * MODES, 3 + (i + 1) * MODES), 3 + 2 * MODES + j
        t = hinge_modes[i]
        index = [*range(block.start, block.stop), k]
        keep[np.ix_(index, index)] = t
    loads = np.zeros((n, 2 + 2 * MODES))
    loads[0, 0] = loads[1, 1] = 1.0
    loads[3:3 + 2 * MODES, 2:] = np.eye(2 * MODES)
    directions = np.zeros((n, 1 + len(scenario.local)))
    directions[0, 0] = 1.0                       # smooth torque about x_b
    for j, (_, array, parameters) in enumerate(scenario.local):
        directions[:, 1 + j] = _direction(array, parameters, row, hinged, n)
    along, lateral = np.array(SENSOR_ALONG_M), np.array(SENSOR_LATERAL_M)
    for channel, forward, sideways in scenario.moved:
        along[channel] += forward
        lateral[channel] += sideways
    sensors = np.vstack([row(SENSOR_ARRAY[c], along[c:c + 1], lateral[c:c + 1])
                         for c in range(4)])
    mass, damping, stiffness = (keep.T @ matrix @ keep for matrix in (mass, damping, stiffness))
    sensors = sensors @ keep
    for k in (3 + 2 * MODES + j for j in range(len(hinged))):
        _only_driven(mass, damping, stiffness, sensors, k)
    return Craft(mass, damping, stiffness, keep.T @ loads, keep.T @ directions, sensors)


def _only_driven(mass, damping, stiffness, sensors, k):
    """
    Let the last mode of a hinged array be driven by all and act on the law of its hinge alone.

    Where the root moves against its own residual inertia it answers, at any stiffness, to the edge
    of a held load within the sample that sees the edge. Nobody's sensors see that, and without
    it a stiff hinge tends to the clamp. Yet nearly all of the compliance 1/k at the root is its:
    a hinge without moment turns at once, and one that stands is a clamp.
    """
    for matrix in (mass, damping, stiffness):
        own = matrix[k, k]
        matrix[:, k] = 0.0
        matrix[k, k] = own
    sensors[:, k] = 0.0


def _direction(array, parameters, row, hinged, n):
    """Return where a local force acts: the hinge, one modal coordinate, or a point's flexing."""
    where = parameters['at']
    direction = np.zeros(n)
    if where == 'hinge':
        direction[3 + 2 * MODES + hinged.index(array)] = 1.0
    elif where == 'mode':
        direction[3 + array * MODES + parameters['mode']] = 1.0
    else:                                        # relative to the hub: flexing alone
        direction[:] = row(array, np.array([where]), np.array([0.0]))[0]
        direction[:3] = 0.0
    return direction


def state_matrices(craft):
    """
    Return A (2n, 2n), B (2n, 22), L (2n, m), C (4, 2n), D (4, 22), E (4, m) in continuous time.

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
