"""The kernels of linear algebra against NumPy's own."""
import numpy as np
import pytest
from ssi_ros.identify.eigen import output_eigen
from ssi_ros.identify.realise import decompose


@pytest.mark.parametrize('n', [1, 2, 3, 8, 41, 60, 120])
@pytest.mark.parametrize('balanced', [True, False])
def test_output_of_eigenvectors(rng, n, balanced):
    """Eigenvalues and C phi are those of numpy.linalg.eig, up to order and scale."""
    a = rng.standard_normal((n, n)) / np.sqrt(n)
    if not balanced:                        # nested orders of a weak window look like this
        scale = 10.0 ** rng.uniform(-4, 4, n)
        a = a * scale / scale[:, None]
    c = rng.standard_normal((4, n))
    real, imag, output = output_eigen(a.copy(order='F'), c)
    values, vectors = np.linalg.eig(a)
    pairs = np.flatnonzero(imag > 0.0)
    np.testing.assert_array_equal(imag[pairs + 1], -imag[pairs])
    shapes = output.astype(complex)
    shapes[:, pairs] += 1j * output[:, pairs + 1]
    shapes[:, pairs + 1] = shapes[:, pairs].conj()
    found = real + 1j * imag
    at = np.abs(found[:, None] - values).argmin(axis=1)
    assert sorted(at) == list(range(n))
    np.testing.assert_allclose(found, values[at], atol=1e-11)
    expected = (c @ vectors)[:, at]
    like = np.abs((shapes.conj() * expected).sum(axis=0)) / (
        np.linalg.norm(shapes, axis=0) * np.linalg.norm(expected, axis=0))
    np.testing.assert_allclose(like, 1.0, atol=1e-9)


@pytest.mark.parametrize('rows, columns, rank', [(2, 2, 2), (40, 40, 12), (12, 90, 12)])
def test_leading_triplets(rng, rows, columns, rank):
    """They are those of a singular value decomposition, also of a matrix that lacks rank."""
    t = rng.standard_normal((rows, columns))
    u, s, v = decompose(t, rank)
    whole = np.linalg.svd(t)
    np.testing.assert_allclose(s, whole[1][:rank], rtol=1e-10)
    np.testing.assert_allclose(np.abs((u * whole[0][:, :rank]).sum(axis=0)), 1.0, rtol=1e-8)
    np.testing.assert_allclose(v.T @ v, np.eye(rank), atol=1e-8)
    half = t.copy()
    half[rows // 2:] = 0.0
    assert len(decompose(half, rank)[1]) == min(rank, rows // 2)
