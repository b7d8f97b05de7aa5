"""The filter before thinning, against the library that it stands in for."""
import numpy as np
import pytest
from scipy.signal import firwin, freqz, kaiserord
from ssi_ros.identify.bands import EDGE, low_pass, STOP_DB


@pytest.mark.parametrize('factor', [2, 3, 5, 7, 16])
def test_low_pass_is_firwin(factor):
    """The same taps as scipy's to rounding; flat in the pass band, silent where it folds back."""
    count, beta = kaiserord(STOP_DB, 2.0 * (1.0 - 2.0 * EDGE) / factor)
    taps = low_pass(factor)
    np.testing.assert_allclose(taps, firwin(count | 1, 1.0 / factor, window=('kaiser', beta)),
                               atol=1e-15)
    hz, response = freqz(taps, worN=8192, fs=factor)       # rate behind the thinning is 1
    assert np.abs(np.abs(response[hz < EDGE]) - 1.0).max() < 2e-4
    assert np.abs(response[hz > 1.0 - EDGE]).max() < 2e-4   # 80 dB, a little less at the edge
