"""Cumulants of narrow bands: as far out as often as a Gaussian deviate."""
import numpy as np
import pytest
from scipy.stats import norm
from ssi_ros.gap.inference.score_test import Directions, Templates
from ssi_ros.gap.spectra.segmentation import Frame
from ssi_ros.open_set.outliers import _cumulants
from ssi_ros.updating.merged_bins import white_changes
from ssi_ros.updating.model_uncertainty import no_uncertainty
from ssi_ros.updating.score_variance import as_gaussian
from ssi_ros.windows import unit_taper

ROWS, DRAWS = 6000, 2000


@pytest.mark.parametrize('order', [3, 4])
def test_cumulants_of_a_narrow_band_have_no_long_tail(order):
    """Of a series of some 300 independent values; the plain ratio is 3 in one of 100."""
    rng, frequencies = np.random.default_rng(order), np.fft.rfftfreq(ROWS, 0.05)
    found = []
    for _ in range(DRAWS):
        noise = rng.standard_normal((2, len(frequencies)))
        found.append(_cumulants(np.fft.irfft(
            (noise[0] + 1j * noise[1]) / (1 + (frequencies / 0.5) ** 4), ROWS))[order - 3])
    found = np.array(found)
    for far in (1.0, 2.0):
        assert np.mean(found > far) == pytest.approx(norm.sf(far), rel=0.35)
        assert np.mean(found < -far) == pytest.approx(norm.sf(far), rel=0.6)
    assert np.mean(np.abs(found) > 3.0) < 5e-3


@pytest.mark.slow
def test_a_score_of_one_bin_has_the_tail_of_its_periodograms():
    """Ten of them, of two channels: three deviations as often as of a Gaussian."""
    taper = unit_taper(64, 1.0)
    overlap = np.zeros(64)
    overlap[0] = 1.0
    frame = Frame(1.0, 64, tuple(range(0, 640, 64)), 4, 12, taper, overlap)
    model = np.broadcast_to(np.eye(2), (1, 8, 2, 2)).astype(complex)
    change = np.zeros((1, 8, 2, 2), complex)
    change[0, 3, 0, 0] = 1.0
    here = Directions(Templates(('one',), white_changes(change, model[0]), {}, 1.0), model,
                      (model / 2, model / 2), no_uncertainty(frame, 2), frame, frame.used)
    skewness = here.skewness(np.array([0]))[0]
    count = here.weight
    assert 1.5 / np.sqrt(count) < skewness < 3.0 / np.sqrt(count)
    draws = np.random.default_rng(1).gamma(count, 1 / count, 200_000)
    z = as_gaussian((draws - 1) * np.sqrt(count), np.full(len(draws), 2 / np.sqrt(count)))
    assert np.mean(z > 3.0) == pytest.approx(norm.sf(3.0), rel=0.2)
