"""Streaming covariances equal their definition, also after very many hops."""
import numpy as np
import pytest
from ssi_ros.identify.lags import lag_products, Ring


def direct(values, first, last, lags):
    """Return the sums of y(t) y(t - k)^T over the rows first ... last - 1, by definition."""
    out = np.zeros((lags + 1, values.shape[1], values.shape[1]))
    for k in range(lags + 1):
        out[k] = values[first:last].T @ values[first - k:last - k]
    return out


def test_products_are_their_definition(rng):
    """All lags in one matrix product: equal to rounding."""
    values = rng.standard_normal((70, 3))
    products, counts = lag_products(values[:9], values[9:], 9)
    np.testing.assert_allclose(products, direct(values, 9, 70, 9), rtol=1e-12, atol=1e-12)
    assert counts == 61


def test_missing_pairs_are_not_counted(rng):
    """Masked products: the sums and counts of a plain double loop."""
    values = rng.standard_normal((40, 2))
    values[rng.random(values.shape) < 0.2] = np.nan
    products, counts = lag_products(values[:4], values[4:], 4)
    for k in range(5):
        for a in range(2):
            for b in range(2):
                pairs = values[4:, a] * values[4 - k:40 - k, b]
                assert counts[k, a, b] == np.count_nonzero(~np.isnan(pairs))
                assert products[k, a, b] == pytest.approx(np.nansum(pairs), abs=1e-12)


def test_ring_does_not_drift(rng):
    """After 10^6 samples the window equals the batch sum to 1e-12 of the variance."""
    lags, hops, size = 9, 12, 500
    ring, kept = Ring(hops, lags, 2), []
    for _ in range(2000):
        rows = rng.standard_normal((size, 2)) * [1.0, 100.0]
        ring.push(rows)
        kept = [*kept[-hops:], rows]
    values = np.concatenate(kept)
    expected = direct(values, size, len(values), lags)
    scale = np.sqrt(np.outer(np.diag(expected[0]), np.diag(expected[0])))
    assert np.abs((ring.tree[1] - expected) / scale).max() < 1e-12
