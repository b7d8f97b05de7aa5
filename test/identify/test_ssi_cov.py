"""The core in one call, and the core on a sliding window."""
import numpy as np
import pytest
from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.identify import SlidingSsiCov
from ssi_ros.identify.lags import output_covariances, Ring
from ssi_ros.identify.shapes import mac
from ssi_ros.identify.ssi_cov import ssi_cov


@pytest.fixture(scope='module')
def record():
    """Return 150 s of two close pairs."""
    return accelerations(PAIR_HZ, PAIR_SHAPES, 150.0, np.random.default_rng(8))


@pytest.mark.parametrize('n, lags', [(4096, 99), (777, 30), (5000, 511), (512, 40)])
@pytest.mark.parametrize('missing', [0.0, 0.05])
def test_batch_covariances_equal_the_streaming_ones(rng, n, lags, missing):
    """By transforms of segments, and by products of rows: equal to 1e-12 of the variance."""
    values = rng.standard_normal((n, 3))
    values[rng.random(values.shape) < missing] = np.nan
    values -= np.nanmean(values, axis=0)
    ring = Ring(1, lags, 3)
    ring.push(values)
    a, b = ring.covariances(1.0), output_covariances(values, lags)
    np.testing.assert_allclose(b.values, a.values, atol=1e-12)
    np.testing.assert_array_equal(b.pairs.reshape(-1, 9)[:, 0], np.broadcast_to(
        a.pairs, (lags + 1, 3, 3)).reshape(-1, 9)[:, 0])


@pytest.mark.parametrize('weighting', ['cva', 'upc'])
def test_core_finds_the_modes(record, weighting):
    """Order 8 of a system of order 8 has its four modes with their shapes in the units given."""
    units = np.array([1.0, 10.0, 0.1, 1.0])
    poles, more = ssi_cov(record * units, 100.0, 40, (8, 20), weighting)
    order = np.argsort(poles.frequency_hz)
    # five times the spread of 150 s
    np.testing.assert_allclose(poles.frequency_hz[order], PAIR_HZ, rtol=4e-3)
    likeness = np.diagonal(mac(poles.shapes[order][:2], PAIR_SHAPES[:2] * units))
    assert (likeness > 0.98).all()
    assert more.order == 20


@pytest.mark.parametrize('change, word', [
    ({'block_rows': 1}, 'block rows'), ({'block_rows': 5000}, 'samples or more'),
    ({'orders': (200,)}, '1 to 196'), ({'orders': ()}, 'possible'),
    ({'weighting': 'none'}, 'known: cva')])
def test_core_says_what_is_allowed(record, change, word):
    """A wrong argument is told with what is allowed."""
    with pytest.raises(ValueError, match=word):
        ssi_cov(record, 100.0, **change)
    with pytest.raises(ValueError, match=r'\[1\] are constant'):
        ssi_cov(record * [1, 0, 1, 1], 100.0)


@pytest.mark.parametrize('weighting', ['cva', 'upc'])
def test_renewed_windows_equal_whole_ones(record, weighting):
    """Twenty hops from the subspace of the window before give the poles of a new decomposition."""
    warm = SlidingSsiCov(4, 100.0, 120.0, 1.0, 40, 20, weighting)
    got = warm.push(record[:14000])
    assert len(got) == 21 and warm.warm + warm.whole == 21 and warm.warm >= 15
    cold = SlidingSsiCov(4, 100.0, 120.0, 120.0, 40, 20, weighting)
    # the last window starts at 20 s; its first lags reach back into rows the cold one never saw
    last, = cold.push(record[2000:14000])
    for f in PAIR_HZ[:2]:
        a, b = (p.frequency_hz[np.abs(p.frequency_hz - f).argmin()] for p in (got[-1], last))
        assert abs(a - b) < 1e-3 * f              # the spread of 120 s
    warm.right = None                             # now the same rows, decomposed anew
    anew = warm._poles()
    for f in PAIR_HZ:
        a, b = (p.frequency_hz[np.abs(p.frequency_hz - f).argmin()] for p in (got[-1], anew))
        assert abs(a - b) < 2e-4 * f              # a quarter of the spread


def test_another_structure_is_found_at_once(rng):
    """Where the window before is no help, the poles are those of a whole decomposition."""
    sliding = SlidingSsiCov(4, 100.0, 20.0, 20.0, 30, 10)
    for f in (3.0, 20.0, 33.0):
        warm, = sliding.push(accelerations([f], PAIR_SHAPES[:1], 20.0, rng))
        sliding.right = None
        cold = sliding._poles()
        a, b = (p.frequency_hz[np.abs(p.frequency_hz - f).argmin()] for p in (warm, cold))
        assert abs(a - b) < 2e-4 * f and abs(b - f) < 0.02 * f
    assert sliding.whole >= 4                     # the first window, and three by hand


@pytest.mark.parametrize('change, word', [
    ({'hop_s': 7.0}, 'whole number'), ({'window_s': 1.0}, 'needs 200'), ({'order': 500}, '1 to')])
def test_sliding_core_says_what_is_allowed(change, word):
    """A wrong argument is told with what is allowed."""
    with pytest.raises(ValueError, match=word):
        SlidingSsiCov(4, 100.0, **{'window_s': 60.0, 'hop_s': 1.0, **change})
