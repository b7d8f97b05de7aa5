"""
Natural modes of a thin cantilever plate, by the conforming Bogner-Fox-Schmit element.

The shape is bicubic with continuous slope, so that moments and derivatives are exact at every
point. On an even mesh its matrices are Kronecker products of those of cubic Hermite beams:
`_Beam` is all the finite element that there is. Source: Bogner, Fox, Schmit, Proc. Conf. Matrix
Methods in Structural Mechanics, AFFDL-TR-66-80, 1966.
"""
from dataclasses import dataclass
from functools import lru_cache
import math

import numpy as np
from scipy.linalg import eigh

from ssi_ros.model.spacecraft import Plate
from ssi_ros.records import read_only

GAUSS = np.polynomial.legendre.leggauss(4)
DOFS_A_MODE = 16        # a mesh this fine keeps every frequency within 1 %, docs/theory.md (8)


@dataclass(frozen=True)
class PlateModes:
    """
    Mass-normalised modes of one plate.

    Attributes
    ----------
    plate : Plate
        The plate that they belong to.
    frequencies_hz : ndarray, shape (n,), [Hz]
        Natural frequencies, rising.
    coefficients : ndarray, shape (dofs, n), [kg^-0.5 m^-p]
        Nodal values; p is the order of derivative of the node's freedom.

    """

    plate: Plate
    frequencies_hz: np.ndarray
    coefficients: np.ndarray

    def at(self, along_m, lateral_m, derivative=(0, 0)):
        """
        Return the shapes at points, or a derivative of them.

        Parameters
        ----------
        along_m, lateral_m : float or ndarray, shape (p,), [m]
            Distance from the root, and position along x_b from the centre line.
        derivative : tuple of two int
            Order of the derivative, along and across, up to 3.

        Returns
        -------
        ndarray, shape (n,) or (p, n), [kg^-0.5 m^-order]

        """
        along, across = _beams(self.plate)
        rows = np.einsum('pi,pj->pij',
                         along.values(np.atleast_1d(along_m), derivative[0]),
                         across.values(np.atleast_1d(lateral_m) + self.plate.width_m / 2,
                                       derivative[1]))
        shapes = rows.reshape(len(rows), -1) @ self.coefficients
        return shapes[0] if np.ndim(along_m) == 0 else shapes

    def overlap(self, other):
        """Return the integrals of rho h phi_i phi_j with the modes of another root, (n, m)."""
        return self.coefficients.T @ _mass(self.plate) @ other.coefficients

    def moments(self):
        """Return the integrals of rho h phi times 1, along_m and lateral_m, shape (3, n)."""
        along, across = _beams(self.plate)
        one_s, s = along.moment(0), along.moment(1)
        one_x = across.moment(0)
        x = across.moment(1) - self.plate.width_m / 2 * one_x
        rows = [np.kron(one_s, one_x), np.kron(s, one_x), np.kron(one_s, x)]
        return self.plate.area_density_kg_m2 * np.array(rows) @ self.coefficients


@lru_cache(maxsize=64)
def plate_modes(plate, modes, hinge_n_m_rad=math.inf):
    """
    Compute the first modes of a cantilever plate, eq. (5) to (8) of docs/theory.md.

    Parameters
    ----------
    plate : Plate
        Size, mass, stiffness and mesh.
    modes : int
        Number of modes.
    hinge_n_m_rad : float
        Stiffness of a hinge along the root edge, which stays straight [N m/rad]; infinite is
        the clamp.

    Returns
    -------
    PlateModes

    Raises
    ------
    ValueError
        If the mesh is too coarse for that many modes.

    """
    along, across = _beams(plate)
    free = 2 * (along.nodes - 1) * across.dofs
    if modes * DOFS_A_MODE > free:
        raise ValueError(
            f'modes={modes} is too many for the mesh of elements_along={plate.elements_along} x '
            f'elements_across={plate.elements_across}, which carries {free // DOFS_A_MODE}; '
            'refine the mesh or ask for fewer modes')
    basis, mass, stiffness = _matrices(plate, math.isfinite(hinge_n_m_rad))
    if math.isfinite(hinge_n_m_rad):
        stiffness = stiffness.copy()
        stiffness[0, 0] += hinge_n_m_rad
    # K^-1 M instead of M^-1 K: the low frequencies are its largest eigenvalues, so that rounding
    # takes its share of them and not of the highest, 1e8 times above.
    n = len(mass)
    flexibility, shapes = eigh(mass, stiffness, subset_by_index=(n - modes, n - 1))
    squares, shapes = 1 / flexibility[::-1], shapes[:, ::-1]
    shapes = basis @ (shapes * np.sqrt(squares))        # unit modal mass instead of stiffness
    tips = np.kron(along.values(np.array([plate.length_m]), 0)[0],
                   across.values(np.array([plate.width_m]), 0)[0]) @ shapes
    shapes = shapes * np.where(tips < 0, -1.0, 1.0)     # a sign that does not depend on LAPACK
    return PlateModes(plate, read_only(np.sqrt(squares) / (2 * math.pi)), read_only(shapes))


@lru_cache(maxsize=8)
def _matrices(plate, turns):
    """Return freedoms of a clamped or turning root, (dofs, n), and their mass and stiffness."""
    along, across = _beams(plate)
    mass = _mass(plate)
    nu = plate.poisson_ratio
    cross = np.kron(along.gram(2, 0), across.gram(0, 2))
    stiffness = plate.stiffness_n_m * (
        np.kron(along.gram(2, 2), across.gram(0, 0)) + np.kron(along.gram(0, 0), across.gram(2, 2))
        + nu * (cross + cross.T)
        + 2 * (1 - nu) * np.kron(along.gram(1, 1), across.gram(1, 1)))
    # The clamp removes deflection and slope of the root edge: the first two freedoms along.
    fixed = 2 * across.dofs
    basis = np.eye(len(mass))[:, fixed:]
    if not turns:
        return tuple(map(read_only, (basis, mass[fixed:, fixed:], stiffness[fixed:, fixed:])))
    slope = np.kron(np.eye(along.dofs)[1], across.one())     # the same at all of the root

    def turning(matrix):
        # products with the whole basis would cost as much as the modes
        row = slope @ matrix
        return np.block([[row @ slope, row[None, fixed:]],
                         [row[fixed:, None], matrix[fixed:, fixed:]]])
    basis = np.column_stack([slope, basis])
    return tuple(map(read_only, (basis, turning(mass), turning(stiffness))))


def leissa_parameter(plate, frequency_hz):
    """Return lambda^2 = omega a^2 sqrt(rho h / D), eq. (9), a = length, as Leissa 1973."""
    return (2 * math.pi * np.asarray(frequency_hz) * plate.length_m ** 2
            * math.sqrt(plate.area_density_kg_m2 / plate.stiffness_n_m))


@lru_cache(maxsize=8)
def _beams(plate):
    return (_Beam(plate.length_m, plate.elements_along),
            _Beam(plate.width_m, plate.elements_across))


@lru_cache(maxsize=8)
def _mass(plate):
    along, across = _beams(plate)
    return read_only(plate.area_density_kg_m2 * np.kron(along.gram(0, 0), across.gram(0, 0)))


class _Beam:
    """Cubic Hermite functions on an even mesh; freedoms: value and slope of node after node."""

    # Coefficients of 1, t, t^2, t^3 of the four functions on 0 <= t <= 1.
    CUBICS = np.array([[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]], float)

    def __init__(self, length, elements):
        self.length, self.elements = length, elements
        self.nodes = elements + 1
        self.dofs = 2 * self.nodes

    def values(self, points, derivative):
        """Return the functions (or a derivative) at points, shape (p, dofs)."""
        h = self.length / self.elements
        element = np.clip((points / h).astype(int), 0, self.elements - 1)
        t = points / h - element
        powers = np.zeros((len(points), 4))
        for k in range(derivative, 4):
            powers[:, k] = math.perm(k, derivative) * t ** (k - derivative)
        local = powers @ self.CUBICS.T * np.array([1.0, h, 1.0, h]) / h ** derivative
        rows = np.zeros((len(points), self.dofs))
        np.put_along_axis(rows, 2 * element[:, None] + np.arange(4), local, axis=1)
        return rows

    def gram(self, first, second):
        """Return the integrals of derivative `first` of one times `second` of another."""
        points, weights = self._gauss()
        return (self.values(points, first).T * weights) @ self.values(points, second)

    def moment(self, power):
        """Return the integrals of the functions times s^power, shape (dofs,)."""
        points, weights = self._gauss()
        return (weights * points ** power) @ self.values(points, 0)

    def one(self):
        """Return the nodal values of the function 1."""
        return np.tile([1.0, 0.0], self.nodes)

    def _gauss(self):
        # Four points an element integrate the products of cubics (degree 6) exactly.
        t, w = GAUSS
        h = self.length / self.elements
        points = (np.arange(self.elements)[:, None] + (t + 1) / 2) * h
        return points.ravel(), np.tile(w * h / 2, self.elements)
