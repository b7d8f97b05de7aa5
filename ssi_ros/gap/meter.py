"""The gap meter: how far whitened spectra are from white, with its floor, eq. (101) to (103)."""
from dataclasses import dataclass

import numpy as np
from scipy.special import digamma, polygamma
from scipy.stats import gamma


@dataclass(frozen=True, eq=False)
class Gap:
    """
    The gap of a record to a model.

    Attributes
    ----------
    value : float
        Mean over the bands of D = tr W - log det W - d, W the whitened mean [nats].
    floor, floor_std : float
        Its mean and standard deviation where the model is right.
    bands : ndarray, shape (b,)
        D of every band less its floor.
    edges_hz : ndarray, shape (b + 1,), [Hz]
        Between the bands.
    whitened : ndarray, shape (b, l, l)
        W of every band.
    looks : float
        Independent spectra in a band.

    """

    value: float
    floor: float
    floor_std: float
    bands: np.ndarray
    edges_hz: np.ndarray
    whitened: np.ndarray
    looks: float

    def local_p_value(self, against=None, spread=1.0):
        """
        Return the p-value of the worst stretch of bands, of any length that is a power of two.

        A mean over all frequencies hardly minds a gap in few of them, (103a).

        Parameters
        ----------
        against : ndarray, shape (b, l, l), optional
            W that the model leaves of its own records, in place of 1.
        spread : float
            How much larger it makes the variance.

        """
        white, width, least, tries = self._against(against), 1, 1.0, 0
        while width <= len(white):
            count = len(white) // width
            distance = _distance(white[:count * width].reshape(
                count, width, *white.shape[1:]).mean(axis=1))
            floor, std = floor_of_band(self.looks * width, white.shape[-1])
            # a gamma variable of that mean and deviation
            least = min(least, gamma.sf(distance.max() / spread, (floor / std) ** 2,
                                        scale=std ** 2 / floor))
            tries, width = tries + count, 2 * width
        return float(min(1.0, tries * least))

    def ratio(self, against):
        """Return the mean of the distance over its floor, against W of the model's own records."""
        return float(_distance(self._against(against)).mean() / self.floor)

    def _against(self, against):
        if against is None:
            return self.whitened
        lower = np.linalg.inv(np.linalg.cholesky(against))
        return lower @ self.whitened @ lower.conj().swapaxes(-1, -2)

    @property
    def deviations(self):
        """How many standard deviations the gap is above its floor."""
        return (self.value - self.floor) / self.floor_std


def measure(model, evidence, band_bins):
    """
    Measure the gap.

    Parameters
    ----------
    model : ndarray, shape (a, k, l, l)
        Expected periodograms.
    evidence : Evidence
        What was recorded.
    band_bins : int
        Bins of a band.

    Returns
    -------
    Gap

    """
    seen, times, model = evidence.against(model)
    lower = np.linalg.inv(np.linalg.cholesky(model))
    white = (lower @ seen @ lower.conj().swapaxes(-1, -2)).mean(axis=0)
    count = len(white) // band_bins
    d = white.shape[-1]
    whitened = white[:count * band_bins].reshape(count, band_bins, d, d).mean(axis=1)
    distance = _distance(whitened)
    frame = evidence.frame
    looks = len(evidence.pieces) * band_bins / frame.crowding_of(band_bins)
    floor, spread = floor_of_band(looks, d)
    edges = frame.frequencies_hz[:count * band_bins:band_bins]
    edges = np.append(edges, edges[-1] + band_bins * frame.rate_hz / frame.rows)
    return Gap(float(distance.mean()), floor, spread / np.sqrt(count), distance - floor, edges,
               whitened, looks)


def whitened(model, other):
    """Return other expected periodograms whitened by a model, each (a, k, l, l)."""
    lower = np.linalg.inv(np.linalg.cholesky(model))
    return lower @ other @ lower.conj().swapaxes(-1, -2)


def distance_of(white, bins):
    """Return D of the bands of whitened periodograms, shape (a, b)."""
    count, d = white.shape[1] // bins, white.shape[-1]
    bands = white[:, :count * bins].reshape(len(white), count, bins, d, d).mean(axis=2)
    return _distance(bands.reshape(-1, d, d)).reshape(len(white), count)


def _distance(white):
    return (np.trace(white, axis1=1, axis2=2).real - np.linalg.slogdet(white)[1]
            - white.shape[-1])


def floor_of_band(n, d):
    """
    Return mean and standard deviation of D for n independent spectra of d channels, eq. (102).

    For a complex Wishart matrix: E D = d log n - sum_i psi(n - i), var D = sum_i psi'(n - i)
    - d / n, i = 0 ... d - 1.
    """
    i = np.arange(d)
    mean = d * np.log(n) - np.sum(digamma(n - i))
    return float(mean), float(np.sqrt(np.sum(polygamma(1, n - i)) - d / n))
