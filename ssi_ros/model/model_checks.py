"""What a model of somebody else must satisfy: one sentence for each way to get it wrong."""
import numpy as np
from scipy.linalg import eigh

from ssi_ros.model.system import RIGID

ROUNDING = 1e-9         # of the largest entry, eigenvalue or residue


def check_names(model):
    """Check names, groups and levels of a LinearModel."""
    for kind, names in (('freedoms', model.freedoms), ('inputs', [d.name for d in model.drives]),
                        ('channels', [s.name for s in model.sensors])):
        if not names or not all(names) or len(set(names)) < len(names):
            raise ValueError(f'{kind} have the names {list(names)}; at least one is needed, each '
                             'with its own name')
        for name in names:
            if not name.isprintable():
                raise ValueError(f'{kind} have the name {name!r}, which holds what does not '
                                 'print, such as the end of a line; rename it')
    if 'ground' in model.freedoms:
        raise ValueError("a freedom has the name 'ground', which stands for what does not move; "
                         'rename it')
    for name in dict.fromkeys(d.level_name for d in model.drives):
        corners = {d.corner_hz for d in model.drives if d.level_name == name}
        if len(corners) > 1:
            raise ValueError(f'the inputs of group {name} have the corners {sorted(corners)} Hz; '
                             'inputs with one level need one corner_hz')
    if not any(d.level > 0.0 for d in model.drives):
        raise ValueError('no input has a level above zero, so that nothing would move; give the '
                         'rms of at least one input in levels')


def check_sizes(model):
    """Check shapes, symmetry and definiteness of the matrices of a LinearModel."""
    n, m, channels = len(model.freedoms), len(model.drives), len(model.sensors)
    for name, shape, words in (
            ('mass', (n, n), f'{n} freedoms'), ('damping', (n, n), f'{n} freedoms'),
            ('stiffness', (n, n), f'{n} freedoms'),
            ('input', (n, m), f'{n} freedoms and {m} inputs'),
            ('output', (channels, n), f'{channels} channels and {n} freedoms')):
        matrix = getattr(model, name)
        if matrix.shape != shape:
            raise ValueError(f'{name} has the shape {matrix.shape}, but {words} need {shape}')
        if not np.all(np.isfinite(matrix)):
            raise ValueError(f'{name} holds values that are not finite; every entry must be a '
                             'number')
    for name in ('mass', 'damping', 'stiffness'):
        check_definite(name, getattr(model, name))


def check_definite(name, matrix):
    """Check that a matrix is square, symmetric and without negative eigenvalues; a mass above."""
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise ValueError(f'{name} has the shape {matrix.shape}; it must be square')
    gap = np.abs(matrix - matrix.T)
    i, j = np.unravel_index(np.argmax(gap), gap.shape)
    if gap[i, j] > ROUNDING * np.abs(matrix).max():
        raise ValueError(f'{name} is not symmetric: {matrix[i, j]:g} in row {i + 1} and column '
                         f'{j + 1}, but {matrix[j, i]:g} opposite; check its assembly')
    least, largest = np.linalg.eigvalsh(matrix)[[0, -1]]
    if name == 'mass' and least <= 1e-14 * largest:
        raise ValueError(f'mass is not positive definite: it has the eigenvalue {least:g}; '
                         'condense the freedoms without mass (Guyan) first')
    if least < -ROUNDING * max(largest, 1e-300):
        raise ValueError(f'{name} is indefinite: it has the eigenvalue {least:g}; a passive '
                         'structure has none below zero')


def check_stationary(system):
    """Check that a record of a System has a stationary state, and that it is not aliased."""
    if not system.stiffness.any():
        raise ValueError('stiffness is all zero, so that nothing vibrates; give the springs')
    _check_held(system)
    plant, rate_hz = system.plant, system.rate_hz
    values, vectors, inverse = plant.diagonal
    size = (np.linalg.norm(plant.c @ vectors, axis=0)
            * np.linalg.norm(inverse @ plant.b, axis=1))
    stays = ((values.real > -ROUNDING * np.maximum(np.abs(values), 1e-300))
             & (size > ROUNDING * size.max(initial=0.0)))
    if np.any(stays):
        raise ValueError(f'a mode at {np.abs(values[stays]).max() / (2 * np.pi):.4g} Hz does not '
                         'decay, so that a record has no stationary level; give it damping (and, '
                         'at 0 Hz, a spring, or measure accelerations)')
    found = np.abs(values[values.imag > 0.0]) / (2 * np.pi)
    above = found[found >= rate_hz / 2]
    if len(above):
        raise ValueError(f'rate_hz={rate_hz:g} is too low: the highest mode lies at '
                         f'{above.max():.4g} Hz, above half of it; raise rate_hz above '
                         f'{2 * above.max():.4g}, or keep fewer modes')


def _check_held(system):
    """Check that no channel reads a motion that nothing holds, which drifts away."""
    squares, shapes = eigh(system.stiffness, system.mass)
    free = shapes[:, squares <= RIGID * squares[-1]]
    slowed = np.einsum('ik,ij,jk->k', free, system.damping, free) > 0.0
    for name, kind, row in zip(system.channels, system.kinds, system.sensor):
        read = np.abs(row @ free) > ROUNDING * np.abs(row).max() * np.abs(free).max(initial=0.0)
        if kind == 'displacement' and read.any() or kind == 'velocity' and (read & ~slowed).any():
            raise ValueError(f'channel {name} reads the {kind} of a motion that no spring holds, '
                             'so that it drifts away; give it a spring, or measure its '
                             'acceleration')
