"""Modes of a recording are refined until they explain its spectrum, eq. (150b)."""
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from ssi_ros.hermitian import inverse_root, white_products, white_vectors
from ssi_ros.levels.modal_model import begun, distance, refined

HZ, DAMPING = np.array([2.0, 3.1, 3.4, 7.0]), np.array([0.01, 0.006, 0.01, 0.008])
SHAPES = np.array([[1.0, 0.6, 0.2], [0.4, 1.0, -0.5], [-0.3, 0.5, 1.0], [1.0, -0.8, 0.3]])


@pytest.fixture(scope='module')
def truth():
    """Return the model of four modes under coloured forces, little noise in each channel."""
    points = np.arange(0.5, 10.0, 0.04)[:, None] + np.linspace(-0.03, 0.03, 9)
    model = begun([SimpleNamespace(frequency_hz=f, damping_ratio=x, shape=s)
                   for f, x, s in zip(HZ, DAMPING, SHAPES)], points)
    first, second = model.pairs.T
    forces = 0.3 * (first < 4) * (second < 4) + 0.7 * (first == second) * (second < 4)
    forces = np.where(model.noise, 1e-5, forces)
    return replace(model, forces=forces, colour=1 / (1 + (points.mean(axis=1) / 3) ** 2))


def test_derivatives_are_those_of_the_spectrum(truth):
    """Of frequencies, damping, shapes and colour, by differences of 1e-4 deviations."""
    (left, right), colour = truth.tangents()
    found = left[..., :, None] * right[..., None, :].conj()
    found = np.concatenate([found + found.conj().swapaxes(-1, -2), colour])
    for number in range(0, len(found), 3):
        step = 1e-4 * np.eye(len(found))[number]
        by = (truth.moved(step).spectrum - truth.moved(-step).spectrum) / 2e-4
        np.testing.assert_allclose(found[number], by, rtol=0, atol=1e-5 * np.abs(by).max())


def test_modes_that_are_a_little_wrong_are_mended(truth):
    """Frequencies 0.3 half-widths off, damping a third, shapes a twentieth, forces white."""
    rng = np.random.default_rng(3)
    off = truth.moved(np.append(rng.uniform(-0.5, 0.5, 4 * 8), np.zeros(5)))
    start = replace(off, colour=np.ones(len(off.points)), shapes=off.shapes.real + 0j)
    found = refined(start, truth.spectrum, 100.0)
    assert distance(found.spectrum, truth.spectrum) < 1e-4
    width = truth.damping * truth.frequencies_hz
    assert np.all(np.abs(start.frequencies_hz - HZ).max() > 0.1 * width.min())
    assert np.all(np.abs(found.frequencies_hz - HZ) < 0.02 * width)
    np.testing.assert_allclose(found.damping, DAMPING, rtol=0.05)


def test_products_are_whitened_as_the_matrices_that_they_make():
    """A product of two vectors and its mirror, in each of three bands."""
    rng = np.random.default_rng(4)
    left, right = (rng.standard_normal((2, 5, 3, 4, 2)) @ [1, 1j])
    whole = left[..., :, None] * right[..., None, :].conj()
    whole = whole + whole.conj().swapaxes(-1, -2)
    lower = inverse_root(np.eye(4) + 0.1 * (whole @ whole)[0])
    np.testing.assert_allclose(white_products(lower, left, right), white_vectors(lower, whole),
                               atol=1e-12)
