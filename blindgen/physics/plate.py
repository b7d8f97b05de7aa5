# Licensed under the Apache License, Version 2.0.
"""
Cantilever plate by the Ritz method with global polynomials.

One high-order element covers the whole array: the deflection is s^(2+p) times a Legendre
polynomial across the width. Nothing is meshed, and any point of the array has its exact shape
value, so that a moved sensor or a point mass needs no interpolation.

Letters: s distance from the clamped edge, x lateral position, w deflection, D bending stiffness,
nu Poisson's ratio, mu mass per area, L length, b width.
"""
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh


@dataclass(frozen=True)
class Plate:
    """Geometry, mass and stiffness of one array, SI; the numbers of the spacecraft are ours."""

    length_m: float = 8.0
    width_m: float = 2.0
    mass_per_area_kg_m2: float = 2.2
    stiffness_n_m: float = 4000.0
    poisson: float = 0.3


@dataclass(frozen=True)
class Shapes:
    """Mass-normalised clamped modes of a plate: omega (n,) [rad/s] and Ritz coefficients."""

    plate: Plate
    omega: np.ndarray
    coefficients: np.ndarray
    degree: tuple

    def at(self, along_m, lateral_m):
        """
        Return the mode shapes at points.

        Parameters
        ----------
        along_m, lateral_m : (m,) arrays
            Distance from the clamped edge and lateral position [m].

        Returns
        -------
        (m, n) array
            Deflection of each mass-normalised mode [1/sqrt(kg)].

        """
        w = _trial(self.plate, np.atleast_1d(along_m), np.atleast_1d(lateral_m), self.degree)[0]
        return w @ self.coefficients


def _trial(plate, s, x, degree):
    """Return the trial functions and their curvatures w, w_ss, w_xx, w_sx, each (m, p * q)."""
    along, across = degree
    t = 2 * s / plate.length_m - 1
    v = 2 * x / plate.width_m
    ct, cv = 2 / plate.length_m, 2 / plate.width_m
    eye_t, eye_v = np.eye(along), np.eye(across)
    # Legendre polynomials times (1 + t)^2, which vanishes with its slope at the clamp.
    p = [legendre.legval(t, legendre.legder(eye_t, k, axis=0)).T for k in range(3)]
    r = 1 + t[:, None]
    f = [r**2 * p[0], 2 * r * p[0] + r**2 * p[1], 2 * p[0] + 4 * r * p[1] + r**2 * p[2]]
    g = [legendre.legval(v, legendre.legder(eye_v, k, axis=0)).T for k in range(3)]

    def product(i, j):
        return (f[i][:, :, None] * g[j][:, None, :]).reshape(len(s), -1) * ct**i * cv**j

    return product(0, 0), product(2, 0), product(0, 2), product(1, 1)


def clamped_modes(plate=Plate(), count=10, degree=(14, 8)):
    """
    Return the lowest modes of the cantilever plate.

    Energy (Leissa 1973): D/2 [w_ss^2 + w_xx^2 + 2 nu w_ss w_xx + 2 (1 - nu) w_sx^2], integrated
    exactly by Gauss-Legendre points.

    Raises
    ------
    ValueError
        If more modes are asked for than the trial functions can give.

    """
    if count > degree[0] * degree[1] // 2:
        raise ValueError(f'count={count} exceeds half of {degree[0]} x {degree[1]} trial '
                         'functions, where modes are converged; raise degree')
    s, x, weight = gauss_points(plate, degree[0] + 4, degree[1] + 2)
    w, ss, xx, sx = _trial(plate, s, x, degree)
    nu = plate.poisson

    def inner(a, c):
        return a.T @ (weight[:, None] * c)

    stiffness = plate.stiffness_n_m * (
        inner(ss, ss) + inner(xx, xx) + nu * (inner(ss, xx) + inner(xx, ss))
        + 2 * (1 - nu) * inner(sx, sx))
    mass = plate.mass_per_area_kg_m2 * inner(w, w)
    values, vectors = eigh(stiffness, mass)
    vectors = vectors[:, :count]
    # The sign of a mode is free; a positive free corner makes records repeat on every machine.
    tip = _trial(plate, np.array([plate.length_m]), np.array([plate.width_m / 2]), degree)[0]
    vectors = vectors * np.sign(tip @ vectors)
    return Shapes(plate, np.sqrt(values[:count]), vectors, degree)


def gauss_points(plate, along, across):
    """Return points s, x (m,) [m] and weights (m,) [m^2] that integrate over the array."""
    t, wt = legendre.leggauss(along)
    v, wv = legendre.leggauss(across)
    s = (t + 1) * plate.length_m / 2
    x = v * plate.width_m / 2
    area = plate.length_m * plate.width_m / 4
    return (np.repeat(s, across), np.tile(x, along), np.outer(wt, wv).ravel() * area)
