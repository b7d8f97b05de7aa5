"""
Read and write models of other people: `.npz` of NumPy, `.mat` of MATLAB (up to -v7).

One of three sets of variables says what moves, and the names say what is measured and driven:
mass, damping (or damping_ratios), stiffness, input, output, freedoms; frequencies_hz,
damping_ratios, shapes, participation; a, b, c, d, time ('discrete' or 'continuous'). With each:
rate_hz, channels, kinds, noise_rms, inputs, levels; optional corner_hz, groups, effects, and
uncertainty_frequency, _damping, _participation, _shape, _gain: standard deviations.
"""
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from ssi_ros.array_file import arrays_of
from ssi_ros.model.errors import Calibration
from ssi_ros.model.excitation import source, White
from ssi_ros.model.linear_model import Channel, Input, LinearModel, modal_model, state_space_model
from ssi_ros.model.modal_errors import modal_uncertainty, modes_at, MOST
from ssi_ros.model.model_checks import check_definite
from ssi_ros.model.sensors import Noise
from ssi_ros.quantity import unknown
from ssi_ros.whole_file import write_arrays

SUFFIXES = ('.npz', '.mat')
MATRICES = ('mass', 'damping', 'stiffness', 'input', 'output')
MODES = ('frequencies_hz', 'damping_ratios', 'shapes', 'participation')
STATE_SPACE = ('a', 'b', 'c', 'd', 'time')
SHARED = ('rate_hz', 'channels', 'kinds', 'noise_rms', 'inputs', 'levels', 'corner_hz', 'groups',
          'effects', 'freedoms')
QUADRATURE = tuple(f'quadrature_{n}' for n in ('input', 'shapes', 'a', 'b', 'c', 'd'))
UNCERTAINTY = 'uncertainty_'       # of the names of standard deviations
CALIBRATION = 'calibration_'
ALIASES = {'dofs': 'freedoms', 'sensor': 'output'}      # as `ssi_ros model --npz` writes them


def is_model_file(path):
    """Return whether a path has the suffix of a file of matrices."""
    return path is not None and Path(path).suffix.lower() in SUFFIXES


def load_model(path):
    """
    Read a model and the effects that it has.

    Parameters
    ----------
    path : str or Path
        `.npz` or `.mat`.

    Returns
    -------
    model : LinearModel
        The numbers.
    effects : tuple of str
        As `name:param=value,...`, which the model has already.

    Raises
    ------
    ValueError
        If a variable is missing, not known or does not fit the others.
    OSError
        If the file cannot be read.

    """
    try:
        given = _variables(Path(path))
        return _unsure(_model(given), given), _names(given.get('effects', ()))
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from None


def save_model(model, path, effects=()):
    """Write a LinearModel as matrices to a `.npz`, with effects (texts) that it has."""
    if Path(path).suffix != '.npz':
        raise ValueError(f'{path} must end in .npz, the format that a model of matrices is '
                         'written in')
    text = {'freedoms': model.freedoms, 'channels': [s.name for s in model.sensors],
            'kinds': [s.kind for s in model.sensors], 'inputs': [d.name for d in model.drives],
            'groups': [d.group for d in model.drives], 'effects': list(effects)}
    numbers = {name: getattr(model, name) for name in MATRICES}
    if not model.physical:
        numbers['physical'] = False
    if model.quadrature is not None:
        q = model.quadrature
        numbers |= dict(zip(QUADRATURE, (q.input, q.shapes, q.rest.a, q.rest.b, q.rest.c,
                                         q.rest.d)))
    if not model.uncertainty.exact:
        numbers |= {UNCERTAINTY + kind: getattr(model.uncertainty, kind) for kind in MOST}
    if model.calibration.names:
        known = model.calibration
        numbers |= {CALIBRATION + 'values': known.values,
                    CALIBRATION + 'covariance': known.covariance}
        text |= {CALIBRATION + n: getattr(known, n)
                 for n in ('names', 'recordings', 'unexplained')}
    path = path if str(path).endswith('.npz') else f'{path}.npz'
    write_arrays(path, **numbers, **{k: np.array(v, dtype=str) for k, v in text.items()},
                 rate_hz=model.rate_hz, noise_rms=[s.noise_rms for s in model.sensors],
                 levels=[d.level for d in model.drives],
                 corner_hz=[d.corner_hz for d in model.drives])


def save_system(system, path):
    """Write the matrices of a System and its random inputs to a file that `load_model` reads."""
    parts = {name: (p, source(p)) for p in system.excitation if isinstance(source(p), White)
             for name in source(p).inputs}
    rms = {n: dict(zip(w.inputs, w.held_rms(system.rate_hz)))[n] for n, (_, w) in parts.items()}
    (noise,) = (s.rms for s in system.chain if isinstance(s, Noise))
    write_arrays(path, mass=system.mass, damping=system.damping, stiffness=system.stiffness,
                 input=system.input, sensor=system.sensor, rate_hz=system.rate_hz,
                 dofs=np.array(system.dofs), inputs=np.array(system.inputs),
                 channels=np.array(system.channels), kinds=np.array(system.kinds),
                 noise_rms=np.broadcast_to(noise, len(system.channels)),
                 levels=[rms.get(n, 0.0) for n in system.inputs],
                 corner_hz=[getattr(parts[n][0], 'corner_hz', np.inf) if n in parts else np.inf
                            for n in system.inputs],
                 groups=[parts[n][1].name if n in parts else '' for n in system.inputs])


def _variables(path):
    """Return the variables of a file by name."""
    if not path.is_file():
        raise OSError(2, 'No such file', str(path))
    try:
        found = arrays_of(path, texts=True)
    except ValueError as error:
        kind = ('NumPy archive of numbers and texts' if path.suffix.lower() == '.npz' else
                'MATLAB file of numbers and texts')
        raise ValueError(f'it is no {kind} ({error}); write it by numpy.savez, names as an array '
                         "of str, or by MATLAB's save with '-v7'") from None
    struct = UNCERTAINTY[:-1] + '.'
    found = {k.replace(struct, UNCERTAINTY, 1) if k.startswith(struct) else k: v
             for k, v in found.items()}
    found = {ALIASES.get(k, k): v for k, v in found.items()}
    known = {*MATRICES, *MODES, *STATE_SPACE, *SHARED, *QUADRATURE, 'physical'}
    for name in found:
        if name not in known and not name.startswith((UNCERTAINTY, CALIBRATION)):
            raise ValueError(unknown(name, name, sorted(known)))
    return found


def _model(given):
    """Return the model of variables by name."""
    sets = [s for s in (('mass', 'stiffness'), ('frequencies_hz', 'shapes'), ('a', 'b', 'c'))
            if any(n in given for n in s)]
    if len(sets) != 1:
        raise ValueError(
            f'it holds {", ".join(sorted(given)) or "nothing"}; give one of: '
            f'{", ".join(MATRICES)}, freedoms | {", ".join(MODES)} | {", ".join(STATE_SPACE)}')
    (kind,) = sets
    names = {'drives': _drives(given), 'sensors': _sensors(given),
             'rate_hz': float(_number(given, 'rate_hz'))}
    if kind[0] == 'frequencies_hz':
        return modal_model(*(_matrix(given, n) for n in MODES), **names)
    if kind[0] == 'a':
        (time,) = _names(_needed(given, 'time', "'discrete' or 'continuous'")) or ('',)
        if time not in ('discrete', 'continuous'):
            raise ValueError(f"time={time!r} must be 'discrete' or 'continuous'")
        return state_space_model(*(_matrix(given, n) for n in 'abcd'),
                                 discrete=time == 'discrete', **names)
    mass, stiffness = (_definite(given, n) for n in ('mass', 'stiffness'))
    freedoms = _names(_needed(given, 'freedoms', 'the name of every row of mass'))
    return LinearModel(
        mass, _damping(given, mass, stiffness), stiffness,
        *(_matrix(given, n) for n in ('input', 'output')), freedoms=freedoms,
        physical=bool(np.all(given.get('physical', True))), quadrature=_quadrature(given), **names)


def _unsure(model, given):
    """Return a model with the standard deviations and the calibration of a file."""
    of = {n.removeprefix(UNCERTAINTY): _matrix(given, n) for n in given
          if n.startswith(UNCERTAINTY)}
    if of:
        model = replace(model, uncertainty=modal_uncertainty(model, **of))
    if CALIBRATION + 'names' in given:
        text = {n: tuple(map(str, given[CALIBRATION + n]))
                for n in ('names', 'recordings', 'unexplained')}
        known = Calibration(values=tuple(given[CALIBRATION + 'values']),
                            covariance=given[CALIBRATION + 'covariance'], **text)
        modes_at(known.names, model)
        model = replace(model, calibration=known)
    return model


def _quadrature(given):
    from ssi_ros.model.quadrature import Quadrature
    from ssi_ros.model.statespace import StateSpace
    if QUADRATURE[0] not in given:
        return None
    into, shapes, *rest = (np.asarray(given[n], dtype=float) for n in QUADRATURE)
    return Quadrature(into, shapes, StateSpace(
        *rest, tuple(f'real_{i + 1}' for i in range(len(rest[0])))))


def _damping(given, mass, stiffness):
    """Return the damping matrix, or that of damping ratios of the modes."""
    if 'damping' in given:
        return _definite(given, 'damping')
    ratios = np.ravel(_matrix(given, 'damping_ratios')) if 'damping_ratios' in given else None
    if ratios is None:
        raise ValueError('damping is missing; give the matrix, or damping_ratios of the modes')
    if len(ratios) not in (1, len(mass)):
        raise ValueError(f'there are {len(ratios)} damping_ratios, but {len(mass)} modes; give '
                         'one for each, or one for all')
    squares, shapes = eigh(stiffness, mass)
    half = mass @ shapes
    return (half * (2 * ratios * np.sqrt(np.maximum(squares, 0.0)))) @ half.T


def _definite(given, name):
    matrix = _matrix(given, name)
    check_definite(name, matrix)
    return matrix


def _drives(given):
    names = _names(_needed(given, 'inputs', 'the name of every input'))
    levels = _each(given, 'levels', names, None)
    corners = _each(given, 'corner_hz', names, np.inf)
    groups = _names(given.get('groups', ())) or ('',) * len(names)
    if len(groups) != len(names):
        raise ValueError(f'there are {len(groups)} groups for {len(names)} inputs; give one each')
    return tuple(map(Input, names, levels, corners, groups))


def _sensors(given):
    names = _names(_needed(given, 'channels', 'the name of every channel'))
    kinds = _names(_needed(given, 'kinds', 'what every channel measures, such as acceleration'))
    kinds = kinds * len(names) if len(kinds) == 1 else kinds
    if len(kinds) != len(names):
        raise ValueError(f'there are {len(kinds)} kinds for {len(names)} channels; give one for '
                         'each, or one for all')
    noise = _each(given, 'noise_rms', names, None)
    return tuple(map(Channel, names, (k.replace(' ', '_') for k in kinds), noise))


def _each(given, name, names, default):
    """Return one number for each name; one alone serves all."""
    if name not in given and default is None:
        raise ValueError(f'{name} is missing; give one number for each of {", ".join(names)}')
    values = np.ravel(_matrix(given, name)) if name in given else np.array([default])
    if len(values) not in (1, len(names)):
        raise ValueError(f'{name} holds {len(values)} numbers for {", ".join(names)}; give one '
                         'for each, or one for all')
    return tuple(float(v) for v in np.broadcast_to(values, len(names)))


def _number(given, name):
    value = _matrix(given, name)
    if value.size != 1:
        raise ValueError(f'{name} holds {value.size} numbers; it must be one')
    return value.item()


def _matrix(given, name):
    """Return a variable as a matrix of numbers."""
    value = np.asarray(_needed(given, name, 'numbers'))
    try:
        if np.iscomplexobj(value):
            raise ValueError
        value = np.atleast_2d(value.astype(float))
    except (TypeError, ValueError):
        raise ValueError(f'{name} holds {value.dtype} values; it must hold real numbers') from None
    if value.ndim != 2 or np.any(np.isnan(value)):
        raise ValueError(f'{name} has the shape {value.shape} or holds NaN; it must be a matrix '
                         'of numbers')
    return value


def _needed(given, name, what):
    if name not in given:
        raise ValueError(f'{name} is missing; give {what}')
    return given[name]


def _names(value):
    """Return texts of an array of str, or of a cell array or a char matrix of MATLAB."""
    found = []
    for item in np.ravel(np.asarray(value)):
        while isinstance(item, np.ndarray) and item.size == 1:
            item = item.ravel()[0]
        found.append(str(item).strip())
    return tuple(found)
