"""The most probable errors of a model: their likelihood, its derivatives, where its maximum is."""
from types import SimpleNamespace

import numpy as np
import pytest
from ssi_ros.hermitian import hermitian, real_vectors
from ssi_ros.updating.merged_bins import MergedBins
from ssi_ros.updating.model_uncertainty import ModelUncertainty
from ssi_ros.updating.probable_errors import ErrorLikelihood, factors, most_probable

BINS, CHANNELS, ERRORS, SEGMENTS, WEIGHT = 7, 3, 4, 2, 3.0


@pytest.fixture
def case():
    """Return an uncertainty, a record far from its model, and its whitened spectra."""
    rng = np.random.default_rng(1)
    size = BINS * CHANNELS ** 2
    free = ModelUncertainty(('error',) * ERRORS, 0.1 * rng.standard_normal((ERRORS, size)),
                            0.3 * rng.standard_normal(ERRORS))
    shape = SEGMENTS, BINS, CHANNELS, 12
    noise = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    spectra = noise @ noise.conj().swapaxes(-1, -2) / 16
    excess = np.array([real_vectors(s - np.eye(CHANNELS)).ravel() for s in spectra])
    white = SimpleNamespace(lower=np.zeros((1, BINS, CHANNELS, CHANNELS)), excess=excess,
                            weight=WEIGHT, heights=())
    return free, white, spectra


def every_bin(free):
    """Return the MergedBins in which none is merged."""
    return MergedBins(free.vectors, np.arange(BINS), np.ones(BINS))


def likelihood(free, spectra, errors, change=0.0):
    """Return the log likelihood of errors over that of none, of a model L (1 + change) L^H."""
    moved = np.linalg.cholesky(np.eye(CHANNELS) + change + np.zeros(spectra.shape[1:]))
    root = moved @ factors(hermitian((errors @ free.vectors).reshape(spectra.shape[1:])))
    model = root @ root.conj().swapaxes(-1, -2)
    value = sum(np.einsum('kii->', s - np.linalg.solve(model, s)).real for s in spectra)
    value -= len(spectra) * np.linalg.slogdet(model)[1].sum()
    both = errors + free.offset
    return WEIGHT * value - (both @ both - free.offset @ free.offset) / 2


def test_slopes_and_curvature_are_derivatives(case):
    """By the errors, and along a step, at errors that change the spectrum much."""
    free, white, spectra = case
    errors = np.array([0.8, -0.5, 0.3, 0.6])
    sought = ErrorLikelihood(every_bin(free), free.offset, white)
    here = sought.at(errors)
    assert here.value == pytest.approx(likelihood(free, spectra, errors), rel=1e-10)
    step = np.array([0.4, 0.1, -0.9, 0.2])
    for along, h in ((d, 1e-5) for d in np.eye(ERRORS)):
        up, down = (likelihood(free, spectra, errors + s * along) for s in (h, -h))
        assert here.slopes @ along == pytest.approx((up - down) / (2 * h), rel=1e-5)
    up, down = (likelihood(free, spectra, errors + s * step) for s in (1e-3, -1e-3))
    assert sought.curvature(here, step, sought.change(step)) == pytest.approx(
        (2 * here.value - up - down) / 1e-6, rel=1e-4)


def test_the_slope_of_the_model_counts_its_errors(case):
    """What a change of the model beside errors does to the likelihood."""
    free, white, spectra = case
    errors = np.array([0.8, -0.5, 0.3, 0.6])
    rng = np.random.default_rng(2)
    change = rng.standard_normal(spectra.shape[1:]) + 1j * rng.standard_normal(spectra.shape[1:])
    change = change + change.conj().swapaxes(-1, -2)
    up, down = (likelihood(free, spectra, errors, h * change) for h in (1e-5, -1e-5))
    slope = WEIGHT * free.seen(white, errors).sum(axis=0) @ real_vectors(change).ravel()
    assert slope == pytest.approx((up - down) / 2e-5, rel=1e-5)


def test_the_maximum_is_found_within_the_limit(case):
    """No errors near by are more probable; one that is pulled further stands at its limit."""
    free, white, spectra = case
    value, errors, _ = free.profile(white)
    assert value == pytest.approx(likelihood(free, spectra, errors))
    for step in 0.05 * np.vstack([np.eye(ERRORS), -np.eye(ERRORS)]):
        assert likelihood(free, spectra, errors + step) < value
    far = ModelUncertainty(free.names, free.vectors, np.array([0.0, -90.0, 0.0, 0.0]))
    assert far.profile(white)[1][1] == 4.0


def test_errors_that_are_not_free_stay(case):
    """Heights of modes are no errors of the model."""
    free, white, _ = case
    allowed = np.array([True, False, True, True])
    _, errors = most_probable(ErrorLikelihood(every_bin(free), free.offset, white),
                              np.eye(ERRORS) * 40.0, allowed)
    assert errors[1] == 0.0 and np.all(errors[allowed] != 0.0)
