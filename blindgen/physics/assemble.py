# Licensed under the Apache License, Version 2.0.
"""
Equations of motion of the hub with its arrays, paper section 2, in second-order form.

Letters: q = [theta_x, theta_y, theta_z, eta of each array, alpha of each hinge, zeta of each slosh
mass or oscillator]; M q'' + C q' + K q = B u + L f. s distance from the root, x lateral position;
a point of an array is at y = side (root + s). The modal coordinates are those of the truth's
clamped plates whatever the effect, so that the process noise stays the same physical force.
Translation is ignored as in the paper.
"""
from dataclasses import dataclass

from blindgen.physics.spacecraft import clamped_omega, deflections, shapes_of
import numpy as np
from scipy.linalg import eigh

LAST_RATIO = 0.3            # damping of the last mode of a hinged array: it must not ring


@dataclass(frozen=True)
class Craft:
    """
    Matrices of one frozen state of the spacecraft with c channels.

    mass, damping, stiffness (n, n); loads (n, k): three torques, the modal forces, extra inputs;
    directions (n, m): direction of each local force; sensors (c, n): acceleration of each channel
    is sensors @ q''.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    loads: np.ndarray
    directions: np.ndarray
    sensors: np.ndarray


@dataclass(frozen=True)
class _Layout:
    """Where the coordinates of a scenario lie."""

    hinges: dict                   # array: (coordinate, stiffness)
    first_extra: int
    count: int


def layout(scenario):
    """Return where the coordinates of a scenario lie."""
    n = 3 + scenario.craft.modes
    hinges = {array: (n + j, k) for j, (array, k) in enumerate(scenario.hinge)}
    extra = n + len(hinges)
    return _Layout(hinges, extra, extra + len(scenario.slosh) + len(scenario.oscillators))


def assemble(scenario, progress=0.5):
    """
    Return the matrices of a scenario at a moment of its record.

    Parameters
    ----------
    scenario : Scenario
        What the spacecraft is.
    progress : float
        Share of the record gone, 0 to 1; it moves the drifting and the modulated scenarios.

    """
    at, craft = layout(scenario), scenario.craft
    n = at.count
    mass, damping, stiffness = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    mass[:3, :3] = np.diag(craft.hub_inertia) * scenario.hub_scale
    for i in range(len(craft.arrays)):
        _add_array(scenario, at, i, progress, mass, damping, stiffness)
    keep = np.eye(n)
    for i, (k, stiff) in at.hinges.items():
        _add_hinge(scenario, at, i, k, stiff, (mass, damping, stiffness, keep))
    _add_bodies(scenario, at, mass, damping, stiffness)
    _modulate(scenario, progress, mass, damping, stiffness)
    loads = np.zeros((n, craft.inputs + len(scenario.extra_inputs)))
    loads[:craft.inputs, :craft.inputs] = np.eye(craft.inputs)
    for j, (array, along, lateral, *_) in enumerate(scenario.extra_inputs):
        loads[:, craft.inputs + j] = point(scenario, at, array, along, lateral)
    directions = np.zeros((n, 1 + len(scenario.local)))
    directions[0, 0] = 1.0                       # smooth torque about x_b
    for j, (_, array, parameters) in enumerate(scenario.local):
        directions[:, 1 + j] = _direction(scenario, at, array, parameters)
    sensors = _sensors(scenario, at) @ keep
    mass, damping, stiffness = (keep.T @ matrix @ keep for matrix in (mass, damping, stiffness))
    for k, _ in at.hinges.values():
        _only_driven(mass, damping, stiffness, sensors, k)
    return Craft(mass, damping, stiffness, keep.T @ loads, keep.T @ directions, sensors)


def point(scenario, at, array, along_m, lateral_m, factors=()):
    """Return the deflection along z_b of a point of an array, per coordinate (n,)."""
    a, row = scenario.craft.arrays[array], np.zeros(at.count)
    row[0], row[1] = a.side * (a.root_m + along_m), -lateral_m
    row[scenario.craft.block(array)] = deflections(a, along_m, lateral_m, factors)
    if array in at.hinges:
        row[at.hinges[array][0]] = along_m
    return row


def _add_array(scenario, at, i, progress, mass, damping, stiffness):
    """Add the inertia of an array to all that moves it, and its modes' stiffness and damping."""
    array, block = scenario.craft.arrays[i], scenario.craft.block(i)
    s, x, area, shapes = shapes_of(array.plate, array.modes)[1]
    rows = np.zeros((len(s), at.count))
    rows[:, 0], rows[:, 1] = array.side * (array.root_m + s), -x
    rows[:, block] = shapes
    if i in at.hinges:
        rows[:, at.hinges[i][0]] = s
    rho = array.plate.mass_per_area_kg_m2 * area
    own = rows.T @ (rho[:, None] * rows)
    if array.participation:
        own[:3, block] *= array.participation
        own[block, :3] = own[:3, block].T
    mass += own
    # motion in the array's own plane loads the hub only
    mass[2, 2] += rho @ (x**2 + (array.root_m + s)**2)
    scale = np.prod([v for a, v in scenario.plate_scale if a == i])
    scale *= 1 + scenario.drift * progress
    scale *= 1 + scenario.warmth + scenario.warming * (progress - 0.5)
    omega = clamped_omega(array) * np.sqrt(scale)
    stiffness[block, block] += np.diag(omega**2)
    damping[block, block] += np.diag(2 * np.array(array.damping) * scenario.damping_scale * omega)


def _add_hinge(scenario, at, i, k, stiff, matrices):
    """Put an array on a hinge; every mode of the hinged array keeps its damping ratio."""
    mass, damping, stiffness, keep = matrices
    block = scenario.craft.block(i)
    stiffness[k, k] = stiff
    index = np.array([*range(block.start, block.stop), k])
    own = np.ix_(index, index)
    square, t = eigh(stiffness[own], mass[own])
    ratio = np.append(np.array(scenario.craft.arrays[i].damping) * scenario.damping_scale,
                      LAST_RATIO)
    inertia = mass[own] @ t
    damping[own] = inertia @ np.diag(2 * ratio * np.sqrt(square)) @ inertia.T
    keep[own] = t


def _add_bodies(scenario, at, mass, damping, stiffness):
    """Add point masses, slosh, oscillators, the controller and the stored momentum."""
    for array, added, along, lateral in scenario.masses:
        r = point(scenario, at, array, along, lateral)
        mass += added * np.outer(r, r)
    bodies = []
    for added, frequency, ratio, arm in scenario.slosh:
        r = np.zeros(at.count)
        r[0] = arm
        bodies.append((added, frequency, ratio, r))
    for added, frequency, ratio, array, along, lateral in scenario.oscillators:
        bodies.append((added, frequency, ratio, point(scenario, at, array, along, lateral)))
    for k, (added, frequency, ratio, r) in enumerate(bodies, at.first_extra):
        r[k] = 1.0
        omega = 2 * np.pi * frequency
        mass += added * np.outer(r, r)
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


def _modulate(scenario, progress, mass, damping, stiffness):
    """Change a matrix along a direction of the modal coordinates by a share that varies."""
    named = {'M': mass, 'C': damping, 'K': stiffness}
    for name, direction, depth, curve in scenario.modulated:
        matrix = named[name]
        d = np.zeros(len(matrix))
        d[3:3 + len(direction)] = direction
        matrix += depth * float(curve.at(progress)) * (d @ matrix @ d) * np.outer(d, d)


def _only_driven(mass, damping, stiffness, sensors, k):
    """
    Let the last mode of a hinged array be driven by all and act on the law of its hinge alone.

    Where the root moves against its own residual inertia it answers, at any stiffness, to the edge
    of a held load within the sample that begins there. No sensor measures that, and without it a
    stiff hinge tends to the clamp. Yet nearly all of the compliance 1/k at the root is its:
    a hinge without moment turns at once, and one that stands is a clamp.
    """
    for matrix in (mass, damping, stiffness):
        own = matrix[k, k]
        matrix[:, k] = 0.0
        matrix[k, k] = own
    sensors[:, k] = 0.0


def _direction(scenario, at, array, parameters):
    """Return where a local force acts: the hinge, or the flexing of a point."""
    where = parameters['at']
    if where == 'hinge':
        direction = np.zeros(at.count)
        direction[at.hinges[array][0]] = 1.0
        return direction
    direction = point(scenario, at, array, *where)
    direction[:3] = 0.0                          # relative to the hub: flexing alone
    return direction


def _sensors(scenario, at):
    """Return the rows of the sensors (c, n), each where it is."""
    places = [[s.along_m, s.lateral_m] for s in scenario.craft.sensors]
    for channel, forward, sideways in scenario.moved:
        places[channel][0] += forward
        places[channel][1] += sideways
    return np.vstack([point(scenario, at, s.array, *place, s.shape)
                      for s, place in zip(scenario.craft.sensors, places)])
