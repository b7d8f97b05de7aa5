"""
Errors of single numbers of a model: what a calibration moves, and by how much it may be wrong.

Every error is one coordinate with a name, zero in the model as it is written. Frequencies,
damping, participation and shapes are of the modes of the clamped arrays, each array on its own:
those are the numbers that a finite element model gives, and the modes of the whole spacecraft
follow from them. The force on a mode is no number of the structure: every recording has its own.
Eq. (160) to (163) of docs/theory-gap.md.
"""
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from ssi_ros.model.sensors import Mix
from ssi_ros.quantity import unknown

FREQUENCY, DAMPING, PARTICIPATION, SHAPE, INERTIA, GAIN, ALONG, LATERAL, FORCE = KINDS = (
    'frequency', 'damping', 'participation', 'shape', 'hub_inertia', 'gain', 'along', 'lateral',
    'force')
AXES = ('x', 'y', 'z')
PROBE_M = 1e-3          # step of the derivative of a shape by the place of its sensor


class _Rows(tuple):
    """Rows of a covariance as a file has them, six digits each; not rounded again."""

    # every model of a fit has other errors and this covariance: it is written and hashed once
    @cached_property
    def _written(self):
        return super().__repr__()

    @cached_property
    def _hash(self):
        return super().__hash__()

    def __repr__(self):
        """Return what a tuple is written as."""
        return self._written

    def __hash__(self):
        """Return the hash of a tuple."""
        return self._hash


@dataclass(frozen=True)
class Calibration:
    """
    Errors of a model's numbers, and how surely they are known.

    Attributes
    ----------
    names : tuple of str
        Of the m errors: the kind, and what it is of: 'frequency E1 3', 'shape E1 3 e1_a',
        'hub_inertia x', 'gain e1_a', 'along e1_a', 'force E1 3'.
    values : tuple of float, (m,)
        Relative errors [1] of frequencies, participation, shapes, inertia and gains; logarithms
        of damping ratios and of forces on modes; metres of places.
    covariance : tuple of tuples, (m, m)
        What remains unknown of them; empty where they are taken for exact.
    recordings : tuple of str
        Healthy recordings that they were found from.
    unexplained : tuple of str
        What these show that the model has not, in sentences.

    """

    names: tuple = ()
    values: tuple = ()
    covariance: tuple = ()
    recordings: tuple = ()
    unexplained: tuple = ()

    def __post_init__(self):
        object.__setattr__(self, 'values', tuple(map(float, self.values)))
        if not isinstance(self.covariance, _Rows):
            # six digits, as a file has them: what is read back is what was calibrated
            object.__setattr__(self, 'covariance', _Rows(
                tuple(float(f'{float(v):.6g}') for v in (
                    row.split() if isinstance(row, str) else row)) for row in self.covariance))
        count = len(self.names)
        if len(self.values) != count:
            raise ValueError(f'calibration: {len(self.values)} values for {count} names')
        if self.covariance and {count} != {len(self.covariance), *map(len, self.covariance)}:
            raise ValueError(f'calibration: covariance has rows of '
                             f'{sorted(set(map(len, self.covariance)))} numbers, '
                             f'{len(self.covariance)} of them, for {count} names')

    @property
    def bare(self):
        """Return the errors of the structure alone: no forces of a recording, nothing beside."""
        return Calibration(self.names, np.where(of_recording(self.names), 0.0, self.values))

    def __hash__(self):
        # what is fitted asks for systems by their spacecraft, thousands of times: half of it does
        return hash((self.names, self.values))

    def to_plain(self):
        """Return plain data for YAML; a row of the covariance is one text, so that it is short."""
        return {'names': list(self.names), 'values': list(self.values),
                'covariance': [' '.join(f'{v:.6g}' for v in row) for row in self.covariance],
                'recordings': list(self.recordings), 'unexplained': list(self.unexplained)}


def declared(spacecraft):
    """
    Return names and standard deviations of all errors that a model's uncertainty declares.

    Returns
    -------
    names : tuple of str
    stds : ndarray, (m,)
        Only errors whose deviation is not zero; units as in `Calibration.values`.

    """
    if hasattr(spacecraft, 'declared'):       # a model of somebody else: of its modes
        return spacecraft.declared
    given, found = spacecraft.uncertainty, []
    for array in spacecraft.arrays:
        sensors = [s.name for s in spacecraft.sensors if s.array == array.name]
        for number in range(1, array.modes + 1):
            mode, of = given.of_mode(array.name, number), f'{array.name} {number}'
            found += [(f'{FREQUENCY} {of}', mode.frequency), (f'{DAMPING} {of}', mode.damping),
                      (f'{PARTICIPATION} {of}', mode.participation)]
            found += [(f'{SHAPE} {of} {s}', mode.shape) for s in sensors]
            if spacecraft.excitation.process_noise_rms and not given.exact:
                found.append((f'{FORCE} {of}', given.modal_force))
    found += [(f'{INERTIA} {axis}', given.hub_inertia) for axis in AXES]
    for sensor in spacecraft.sensors:
        found += [(f'{GAIN} {sensor.name}', given.gain),
                  (f'{ALONG} {sensor.name}', given.sensor_place_m),
                  (f'{LATERAL} {sensor.name}', given.sensor_place_m)]
    kept = [(n, s) for n, s in found if s > 0.0]
    return tuple(n for n, _ in kept), np.array([s for _, s in kept])


def of_recording(names):
    """Return which errors every recording has on its own, ndarray of bool (m,)."""
    return np.array([name.split()[0] == FORCE for name in names], bool)


class Clamped(NamedTuple):
    """
    What the modes of clamped arrays are to a system whose arrays have hinges.

    A mode of a hinged array is a turn about its root, which geometry gives, and shares of the
    modes of the clamped array, which have the errors, eq. (161a).
    """

    coupling: np.ndarray    # (3, n), of each clamped mode with the hub
    sensor: np.ndarray      # (l, n), its shape at the channels
    squares: np.ndarray     # (n,), its stiffness omega^2
    shares: np.ndarray      # (n, n), of each clamped mode, a row, in each freedom of the system


def with_errors(system, calibration, hub_inertia, slopes, clamped=None):
    """
    Return a system with the errors of a calibration in its matrices.

    Parameters
    ----------
    system : System
        As the numbers of the model give it.
    calibration : Calibration
        The errors.
    hub_inertia : sequence of float, (3,)
        Moments of inertia of the hub alone [kg m^2].
    slopes : callable
        Derivative of the sensor row of a channel, given its index, along the array and across,
        (2, n) [1/m].
    clamped : Clamped, optional
        Of a system whose freedoms are modes of hinged arrays.

    Returns
    -------
    System

    Raises
    ------
    ValueError
        If a name is of nothing that the system has.

    """
    found = numbers_at(system, calibration.names, calibration.values, hub_inertia, slopes,
                       clamped)
    chain = system.chain
    if np.any(found.gains != 1.0):
        chain = (Mix(tuple(map(tuple, np.diag(found.gains).tolist()))), *chain)
    return replace(system, mass=found.mass, damping=found.damping, stiffness=found.stiffness,
                   sensor=found.sensor, input=found.input, chain=chain)


@dataclass(frozen=True, eq=False)
class Numbers:
    """The numbers of a system that errors change; see `System`."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    sensor: np.ndarray
    gains: np.ndarray       # (l,), of the channels
    input: np.ndarray       # noqa: A003


def numbers_at(system, names, values, hub_inertia, slopes, clamped=None):
    """Return the Numbers of a system at values of named errors, (m,); see `with_errors`."""
    where = places_of(tuple(names), system.dofs, system.channels, system.inputs)
    values = np.asarray(values)
    n, channels = len(system.dofs), len(system.channels)

    def of(kind, size):
        out = np.zeros(size)
        index, at = where[kind]
        if len(index):
            out[at] = values[index]
        return out

    frequency = 1.0 + of(FREQUENCY, n)
    root = np.sqrt(frequency * np.exp(of(DAMPING, n)))
    clamped = clamped or Clamped(system.mass[:3], system.sensor, np.diag(system.stiffness),
                                 np.eye(n))
    coupling = (clamped.coupling * of(PARTICIPATION, n)) @ clamped.shares
    mass, axes = system.mass.copy(), np.arange(3)
    mass[:3] += coupling
    mass[:, :3] += coupling.T
    mass[axes, axes] += of(INERTIA, 3) * np.asarray(hub_inertia)
    sensor = system.sensor + (clamped.sensor * of(SHAPE, (channels, n))) @ clamped.shares
    moved = np.column_stack([of(ALONG, channels), of(LATERAL, channels)])
    for i in np.flatnonzero(moved.any(axis=1)):
        sensor[i] += moved[i] @ slopes(i)
    stiffness = system.stiffness + stiffened(clamped.squares, clamped.shares, frequency)
    return Numbers(mass, system.damping * np.outer(root, root), stiffness, sensor,
                   1.0 + of(GAIN, channels),
                   system.input * np.exp(of(FORCE, len(system.inputs))))


def stiffened(squares, shares, factors):
    """Return what factors (n,) of the frequencies of clamped modes add to a stiffness, (n, n)."""
    return shares.T @ ((squares * (factors ** 2 - 1.0))[:, None] * shares)


def with_frequencies(system, factors, damping=0.0):
    """
    Return a system whose modal freedoms have other natural frequencies and damping ratios.

    Parameters
    ----------
    system : System
        With coordinates of modes among its freedoms.
    factors : ndarray, (n,)
        Of the natural frequency of every freedom; 1 leaves it.
    damping : ndarray, (n,), or 0
        Change of the logarithm of its damping ratio.

    Returns
    -------
    System

    """
    stiffness, damping = moved_matrices(system.stiffness, system.damping, factors, damping)
    return replace(system, stiffness=stiffness, damping=damping)


def moved_matrices(stiffness, damping, factors, log_damping):
    """Return both matrices (n, n) of `with_frequencies`, without a system around them."""
    root = np.sqrt(factors * np.exp(log_damping))
    return stiffness * np.outer(factors, factors), damping * np.outer(root, root)


@lru_cache(maxsize=64)
def places_of(names, dofs, channels, inputs):
    """Return for every kind the indices of its errors, and where in its array they belong."""
    found = {kind: ([], []) for kind in KINDS}
    for i, name in enumerate(names):
        kind, *of = name.split()
        try:
            if kind in (FREQUENCY, DAMPING, PARTICIPATION):
                at = dofs.index(f'{of[0]}_eta{of[1]}')
            elif kind == SHAPE:
                at = channels.index(of[2]), dofs.index(f'{of[0]}_eta{of[1]}')
            elif kind == FORCE:
                at = inputs.index(f'{of[0]}_force{of[1]}')
            elif kind == INERTIA:
                at = AXES.index(of[0])
            else:
                at = channels.index(of[0])
            found[kind][0].append(i)
            found[kind][1].append(at)
        except (ValueError, IndexError, KeyError):
            raise ValueError(unknown(f'calibration: error {name!r}', kind, KINDS) + '; or its '
                             'array, mode or channel is not on this spacecraft') from None

    def index(at):
        return tuple(np.array(at, int).T) if at and isinstance(at[0], tuple) else np.array(at, int)
    return {kind: (np.array(i, int), index(at)) for kind, (i, at) in found.items()}
