"""
The modes of a recording under forces, refined until they explain its spectrum, eq. (150b).

    S(f) = c(f) sum_ij F_ij v_i v_j^H + N,   v_i = 2 xi_i phi_i f^2 / (f_i^2 - f^2 + 2j xi_i f_i f)

F is real and symmetric for white forces (Brincker and Ventura, Introduction to Operational Modal
Analysis, 2015, ch. 7), c is their colour. Beside the modes every channel has a constant and a term
in f^2, for forces that reach it at once and for modes above the band; N are the constants of each
channel alone, which may be its noise and have no colour.

Identification finds modes as well as correlations show them, which is less than the spectrum of a
recording of little noise does: frequencies, damping, shapes, colour and F maximise its likelihood
(El-Kafafy, De Troyer and Guillaume, Mechanical Systems and Signal Processing 48, 2014).
"""
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ssi_ros.hermitian import inverse_root, white, white_products, white_vectors

NEXT, FAR = 3, 0.4       # modes to the next, or log frequency ratio, beyond which two are apart
STEPS = 3               # of the fit of the forces alone
ROUNDS = 4              # of that of modes and colour, at most
GAIN = 0.005            # of the distance that is left: less ends it
RIDGE = 1e-7            # of the information of each entry of F
BOUNDED = 0.5, 1.5      # eigenvalues of a model over the mean of model and spectrum, in weights
MISFIT = 10.0           # eigenvalue of a model over the spectrum, or its inverse, at most
FREQUENCY_STD = 1.0     # of the error of a frequency in half-widths of its resonance
DAMPING_STD = 0.5       # of the logarithm of a damping ratio
SHAPE_STD = 0.1         # of a component of a shape, whose largest is 1, in both its parts
COLOUR_STD = 1.0        # of a coefficient of log c [neper]
DEGREE = 5              # of log c in log f


@dataclass(frozen=True, eq=False)
class ModalModel:
    """Modes, m of them, and terms of the l channels, two of each, under forces."""

    points: np.ndarray      # (b, n), frequencies of each band [Hz]
    frequencies_hz: np.ndarray      # (m,)
    damping: np.ndarray     # (m,), ratios
    shapes: np.ndarray      # (m, l), complex
    colour: np.ndarray      # (b,), power over that of white forces
    pairs: np.ndarray       # (p, 2), of terms that share a force
    forces: np.ndarray = None   # (p,), entries of F

    @property
    def noise(self):
        """Return which pairs are the constant of one channel alone, (p,)."""
        (first, second), (count, width) = self.pairs.T, self.shapes.shape
        return (first == second) & (first >= count) & (first < count + width)

    @property
    def directions(self):
        """Return the shape of every term, (m + 2 l, l)."""
        each = np.eye(self.shapes.shape[1])
        return np.concatenate([self.shapes, each, each])

    @property
    def of(self):
        """Return which of `responses` every term has, (m + 2 l,)."""
        count, width = self.shapes.shape
        return np.concatenate([np.arange(count), np.repeat([count, count + 1], width)])

    @cached_property
    def away(self):
        """Return f_i^2 - f^2 + 2j xi_i f_i f, (b, n, m)."""
        f = self.points[..., None]
        return self.frequencies_hz ** 2 - f ** 2 + 2j * self.damping * self.frequencies_hz * f

    @cached_property
    def responses(self):
        """Return the responses of modes, a constant and f^2, (b, n, m + 2)."""
        f = self.points[..., None]
        return np.concatenate([2 * self.damping * f ** 2 / self.away, np.ones_like(f),
                               (f / f.max()) ** 2], axis=-1)

    @cached_property
    def products(self):
        """Return x (p, b, l) and y (p, 1, l): an entry of F and its mirror add x y^H + y x^H."""
        (first, second), of, d = self.pairs.T, self.of, self.directions
        both = self._mean_products(self.responses)[of[first], of[second]]
        both *= np.where(self.noise[:, None], 1.0, self.colour)
        return both[:, :, None] * d[first][:, None], d[second][:, None]

    @property
    def matrices(self):
        """Return what an entry of F and its mirror add to S, (p, b, l, l), complex64."""
        return _hermitian(*self.products)

    @cached_property
    def spectrum(self):
        """Return S, (b, l, l)."""
        return self.under(np.ones(len(self.pairs), bool))

    def under(self, some):
        """Return the S of some of the pairs, (b, l, l)."""
        left, right = (x[some] for x in self.products)
        shares = self.forces[some, None] * right[:, 0].conj()
        found = np.tensordot(left, shares, ((0,), (0,)))
        return found + found.conj().swapaxes(-1, -2)

    def tangents(self):
        """
        Return derivatives of S by the deviations of `moved`.

        Of the modes, m (2 + 2 l) of them, as `products`; of the colour, (DEGREE, b, l, l).
        """
        (first, second), (count, width), of = self.pairs.T, self.shapes.shape, self.of
        forces = np.zeros((len(of), len(of)))
        np.add.at(forces, (first, second), self.forces)
        np.add.at(forces, (second, first), self.forces)
        modes, f, xi, hz = (self.responses[..., :count], self.points[..., None], self.damping,
                            self.frequencies_hz)
        rest = forces[:count, :, None] * self.directions.conj()

        def with_all(left):             # other terms under the forces of each mode, (m, b, l)
            both = self._mean_products(left)[:, of] * self.colour
            return np.einsum('kqb,kqj->kbj', both, rest)
        by_frequency = -FREQUENCY_STD * xi * hz * modes / self.away * (2 * hz + 2j * xi * f)
        by_damping = DAMPING_STD * modes * (1 - 2j * xi * hz * f / self.away)
        # frequency and damping of each mode, then both parts of every component of its shape
        each = np.repeat(np.eye(width), 2, axis=0) * np.tile([1.0, 1.0j], width)[:, None]
        left = np.concatenate([np.repeat(self.shapes[:, None], 2, axis=1),
                               np.repeat(each[None], count, axis=0)], axis=1)
        right = np.stack([with_all(by_frequency), with_all(by_damping)]
                         + [SHAPE_STD * with_all(modes)] * len(each), axis=1)
        coloured = COLOUR_STD * _curves(self.points).T[..., None, None] * (
            self.spectrum - self.under(self.noise))
        return (left.reshape(-1, 1, width), right.conj().reshape(-1, *right.shape[2:])), coloured

    def moved(self, deviations):
        """Return the model with other modes and another colour, by so many deviations each."""
        count, width = self.shapes.shape
        modes = deviations[:-DEGREE].reshape(count, 2 + 2 * width)
        return replace(
            self, frequencies_hz=self.frequencies_hz * (
                1 + FREQUENCY_STD * self.damping * modes[:, 0]),
            damping=self.damping * np.exp(DAMPING_STD * modes[:, 1]),
            shapes=self.shapes + SHAPE_STD * (modes[:, 2::2] + 1j * modes[:, 3::2]),
            colour=self.colour * np.exp(COLOUR_STD * _curves(self.points) @ deviations[-DEGREE:]))

    def _mean_products(self, left):
        """Return the mean over a band of responses (b, n, k) times those of all, (k, m + 2, b)."""
        return (left.swapaxes(1, 2) @ self.responses.conj()).transpose(1, 2, 0) / left.shape[1]


def begun(modes, points):
    """Return the ModalModel of modes as they were identified, at points (b, n) of the bands."""
    hz = np.array([m.frequency_hz for m in modes])
    # a resonance narrower than the points lie would be missed by them
    least = (points[0, -1] - points[0, 0]) / (points.shape[1] - 1) / 2
    shapes = np.array([np.real(m.shape / m.shape[np.argmax(np.abs(m.shape))]) for m in modes])
    count, size, logs = len(modes), len(modes) + 2 * shapes.shape[1], np.log(hz)
    pairs = np.array([(i, j) for i in range(size) for j in range(i, size)
                      if j >= count or j - i <= NEXT or abs(logs[i] - logs[j]) < FAR])
    return ModalModel(points, hz, np.maximum([m.damping_ratio for m in modes], least / hz),
                      shapes + 0j, np.ones(len(points)), pairs)


def refined(model, spectrum, averages):
    """Return a ModalModel that is nearest to a spectrum (b, l, l) of so many averages."""
    best = forced(model, spectrum, spectrum)
    left = distance(best.spectrum, spectrum)
    for _ in range(ROUNDS):
        there = forced(best.moved(_step(best, spectrum, averages)), spectrum, best.spectrum)
        before, left = left, distance(there.spectrum, spectrum)
        if left < before:
            best = there
        if left > (1 - GAIN) * before:
            break
    return best


def forced(model, spectrum, found):
    """Return a model under the forces that are nearest to a spectrum, begun at one like it."""
    for step in range(STEPS):
        lower = lower_of(found, spectrum, first=found is spectrum)
        rows = white_products(lower, *model.products)
        values = _solved(rows, white_vectors(lower, spectrum[None])[0], 0)
        model = replace(model, forces=values)
        found = model.spectrum
    return model


def _step(model, spectrum, averages):
    """Return the deviations by which modes and colour are off."""
    lower, (modes, colour) = lower_of(model.spectrum, spectrum), model.tangents()
    rows = [white_products(lower, *modes), white_vectors(lower, colour),
            white_products(lower, *model.products)]
    free = len(rows[0]) + len(rows[1])
    rest = white_vectors(lower, (spectrum - model.spectrum)[None])[0]
    found = _solved(np.concatenate(rows), rest, free, averages)
    return np.clip(found[:free], -1.0, 1.0)


def _solved(rows, rest, free, averages=1.0):
    """Return the sum of rows nearest to a rest; the first ones are free by a deviation each."""
    norms = np.linalg.norm(rows, axis=1)
    known = np.full(len(rows), RIDGE)
    known[:free] = 1 / (averages * norms[:free] ** 2)
    return np.linalg.solve((rows @ rows.T) / np.outer(norms, norms) + np.diag(known),
                           (rows @ rest) / norms) / norms


def distance(found, spectrum):
    """Return how far a spectrum is from a model, tr W - log det W - l in the mean [nats]."""
    lower = inverse_root(bounded(found, spectrum, 1 / MISFIT, MISFIT))
    values = np.linalg.eigvalsh(white(lower, spectrum))
    return float(np.sum(values - np.log(values) - 1, axis=-1).mean())


def lower_of(model, spectrum, first=False):
    """Return the inverse Cholesky factor that whitens by a model, (b, l, l)."""
    # a model that is far from the spectrum, or no spectrum, gives no weights
    middle = (model + spectrum) / 2
    if np.linalg.eigvalsh(middle).min() <= 0.0:
        middle = bounded(middle, spectrum, *BOUNDED)
    weights = middle if first else bounded(model, middle, *BOUNDED)
    return inverse_root(weights)


def bounded(model, usual, low, high):
    """Return a model with its eigenvalues over another, positive one inside bounds."""
    factor = np.linalg.cholesky(usual)
    lower = np.linalg.inv(factor)
    values, vectors = np.linalg.eigh(lower @ model @ lower.conj().swapaxes(-1, -2))
    vectors = factor @ vectors
    return (vectors * np.clip(values, low, high)[:, None, :]) @ vectors.conj().swapaxes(-1, -2)


def _curves(points):
    """Return Chebyshev polynomials of log frequency without the constant one, (b, DEGREE)."""
    x = np.log(points.mean(axis=1))
    x = 2 * (x - x.min()) / (x.max() - x.min()) - 1
    return np.polynomial.chebyshev.chebvander(x, DEGREE)[:, 1:]


def _hermitian(left, right):
    """Return x y^H + y x^H, complex64."""
    found = (left[..., :, None] * right[..., None, :].conj()).astype(np.complex64)
    return found + found.conj().swapaxes(-1, -2)
