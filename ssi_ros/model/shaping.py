"""
Shaping filters: coloured excitation as white noise through a linear filter, eq. (24) and (25).

Paper, section 4.2: x_f' = A_f x_f + B_f u_f, u~ = C_f x_f + D_f u_f. Given to a `System` as
`shaping`, such a filter becomes part of its state space, so that the sampled system stays exact.
"""
import numpy as np
from scipy.linalg import block_diag

from ssi_ros.model.statespace import StateSpace


def same_on_all(a, b, c, d, count):
    """
    Return one filter (A_f, B_f, C_f, D_f) with one input and output, copied `count` times.

    Parameters
    ----------
    a, b, c, d : array_like, shapes (n, n), (n, 1), (1, n), (1, 1)
        The continuous filter, [1/s] where it has a unit.
    count : int
        Number of inputs that pass it, each through its own copy.

    Returns
    -------
    StateSpace

    Raises
    ------
    ValueError
        If the filter is not stable, or its matrices do not fit.

    """
    a, b, c, d = (np.atleast_2d(np.asarray(m, dtype=float)) for m in (a, b, c, d))
    n = len(a)
    if (a.shape, b.shape, c.shape, d.shape) != ((n, n), (n, 1), (1, n), (1, 1)):
        raise ValueError(f'the shaping filter has matrices of shapes {a.shape}, {b.shape}, '
                         f'{c.shape}, {d.shape}; (n, n), (n, 1), (1, n), (1, 1) are needed')
    worst = np.linalg.eigvals(a).real.max()
    if worst >= 0:
        raise ValueError(f'the shaping filter has a pole with real part {worst:g} 1/s; all must '
                         'be negative')
    spread = [block_diag(*[m] * count) for m in (a, b, c, d)]
    return StateSpace(*spread, tuple(f'filter{i}_{k}' for i in range(count) for k in range(n)))


def low_pass(corner_hz, count):
    """Return a first-order low-pass of unit gain at rest, the same on `count` inputs."""
    if not (np.isfinite(corner_hz) and corner_hz > 0):
        raise ValueError(f'corner_hz={corner_hz:g} must be a positive number [Hz]')
    w = 2 * np.pi * corner_hz
    return same_on_all(-w, w, 1.0, 0.0, count)


def resonance(frequency_hz, damping_ratio, gain, count):
    """Return 1 + gain times a resonance of unit peak: white excitation with a broad line."""
    w, xi = 2 * np.pi * frequency_hz, damping_ratio
    return same_on_all([[0.0, 1.0], [-w ** 2, -2 * xi * w]], [[0.0], [2 * xi * w * gain]],
                       [[0.0, 1.0]], 1.0, count)
