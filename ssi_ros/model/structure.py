"""
The coupled spacecraft: hub and arrays in one set of matrices, eq. (10) to (16) of docs/theory.md.

Freedoms are theta (3), then the modal coordinates eta of array after array, then, only with
`explicit_hinges`, the angle alpha of each hinge.
"""
from dataclasses import replace
from functools import lru_cache
import math

import numpy as np
from scipy.linalg import block_diag, eigh

from ssi_ros.model.errors import Calibration, Clamped, numbers_at, PROBE_M, with_errors
from ssi_ros.model.excitation import coloured, White
from ssi_ros.model.linear_model import assemble_model, LinearModel
from ssi_ros.model.modal_errors import numbers_of_modes
from ssi_ros.model.plate import plate_modes
from ssi_ros.model.sensors import Noise
from ssi_ros.model.spacecraft import INFINITE, on_array
from ssi_ros.model.system import System
from ssi_ros.records import read_only

TORQUES = ('torque_x', 'torque_y', 'torque_z')
RESIDUAL_DAMPING = 0.5      # see `_array_matrices`
GIVE_HZ, GIVE_DAMPING = 1e4, 1.05       # see `_with_give`: far above what is looked at, two poles
KEPT = 32               # systems: a fit asks again and again for those of few spacecraft


@lru_cache(maxsize=KEPT)
def assemble(spacecraft, explicit_hinges=False, hinge_inputs=False):
    """
    Build the coupled system M X'' + D X' + K X = B u with its excitation and sensor chain.

    Parameters
    ----------
    spacecraft : Spacecraft or LinearModel
        The numbers; a LinearModel has no hinges.
    explicit_hinges : bool
        Keep the angle of every hinge of finite stiffness as a freedom of its own, which a
        nonlinear hinge needs; otherwise the modes of the array contain it.
    hinge_inputs : bool
        Add the torque about every hinge of finite stiffness as an input; the same column reads
        its angle. The modes take their share of it, and a freedom '_give', which channels and
        hub do not feel, the static give of all higher ones. A stiff hinge is then the clamp.

    Returns
    -------
    System

    Raises
    ------
    ValueError
        If a mesh cannot carry the modes asked for.

    """
    if isinstance(spacecraft, LinearModel):
        return assemble_model(spacecraft)
    parts = [_array_matrices(a, explicit_hinges) for a in spacecraft.arrays]
    inertia = np.array(spacecraft.hub.inertia_kg_m2) + sum(
        _array_inertia(a) for a in spacecraft.arrays)
    # Letters of the theory: J whole inertia, H = [H_1 H_2], M, D, K.
    h = np.hstack([p['coupling'] for p in parts])
    mass = np.block([[inertia, h], [h.T, block_diag(*[p['mass'] for p in parts])]])
    damping = block_diag(-_cross(spacecraft.momentum_n_m_s), *[p['damping'] for p in parts])
    stiffness = block_diag(np.zeros((3, 3)), *[p['stiffness'] for p in parts])
    dofs = ['theta_x', 'theta_y', 'theta_z'] + [d for p in parts for d in p['dofs']]
    # Hinge angles go last, so that the first freedoms do not depend on there being hinges.
    order = sorted(range(len(dofs)), key=lambda i: dofs[i].endswith('_hinge'))
    pick = np.ix_(order, order)
    dofs = tuple(dofs[i] for i in order)
    modal = tuple(d for d in dofs if '_eta' in d)
    inputs = TORQUES + tuple(
        d.replace('_eta', '_force') for d in modal) + tuple(
        d for d in dofs if d.endswith('_hinge'))
    sensor = np.array([displacement_row(spacecraft, s.array, s.along_m, s.lateral_m,
                                        explicit_hinges) for s in spacecraft.sensors])
    act = np.eye(len(dofs))
    for a in spacecraft.arrays:
        if math.isfinite(a.hinge_n_m_rad) and not explicit_hinges:
            act[np.ix_(_places(dofs, a, '_eta'), _places(inputs, a, '_force'))] = _shares(a)
    system = System(
        mass=mass[pick], damping=damping[pick], stiffness=stiffness[pick],
        input=act, sensor=sensor, dofs=dofs, inputs=inputs,
        channels=tuple(s.name for s in spacecraft.sensors),
        excitation=default_excitation(spacecraft),
        chain=(Noise((spacecraft.noise_rms_m_s2,) * len(spacecraft.sensors)),),
        rate_hz=spacecraft.rate_hz, fitted=any(spacecraft.calibration.values))
    if any(spacecraft.calibration.values):
        system = with_errors(system, spacecraft.calibration,
                             *_geometry(spacecraft, explicit_hinges))
    if not hinge_inputs:
        return system
    return _with_give(system, [a for a in spacecraft.arrays if math.isfinite(a.hinge_n_m_rad)])


def numbers_with_errors(spacecraft):
    """
    Return what the errors of a calibration make of the numbers of a spacecraft.

    Parameters
    ----------
    spacecraft : Spacecraft
        With the names of errors in its calibration.

    Returns
    -------
    callable
        From values of the errors, (m,), to `Numbers`.

    """
    if isinstance(spacecraft, LinearModel):
        return numbers_of_modes(spacecraft)
    system = assemble(replace(spacecraft, calibration=Calibration()))
    names, geometry = spacecraft.calibration.names, _geometry(spacecraft, False)
    return lambda values: numbers_at(system, names, values, *geometry)


def _geometry(spacecraft, explicit_hinges):
    """Return inertia of the hub, (3,), slopes of sensor rows, and Clamped, as errors need them."""
    return np.diag(spacecraft.hub.inertia_kg_m2), lambda i: _slopes(
        spacecraft.arrays, spacecraft.sensors[i], explicit_hinges), (
        None if explicit_hinges else clamped_modes(spacecraft.arrays, spacecraft.sensors))


@lru_cache(maxsize=256)
def clamped_modes(arrays, sensors):
    """Return what the modes of the clamped arrays are to those of the hinged, None: the same."""
    if not any(math.isfinite(a.hinge_n_m_rad) for a in arrays):
        return None
    rigid = np.zeros((3, 3))
    held = [replace(a, hinge_n_m_rad=INFINITE) for a in arrays]
    parts = [_array_matrices(a, False) for a in held]
    rows = [_row(held, s.array, s.along_m, s.lateral_m, False) for s in sensors]
    shares = [_shares(a).T if math.isfinite(a.hinge_n_m_rad) else np.eye(a.modes) for a in arrays]
    return Clamped(*map(read_only, (
        np.hstack([rigid, *(p['coupling'] for p in parts)]), np.array(rows),
        np.concatenate([np.zeros(3), *(np.diag(p['stiffness']) for p in parts)]),
        block_diag(rigid, *shares))))


def _with_give(system, arrays):
    """
    Return the system with the torque about the hinge of each array as an input, eq. (39a).

    Ten modes on a hinge of 1e6 N m/rad hold 2 % of its give 1/k: with them alone an open hinge
    would still hold the array, and a torque that rubs would never stop it.
    """
    slopes = np.zeros((len(system.dofs), len(arrays)))
    turn = np.zeros((len(arrays), len(system.inputs)))
    for column, row, a in zip(slopes.T, turn, arrays):
        modes = _places(system.dofs, a, '_eta')
        column[modes] = _root_slopes(a)
        # A force on a mode of the clamped array does no work on the hinge: what it turns the modes
        # by at rest, the give takes back.
        forces = _places(system.inputs, a, '_force')
        row[forces] = -(column[modes] / np.diag(system.stiffness)[modes]
                        ) @ system.input[np.ix_(modes, forces)]
    held = slopes.T ** 2 @ (1 / np.where(slopes.any(axis=1), np.diag(system.stiffness), 1.0))
    rest = np.maximum([1 / a.hinge_n_m_rad for a in arrays] - held, 0.0)
    omega, one = 2 * math.pi * GIVE_HZ, np.eye(len(arrays))
    reach = omega * np.sqrt(rest)
    below = turn * (omega ** 2 / np.where(reach, reach, np.inf))[:, None]
    return replace(
        system, mass=block_diag(system.mass, one),
        damping=block_diag(system.damping, 2 * GIVE_DAMPING * omega * one),
        stiffness=block_diag(system.stiffness, omega ** 2 * one),
        input=np.block([[system.input, slopes], [below, np.diag(reach)]]),
        sensor=np.pad(system.sensor, ((0, 0), (0, len(arrays)))),
        dofs=system.dofs + tuple(f'{a.name}_give' for a in arrays),
        inputs=system.inputs + tuple(f'{a.name}_hinge' for a in arrays))


def default_excitation(spacecraft):
    """
    Return the ambient excitation of a spacecraft: torque and process noise, white or coloured.

    A torque about several axes is a part for each, so that each has a level of its own.
    """
    levels = spacecraft.excitation
    forces = tuple(f'{a.name}_force{i + 1}' for a in spacecraft.arrays for i in range(a.modes))
    torque = White('torque', TORQUES, levels.torque_rms_n_m)
    driven = [(name, rms) for name, rms in zip(TORQUES, levels.torque_rms_n_m) if rms > 0.0]
    torques = (torque,) if len(driven) < 2 else tuple(
        White(name, (name,), (rms,)) for name, rms in driven)
    process = White('process_noise', forces, (levels.process_noise_rms,) * len(forces))
    return (*(coloured(t, levels.torque_corner_hz) for t in torques),
            coloured(process, levels.process_corner_hz))


def displacement_row(spacecraft, array, along_m, lateral_m, explicit_hinges=False):
    """
    Return the row r that gives the displacement along z_b of a point, w = r X, eq. (14).

    Parameters
    ----------
    spacecraft : Spacecraft
        The numbers.
    array : str
        Name of the array that the point is on.
    along_m, lateral_m : float
        Distance from the root, and position along x_b [m].
    explicit_hinges : bool
        As in `assemble`.

    Returns
    -------
    ndarray, shape (n,), [m/rad | kg^-0.5]

    """
    on_array(spacecraft.array(array), along_m, lateral_m)
    return _row(spacecraft.arrays, array, along_m, lateral_m, explicit_hinges)


def _row(arrays, name, along_m, lateral_m, explicit_hinges):
    """Return the row of `displacement_row` of a point on one of some arrays."""
    own = next(a for a in arrays if a.name == name)
    row, hinges = [own.side * (own.root_m + along_m), -lateral_m, 0.0], []
    for a in arrays:
        shapes = _shapes(a, explicit_hinges, along_m, lateral_m) if a is own else 0.0
        row.extend(np.broadcast_to(shapes, a.modes))
        if explicit_hinges and math.isfinite(a.hinge_n_m_rad):
            hinges.append(along_m if a is own else 0.0)
    return np.array(row + hinges)


@lru_cache(maxsize=256)
def _slopes(arrays, sensor, explicit_hinges):
    """Return the derivatives of a sensor's row by its place, along and across, (2, n) [1/m]."""
    plate = next(a for a in arrays if a.name == sensor.array).plate
    at = np.array([sensor.along_m, sensor.lateral_m])
    low, high = np.array([[0.0, plate.length_m], [-plate.width_m / 2, plate.width_m / 2]]).T
    rows = []
    for step in PROBE_M * np.eye(2):
        # at an edge the derivative is taken from inside
        ends = [np.clip(at + sign * step, low, high) for sign in (1, -1)]
        one, other = (_row(arrays, sensor.array, *map(float, end), explicit_hinges)
                      for end in ends)
        rows.append((one - other) / np.abs(ends[0] - ends[1]).sum())
    return read_only(np.array(rows))


def add_point_mass(system, row, mass_kg):
    """Return the system with a mass added at the point of a displacement row, eq. (15)."""
    if not mass_kg >= 0.0:
        raise ValueError(f'mass_kg={mass_kg:g} must be zero or more [kg]')
    return replace(system, mass=system.mass + mass_kg * np.outer(row, row))


@lru_cache(maxsize=256)
def _shapes(array, explicit_hinges, along_m, lateral_m):
    """Return the shapes of an array at a point, (modes,); sensors ask again and again."""
    return read_only(_modes(array, explicit_hinges).at(along_m, lateral_m))


def _modes(array, explicit_hinges):
    hinge = INFINITE if explicit_hinges else array.hinge_n_m_rad
    return plate_modes(array.plate, array.modes, hinge)


def _root_slopes(array):
    """Return the angle of an array's hinge by each of its modes, (n,)."""
    return _modes(array, False).at(0.0, 0.0, (1, 0))


def _places(names, array, kind):
    """Return where the modes of an array are among names."""
    return [names.index(f'{array.name}{kind}{i + 1}') for i in range(array.modes)]


@lru_cache(maxsize=64)
def _shares(array):
    """
    Return what forces on the modes of the clamped array do on those of the hinged one, (n, n).

    What shakes a structure does not change with its hinge: the forces stay on the modal
    coordinates that they were declared on, w = phi eta + along alpha, eq. (17a).
    """
    clamped, hinged = _modes(array, True), _modes(array, False)
    turned = np.outer(clamped.moments()[1], _root_slopes(array))
    return read_only((clamped.overlap(hinged) - turned).T)


def _array_inertia(array):
    """Return the inertia of the undeformed array about the hub centre, (3, 3), [kg m^2]."""
    p, r = array.plate, array.root_m
    area = p.area_density_kg_m2
    about_x = area * p.width_m * ((r + p.length_m) ** 3 - r ** 3) / 3
    about_y = area * p.length_m * p.width_m ** 3 / 12
    return np.diag([about_x, about_y, about_x + about_y])


@lru_cache(maxsize=64)
def _array_matrices(array, explicit_hinges):
    """Return mass, damping, stiffness, coupling (3, n) and names of one array's freedoms."""
    modes = _modes(array, explicit_hinges)
    omega = 2 * math.pi * modes.frequencies_hz
    one, along, lateral = modes.moments()
    # H = integral of rho h (y, -x, 0) phi, with y = side (root + along), eq. (11).
    coupling = np.array([array.side * (array.root_m * one + along), -lateral, 0 * one])
    names = [f'{array.name}_eta{i + 1}' for i in range(array.modes)]
    xi = array.damping_ratio
    if not (explicit_hinges and math.isfinite(array.hinge_n_m_rad)):
        return {'mass': np.eye(array.modes), 'damping': np.diag(2 * xi * omega),
                'stiffness': np.diag(omega ** 2), 'coupling': coupling, 'dofs': names}
    # Hinge: w = phi eta + along alpha. Every mode of the hinged array has the damping ratio xi
    # but the last, which stands for the static give of all higher ones and has no life of its own.
    p = array.plate
    area = p.area_density_kg_m2 * p.width_m
    own = area * p.length_m ** 3 / 3
    mass = np.block([[np.eye(array.modes), along[:, None]], [along[None, :], np.array([[own]])]])
    stiffness = np.diag(np.append(omega ** 2, array.hinge_n_m_rad))
    squares, shapes = eigh(stiffness, mass)
    ratios = np.append(np.full(array.modes, xi), RESIDUAL_DAMPING)
    half = mass @ shapes
    damping = (half * (2 * ratios * np.sqrt(squares))) @ half.T
    swing = array.side * (array.root_m * area * p.length_m ** 2 / 2 + own)
    coupling = np.column_stack([coupling, [swing, 0.0, 0.0]])
    return {'mass': mass, 'damping': damping, 'stiffness': stiffness, 'coupling': coupling,
            'dofs': names + [f'{array.name}_hinge']}


def _cross(v):
    """Return the matrix that takes w to the cross product v x w."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
