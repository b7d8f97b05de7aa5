"""
The gap statistic: how far a recorded spectrum is from an expected one, eq. (101) to (103), (141).

It is the log likelihood ratio of one common spectrum against two, for a band and an effective
average. An expected spectrum may itself be a mean of n averages, as that of a reference recording;
that of a model is the limit n = inf, where the ratio becomes tr W - log det W - d.
"""
from dataclasses import dataclass

import numpy as np
from scipy.special import digamma, polygamma
from ssi_ros.gap.comparison import GapStatistic
from ssi_ros.hermitian import inverse_root, white
from ssi_ros.tails import gamma

Z90 = 1.645             # standard deviations to both sides of a 90 % interval


@dataclass(frozen=True, eq=False)
class Gap(GapStatistic):
    """The gap statistic of a model, with the whitened spectra that it comes from."""

    whitened: np.ndarray = None     # (b, l, l), W of every band
    averages: float = np.nan        # effective number of independent spectra in a band
    known: int = 0                  # channels, the first ones, that are given: no gap is theirs

    def local_p_value(self, against=None, spread=1.0):
        """
        Return the p-value of the worst stretch of bands, of any length that is a power of two.

        A mean over all frequencies hardly shows a gap in few of them, (103a). `against`, of shape
        (b, l, l), is W of records that the model simulates, in place of 1; `spread` the factor of
        the variance that goes with it, one or of every band.
        """
        bands, width, least, tries = self._against(against), 1, 1.0, 0
        spread = np.broadcast_to(spread, len(bands))
        while width <= len(bands):
            distance = _from_white(_mean_of_bins(bands, width), self.known)
            floor, std = floor_of_band(self.averages * width, bands.shape[-1], known=self.known)
            # a gamma variable of that mean and deviation
            widest = spread[:len(distance) * width].reshape(-1, width).max(axis=1)
            least = min(least, gamma.sf((distance / widest).max(), (floor / std) ** 2,
                                        scale=std ** 2 / floor))
            tries, width = tries + len(distance), 2 * width
        return float(min(1.0, tries * least))

    def ratio(self, against):
        """Return the mean of D over its floor, against W of records that the model simulates."""
        return float(_from_white(self._against(against), self.known).mean() / self.floor)

    def _against(self, against):
        return self.whitened if against is None else whitened(against, self.whitened)

    @property
    def lost(self):
        """Log likelihood that the gap costs, beyond its floor."""
        return (self.value - self.floor) * len(self.bands) * self.averages


def measure(model, evidence, band_bins):
    """Return the Gap of an Evidence to the expected periodograms (a, k, l, l) of a model."""
    observed, _, model = evidence.against(model)
    bands = _mean_of_bins(whitened(model, observed).mean(axis=0), band_bins)
    distance, frame = _from_white(bands, evidence.known), evidence.frame
    averages = len(evidence.segments) * band_bins / frame.inflation_of(band_bins)
    floor, std = floor_of_band(averages, bands.shape[-1], known=evidence.known)
    width_hz = band_bins * frame.rate_hz / frame.rows
    edges = frame.frequencies_hz[0] + width_hz * np.arange(len(bands) + 1)
    return Gap(float(distance.mean()), floor, std / np.sqrt(len(bands)), distance - floor, edges,
               bands, averages, evidence.known)


def compare(one, two, prediction=None, trust=1.0):
    """Return the GapStatistic of the Spectra of a record to those of a reference, eq. (141)."""
    # `prediction` is what the reference becomes with an effect, its own mean if not given; D of
    # each band is multiplied with its weight `trust`, (b,) or one for all.
    m = two.freedom
    mean, n = (one.mean, np.full(one.cut.bands, one.freedom)) if prediction is None else (
        prediction.mean, prediction.freedom(one.freedom))
    # in units of the difference of reference and record themselves
    scale = (1 / one.freedom + 1 / m) / (1 / n + 1 / m)
    bands = scale * trust * divergence(mean, two.mean, n, m)
    floor, std = (scale * v for v in floor_of_band(m, mean.shape[-1], n))
    return GapStatistic(float(bands.mean()), float(floor.mean()),
                        float(np.sqrt(np.sum(std ** 2)) / len(bands)))


def whitened(model, other):
    """Return Hermitian matrices whitened by those of a model, each (..., l, l)."""
    return white(inverse_root(model), other)


def distance_of(periodograms, bins):
    """Return D of bands of so many bins of whitened periodograms (..., k, l, l), (..., b)."""
    return _from_white(_mean_of_bins(periodograms, bins))


def _mean_of_bins(periodograms, bins):
    *many, count, d, _ = periodograms.shape
    used = periodograms[..., :count // bins * bins, :, :]
    return used.reshape(*many, count // bins, bins, d, d).mean(axis=-3)


def divergence(expected, observed, n_expected, n_observed):
    """
    Return D of every band: the likelihood ratio of one against two matrices, (...), eq. (141).

    `expected` and `observed`, (..., l, l), are means of so many independent spectra; n_expected =
    inf for a spectrum that is known. D is about half of the squared relative difference.
    """
    if np.all(np.isinf(n_expected)):
        return _from_white(whitened(expected, observed))
    total = n_expected + n_observed
    share = np.asarray(n_expected / total)[..., None, None]
    pooled = share * expected + (1 - share) * observed
    ratio = (total * _logdet(pooled) - n_expected * _logdet(expected)
             - n_observed * _logdet(observed))
    return ratio * total / (n_expected * n_observed)


def _from_white(bands, known=0):
    """Return tr W - log det W - d, the divergence from a known spectrum, not of given channels."""
    whole = np.trace(bands, axis1=-2, axis2=-1).real - _logdet(bands) - bands.shape[-1]
    return whole - _from_white(bands[..., :known, :known]) if known else whole


def _logdet(matrices):
    return np.linalg.slogdet(matrices)[1]


def floor_of_band(n, d, n_expected=np.inf, known=0):
    """
    Return mean and standard deviation of D where both spectra are of one process.

    For complex Wishart matrices of d channels and n independent spectra, of a known spectrum E D =
    d log n - sum_i psi(n - i), var D = sum_i psi'(n - i) - d / n, i = 0 ... d - 1, eq. (102); of
    one estimated from n_expected spectra, (b,), eq. (142), the deviation to leading order. Of
    `known` channels that are given no terms count, i = known ... d - 1.
    """
    i, d = np.arange(known, d), d - known

    def mean_logdet(n):
        n = np.asarray(n, float)
        return np.sum(digamma(n[..., None] - i), axis=-1) - d * np.log(n)
    if np.all(np.isinf(n_expected)):
        return (float(-mean_logdet(n)), float(np.sqrt(np.sum(polygamma(1, n - i)) - d / n)))
    total = n_expected + n
    scale = total / (n_expected * n)
    mean = scale * (total * mean_logdet(total) - n_expected * mean_logdet(n_expected)
                    - n * mean_logdet(n))
    # the three terms are dependent; to leading order D is chi-squared of d^2 degrees
    inflation = mean / (scale * d ** 2 / 2)
    return mean, scale * np.sqrt(d ** 2 / 2) * inflation


def closed_share(whole, residual, floor, floor_std):
    """
    Return the share of a gap that is removed, and its 90 % interval by Fieller's theorem, (113).

    `whole` and `residual` are the gap above its floor before and after [nats], `floor` and
    `floor_std` mean and standard deviation of the gap after where nothing remains. What is removed
    and what remains are taken for normal and independent; noise that the gap before has in common
    with that after is not in what is removed.
    """
    removed = whole - residual
    # the distance is chi-squared, not central by what is not noise
    per_nat = 2 * floor_std ** 2 / floor
    of_removed = per_nat * max(removed, 0.0)
    of_residual = floor_std ** 2 + per_nat * max(residual, 0.0)
    a = whole ** 2 - Z90 ** 2 * (of_removed + of_residual)
    b = whole * removed - Z90 ** 2 * of_removed
    c = removed ** 2 - Z90 ** 2 * of_removed
    root = np.sqrt(max(b ** 2 - a * c, 0.0))
    return float(removed / whole), float((b - root) / a), float((b + root) / a)
