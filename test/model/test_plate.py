"""Plate modes against published tables and an independent Ritz computation."""
import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from ssi_ros.model.plate import leissa_parameter, plate_modes
from ssi_ros.model.spacecraft import Plate

# Barton 1951, Trans. ASME J. Appl. Mech. 18, p. 129, as quoted in Code_Aster V2.03.001.
BARTON = [3.492, 8.525, 21.43, 27.33, 31.11, 54.44]
# The same plate by a separate finite element code (16 x 16 elements, nu = 0.3).
SEPARATE = [3.472, 8.510, 21.29, 27.20, 30.97, 54.22]


def beam(x, count, free):
    """Return beam functions and two derivatives on 0..1, clamped-free or free-free."""
    sign = 1.0 if free else -1.0
    rows = [np.ones_like(x), np.sqrt(3) * (1 - 2 * x)] if free else []
    slopes = [0 * x, -2 * np.sqrt(3) + 0 * x] if free else []
    bends = [0 * x, 0 * x] if free else []
    for n in range(1, count - len(rows) + 1):
        guess = (n + 0.5 if free else n - 0.5) * np.pi
        b = brentq(lambda v: np.cos(v) - sign / np.cosh(v), guess - 0.4, guess + 0.4)
        if free:
            s = (np.cosh(b) - np.cos(b)) / (np.sinh(b) - np.sin(b))
        else:
            s = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        ch, sh, c, n_ = np.cosh(b * x), np.sinh(b * x), np.cos(b * x), np.sin(b * x)
        rows.append(ch + sign * c - s * (sh + sign * n_))
        slopes.append(b * (sh - sign * n_ - s * (ch + sign * c)))
        bends.append(b * b * (ch - sign * c - s * (sh - sign * n_)))
    return np.array(rows), np.array(slopes), np.array(bends)


def ritz(ratio, terms=6, nu=0.3):
    """Return lambda^2 of a cantilever a x b, a/b = ratio, as Leissa 1973: 36 beam products."""
    t, w = np.polynomial.legendre.leggauss(80)
    x, w = (t + 1) / 2, w / 2
    along, across = beam(x, terms, free=False), beam(x, terms, free=True)
    g = [[(along[p] * w) @ along[q].T for q in range(3)] for p in range(3)]
    h = [[(across[p] * w) @ across[q].T * ratio ** (p + q) for q in range(3)] for p in range(3)]
    cross = np.kron(g[2][0], h[0][2])
    stiffness = (np.kron(g[2][2], h[0][0]) + np.kron(g[0][0], h[2][2]) + nu * (cross + cross.T)
                 + 2 * (1 - nu) * np.kron(g[1][1], h[1][1]))
    return np.sqrt(eigh(stiffness, np.kron(g[0][0], h[0][0]), eigvals_only=True)[:6])


def square(elements):
    """Return lambda^2 of the first six modes of a square plate."""
    plate = Plate(length_m=1.0, width_m=1.0, elements_along=elements, elements_across=elements)
    return leissa_parameter(plate, plate_modes(plate, 6).frequencies_hz)


def test_barton():
    """Below Barton's upper values, by 0.7 % at most."""
    ratio = square(12) / BARTON
    assert np.all(ratio < 1.0) and np.all(ratio > 0.993)


def test_separate_code():
    """0.1 % is the rounding of the separate results to four digits, and a coarser mesh here."""
    assert square(12) == pytest.approx(SEPARATE, rel=1e-3)


@pytest.mark.parametrize('ratio', [0.4, 2 / 3, 1.0, 1.5, 2.5])
def test_independent_ritz(ratio):
    """Leissa's own method, programmed again, bounds ours from above, and within 1 % for five."""
    plate = Plate(length_m=1.0, width_m=1.0 / ratio, elements_along=12, elements_across=12)
    own = leissa_parameter(plate, plate_modes(plate, 6).frequencies_hz)
    assert np.all(own < ritz(ratio)) and own[:5] == pytest.approx(ritz(ratio)[:5], rel=0.01)


@pytest.mark.slow
def test_mesh_converges_from_above():
    """Conforming elements bound from above, and halving the size gains at least a factor 4."""
    coarse, middle, fine = square(5), square(10), square(20)
    assert np.all(coarse > middle) and np.all(middle > fine)
    assert np.all((coarse - fine) > 4 * (middle - fine))


def test_shapes_are_normalised_and_orthogonal():
    """The mass matrix of the shapes is 1 by quadrature of values at points, to 1e-4."""
    plate = Plate()
    modes = plate_modes(plate, 10)
    t, w = np.polynomial.legendre.leggauss(60)
    s, x = (t + 1) / 2 * plate.length_m, t * plate.width_m / 2
    grid_s, grid_x = np.repeat(s, 60), np.tile(x, 60)
    weight = np.outer(w * plate.length_m / 2, w * plate.width_m / 2).ravel()
    shapes = modes.at(grid_s, grid_x)
    gram = plate.area_density_kg_m2 * (shapes.T * weight) @ shapes
    # the second derivative jumps at element edges, so 60 x 60 Gauss points give no more
    assert gram == pytest.approx(np.eye(10), abs=1e-4)
    moments = plate.area_density_kg_m2 * np.array([weight, weight * grid_s, weight * grid_x])
    assert moments @ shapes == pytest.approx(modes.moments(), abs=1e-3)


@pytest.mark.parametrize('order, tolerance', [((1, 0), 1e-6), ((0, 1), 1e-6), ((1, 1), 1e-6)])
def test_derivatives(order, tolerance):
    """Derivatives agree with central differences of the shapes: step^2 leaves 1e-6."""
    modes, step = plate_modes(Plate(), 10), 1e-4
    s, x = np.array([0.71, 3.33, 7.9]), np.array([-0.9, 0.13, 0.9])

    def shift(ds, dx):
        return modes.at(s + ds * step, x + dx * step)
    if order == (1, 1):
        by_hand = (shift(1, 1) - shift(1, -1) - shift(-1, 1) + shift(-1, -1)) / (4 * step ** 2)
    else:
        by_hand = (shift(*order) - shift(-order[0], -order[1])) / (2 * step)
    size = np.abs(by_hand).max()
    assert np.abs(modes.at(s, x, order) - by_hand).max() < tolerance * size


def test_root_is_clamped():
    """No deflection and no slope along the root edge, to rounding."""
    modes, x = plate_modes(Plate(), 10), np.linspace(-1, 1, 7)
    assert np.abs(modes.at(0 * x, x)).max() < 1e-12
    assert np.abs(modes.at(0 * x, x, (1, 0))).max() < 1e-12
