"""The gap meter: how far whitened spectra are from white, with its floor, eq. (101) to (103)."""
from dataclasses import dataclass

import numpy as np
from scipy.special import digamma, polygamma


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

    """

    value: float
    floor: float
    floor_std: float
    bands: np.ndarray
    edges_hz: np.ndarray
    whitened: np.ndarray

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
    distance = (np.trace(whitened, axis1=1, axis2=2).real
                - np.linalg.slogdet(whitened)[1] - d)
    frame = evidence.frame
    floor, spread = floor_of_band(
        len(evidence.pieces) * band_bins / frame.crowding_of(band_bins), d)
    edges = frame.frequencies_hz[:count * band_bins:band_bins]
    edges = np.append(edges, edges[-1] + band_bins * frame.rate_hz / frame.rows)
    return Gap(float(distance.mean()), floor, spread / np.sqrt(count), distance - floor, edges,
               whitened)


def floor_of_band(n, d):
    """
    Return mean and standard deviation of D for n independent spectra of d channels, eq. (102).

    For a complex Wishart matrix: E D = d log n - sum_i psi(n - i), var D = sum_i psi'(n - i)
    - d / n, i = 0 ... d - 1.
    """
    i = np.arange(d)
    mean = d * np.log(n) - np.sum(digamma(n - i))
    return float(mean), float(np.sqrt(np.sum(polygamma(1, n - i)) - d / n))
