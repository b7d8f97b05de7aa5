"""Products of small matrices by compiled loops are those of the library."""
import numpy as np
import pytest
from ssi_ros.hermitian import definite, inverse_root, real_vectors, SMALL, white, white_vectors

BINS = 7


def spectra(rng, *shape):
    """Return positive definite matrices of such a shape."""
    parts = rng.standard_normal((*shape, 2 * shape[-1], 2)).view(complex)[..., 0]
    return parts @ parts.conj().swapaxes(-1, -2)


@pytest.mark.parametrize('count', [1, 4, SMALL + 1])
@pytest.mark.parametrize('model, change', [
    ((BINS,), (BINS,)), ((BINS,), (3, BINS)), ((1, BINS), (3, BINS)), ((3, BINS), (1, BINS)),
    ((3, BINS), (3, BINS)), ((1,), (BINS,)), ((), (BINS,))])
@pytest.mark.parametrize('kind', [complex, np.complex64, float])
def test_white_is_its_definition(rng, count, model, change, kind):
    """Of every number of channels and axes, in double and single precision, also of reals."""
    expected = spectra(rng, *model, count)
    lower = inverse_root(expected.real if kind is float else expected.astype(kind))
    matrices = spectra(rng, *change, count)
    if kind is np.complex64:
        matrices = matrices.astype(kind)
    wanted = lower @ matrices @ lower.conj().swapaxes(-1, -2)
    found = white(lower, matrices)
    assert found.shape == wanted.shape and found.dtype == wanted.dtype
    assert np.abs(found - wanted).max() < 1e3 * np.finfo(kind).eps * np.abs(wanted).max()
    if wanted.ndim > 2:
        vectors, least = real_vectors(wanted), 1e3 * np.finfo(kind).eps * np.abs(wanted).max()
        assert np.abs(white_vectors(lower, matrices) - vectors).max() < least


@pytest.mark.parametrize('count', [1, 4, SMALL + 1])
def test_the_inverse_root_makes_its_matrices_white(rng, count):
    """It is lower triangular; what is not positive definite has none."""
    matrices = spectra(rng, BINS, count)
    lower = inverse_root(matrices)
    assert np.allclose(lower @ matrices @ lower.conj().swapaxes(-1, -2), np.eye(count))
    assert np.allclose(np.triu(lower, 1), 0.0, atol=1e-12)
    matrices[3] -= 2 * np.trace(matrices[3]) * np.eye(count)
    with pytest.raises(np.linalg.LinAlgError):
        inverse_root(matrices)


def test_channels_have_units_of_their_own():
    """A strain of 1e-9 beside an acceleration keeps its noise, whatever rounds."""
    units, rng = np.array([1.0, 1e-6]), np.random.default_rng(1)
    both = np.outer(units, units)
    motion = rng.standard_normal((5, 2, 1)) + 1j * rng.standard_normal((5, 2, 1))
    noise = 1e-6 * np.eye(2)[None]
    spectrum = motion @ motion.conj().swapaxes(1, 2) + noise
    assert np.allclose(definite(spectrum * both, noise * both) / both, spectrum, rtol=1e-9)
    # one that has lost its noise has it again
    lost = spectrum - 1.5 * noise
    assert np.linalg.eigvalsh(lost).min() < 0
    found = definite(lost * both, 1e-14 * noise * both) / both
    assert np.linalg.eigvalsh(found).min() > 0
