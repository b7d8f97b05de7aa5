"""Changes between two points of a model, or of a mode: what effects on any model share."""
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
from scipy.linalg import eigh

from ssi_ros.effects.edits import add_part
from ssi_ros.effects.places import GROUND, pairs
from ssi_ros.model.excitation import FixedWhite, source, total_covariance, White
from ssi_ros.model.joints import distance_rows, JointLaw
from ssi_ros.model.linear_model import assemble_model
from ssi_ros.model.system import is_held, RIGID, undamped_modes
from ssi_ros.quantity import unknown

ALONG = 0.999           # cosine of a force with an input, from which both are one


def row_between(setup, freedom, to):
    """
    Return the row r that gives the displacement of one point less that of another, r X.

    Parameters
    ----------
    setup : Setup
        Of a model that has points: freedoms, or channels of a model of modes.
    freedom, to : str
        Names of two points; `to` may be 'ground'.

    Raises
    ------
    ValueError
        If a point is not there.

    """
    if freedom == to:
        raise ValueError(f'both ends are {freedom}; name two points, or ground')
    return _row(setup, freedom) - (0.0 if to == GROUND else _row(setup, to))


def _row(setup, name):
    points = setup.spacecraft.points
    if name not in points:
        raise ValueError(unknown(f'point {name!r}', name, (*points, GROUND)))
    system = setup.system
    if name in setup.spacecraft.freedoms:
        return np.eye(len(system.dofs))[system.dofs.index(name)]
    return system.sensor[system.channels.index(name)]


def stiffness_between(system, row):
    """
    Return the force over the displacement of a slow pull between two points, 1 / r K^-1 r.

    Where nothing holds them, m w^2 of their mass and the lowest natural frequency.
    """
    squares, shapes = undamped_modes(system)
    share, held = row @ shapes, squares > RIGID * squares[-1]
    if not is_held(system, row):
        return mass_at(system, row) * float(squares[held][0])
    return 1.0 / float(np.sum(share[held] ** 2 / squares[held]))


def mass_at(system, row):
    """Return the force over the acceleration of a sudden push, 1 / r M^-1 r."""
    return 1.0 / float(row @ np.linalg.solve(system.mass, row))


def joined(setup, matrix, row, value):
    """Return the setup with value r^T r added to 'mass', 'damping' or 'stiffness'."""
    system = setup.system
    return replace(setup, system=replace(
        system, **{matrix: getattr(system, matrix) + value * np.outer(row, row)}))


def single_modes(system):
    """Yield the number of every mode that vibrates, and its frequency [Hz] and decay [1/s]."""
    squares, shapes = eigh(system.stiffness, system.mass)
    vibrating = np.flatnonzero(squares > RIGID * squares[-1])
    for number, at in enumerate(vibrating, 1):
        yield number, (float(np.sqrt(squares[at]) / (2 * np.pi)),
                       float(shapes[:, at] @ system.damping @ shapes[:, at] / 2))


def dispersed(system, share):
    """Return the system whose frequencies grow by their square, the highest by a share."""
    onward = system.stiffness @ np.linalg.solve(system.mass, system.stiffness)
    top = eigh(system.stiffness, system.mass, eigvals_only=True)[-1]
    return replace(system, stiffness=system.stiffness + share / top * (onward + onward.T))


def with_mode(system, number, frequency=1.0, damping=1.0):
    """
    Return the system with frequency and damping ratio of one mode times factors.

    Parameters
    ----------
    system : System
        With at least one mode that vibrates.
    number : str or int
        Of the mode, from 1 on, by rising frequency of the undamped system; rigid ones not counted.
    frequency, damping : float
        Factors. Its shape and all other modes stay: K + (f^2 - 1) w^2 (M phi)(M phi)^T.

    Raises
    ------
    ValueError
        If there is no such mode.

    """
    squares, shapes = eigh(system.stiffness, system.mass)
    vibrating = np.flatnonzero(squares > RIGID * squares[-1])
    try:
        at = vibrating[int(number) - 1] if int(number) > 0 else None
    except (ValueError, IndexError):
        at = None
    if at is None:
        raise ValueError(f'mode={number!r} is not on this model, which has the modes 1 to '
                         f'{len(vibrating)}')
    shape = shapes[:, at]
    force = system.mass @ shape
    own = shape @ system.damping @ shape
    both = np.outer(force, force)
    return replace(
        system, stiffness=system.stiffness + (frequency ** 2 - 1) * squares[at] * both,
        damping=system.damping + (frequency * damping - 1) * own * both)


def strongest_rms(system):
    """Return the rms of the strongest white input."""
    return max((rms for p in map(source, system.excitation) if isinstance(p, White)
                for rms in p.rms), default=1.0)


def with_force(setup, freedom, rms):
    """Return the setup with a white force at a point, as of `row_between`."""
    force = f'force on {freedom}'
    there = replace(setup, system=_with_input(
        setup.system, row_between(setup, freedom, GROUND), force))
    return add_part(there, FixedWhite(force, (force,), (rms,)))


def _with_input(system, row, name):
    """Return the system with one more input, a force along a row."""
    return replace(system, input=np.column_stack([system.input, row]),
                   inputs=(*system.inputs, name))


@lru_cache(maxsize=16)
def undriven(model):
    """Return the points of a model that no level of the excitation drives alone."""
    system = assemble_model(model)
    alone = [p.inputs[0] for p in map(source, system.excitation)
             if isinstance(p, White) and len(p.inputs) == 1]
    driven = system.input[:, [system.inputs.index(n) for n in alone]]
    rows = {name: _row_on(model, system, name, GROUND) for name in model.points}
    return [name for name, row in rows.items() if np.all(
        np.abs(row @ driven) <= ALONG * np.linalg.norm(driven, axis=0) * np.linalg.norm(row))]


def with_law(setup, row, between, kind, size, stiffness):
    """Return the setup with a JointLaw of a kind and size between two points."""
    system = setup.system
    if between in system.inputs:
        raise ValueError(f'friction or play between {between} is given twice; give it once')
    system = _with_input(system, row, between)
    distance_rows(system, [len(system.inputs) - 1])     # the points must be held
    return replace(setup, system=system,
                   laws=setup.laws + (JointLaw(between, kind, size, stiffness),))


@lru_cache(maxsize=256)
def held_between(model, freedom, to):
    """Return whether springs hold two points of a model together, as those of one free body."""
    system = assemble_model(model)
    return is_held(system, _row_on(model, system, freedom, to))


def held_pairs(model):
    """Return those of the pairs that are searched which springs hold together."""
    return [pair for pair in pairs(model) if held_between(model, *pair)]


@lru_cache(maxsize=256)
def amplitude_between(model, freedom, to):
    """Return the rms of the distance of two points of a model, and the stiffness between them."""
    system = assemble_model(model)
    row = _row_on(model, system, freedom, to)
    system = _with_input(system, row, 'between')
    reads = distance_rows(system, [len(system.inputs) - 1])[0]
    covariance = system.plant.discrete(model.rate_hz).state_covariance(
        total_covariance(system.excitation, model.rate_hz, system.inputs))
    return float(np.sqrt(reads @ covariance @ reads)), stiffness_between(system, row)


def _row_on(model, system, freedom, to):
    return row_between(SimpleNamespace(spacecraft=model, system=system), freedom, to)
