"""The gap meter: how far whitened spectra are from white, with its floor, eq. (101) to (103)."""
from dataclasses import dataclass

import numpy as np
from scipy.special import digamma, polygamma
from scipy.stats import gamma
from ssi_ros.gap.likelihood import white

Z90 = 1.645             # standard deviations to both sides of a 90 % interval


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
        bands, width, least, tries = self._against(against), 1, 1.0, 0
        while width <= len(bands):
            count = len(bands) // width
            distance = _distance(bands[:count * width].reshape(
                count, width, *bands.shape[1:]).mean(axis=1))
            floor, std = floor_of_band(self.looks * width, bands.shape[-1])
            # a gamma variable of that mean and deviation
            least = min(least, gamma.sf(distance.max() / spread, (floor / std) ** 2,
                                        scale=std ** 2 / floor))
            tries, width = tries + count, 2 * width
        return float(min(1.0, tries * least))

    def ratio(self, against):
        """Return the mean of the distance over its floor, against W of the model's own records."""
        return float(_distance(self._against(against)).mean() / self.floor)

    def _against(self, against):
        return self.whitened if against is None else whitened(against, self.whitened)

    @property
    def lost(self):
        """Log likelihood that the gap costs, beyond its floor."""
        return (self.value - self.floor) * len(self.bands) * self.looks

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
    bins = whitened(model, seen).mean(axis=0)
    count = len(bins) // band_bins
    d = bins.shape[-1]
    bands = bins[:count * band_bins].reshape(count, band_bins, d, d).mean(axis=1)
    distance = _distance(bands)
    frame = evidence.frame
    looks = len(evidence.pieces) * band_bins / frame.crowding_of(band_bins)
    floor, spread = floor_of_band(looks, d)
    edges = frame.frequencies_hz[:count * band_bins:band_bins]
    edges = np.append(edges, edges[-1] + band_bins * frame.rate_hz / frame.rows)
    return Gap(float(distance.mean()), floor, spread / np.sqrt(count), distance - floor, edges,
               bands, looks)


def whitened(model, other):
    """Return Hermitian matrices whitened by those of a model, each (..., l, l)."""
    return white(np.linalg.inv(np.linalg.cholesky(model)), other)


def distance_of(periodograms, bins):
    """Return D of the bands of whitened periodograms, shape (a, b)."""
    a, count, d = len(periodograms), periodograms.shape[1] // bins, periodograms.shape[-1]
    return _distance(periodograms[:, :count * bins].reshape(a, count, bins, d, d).mean(axis=2))


def _distance(bands):
    return (np.trace(bands, axis1=-2, axis2=-1).real - np.linalg.slogdet(bands)[1]
            - bands.shape[-1])


def closed_share(whole, left, floor, floor_std):
    """
    Return the share of a gap that is gone, with its 90 % interval by Fieller's theorem, (113).

    What is gone and what is left are taken for normal and independent; noise that the gap before
    has in common with that after is not in what is gone.

    Parameters
    ----------
    whole, left : float
        Gap above its floor before and after [nats].
    floor, floor_std : float
        Mean and standard deviation of the gap after where nothing is left.

    Returns
    -------
    share, low, high : float

    """
    gone = whole - left
    # the distance is chi-squared, not central by what is not noise
    per_nat = 2 * floor_std ** 2 / floor
    of_gone, of_left = per_nat * max(gone, 0.0), floor_std ** 2 + per_nat * max(left, 0.0)
    a = whole ** 2 - Z90 ** 2 * (of_gone + of_left)
    b = whole * gone - Z90 ** 2 * of_gone
    c = gone ** 2 - Z90 ** 2 * of_gone
    root = np.sqrt(max(b ** 2 - a * c, 0.0))
    return float(gone / whole), float((b - root) / a), float((b + root) / a)


def floor_of_band(n, d):
    """
    Return mean and standard deviation of D for n independent spectra of d channels, eq. (102).

    For a complex Wishart matrix: E D = d log n - sum_i psi(n - i), var D = sum_i psi'(n - i)
    - d / n, i = 0 ... d - 1.
    """
    i = np.arange(d)
    mean = d * np.log(n) - np.sum(digamma(n - i))
    return float(mean), float(np.sqrt(np.sum(polygamma(1, n - i)) - d / n))
