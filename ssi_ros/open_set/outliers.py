"""Samples and inputs that are no Gaussian noise: spikes, bursts, switching torques."""
import numpy as np

from ssi_ros.open_set.products import two_sided
from ssi_ros.tails import chi2

ALONE = 0.6             # share of all channels that one has where it jumps alone
CLEAR = 1e-4            # p-value from which a jump is named
FACTORIAL = {3: 6.0, 4: 24.0}
CORNERS_HZ = 0.5, 2.0, 8.0      # of the low-passed input
FEWEST = 200            # samples, below which nothing is asked of their distribution


def _cumulants(series):
    """Return skewness and kurtosis of a Gaussian series, by its autocorrelation, as deviates."""
    n = len(series)
    unit = (series - series.mean()) / series.std()
    correlation = np.fft.irfft(np.abs(np.fft.rfft(unit)) ** 2, n) / n
    square, power = correlation * correlation, unit * unit
    of_third = n * FACTORIAL[3] * (square @ correlation)
    of_fourth = n * FACTORIAL[4] * (square @ square)
    # sums of the Hermite polynomials u^3 - 3 u and u^4 - 6 u^2 + 3
    skewness = (power @ unit - 3 * unit.sum()) / np.sqrt(of_third)
    kurtosis = (power @ power - 6 * power.sum() + 3 * n) / np.sqrt(of_fourth)
    # the third moment of He4 of a Gaussian series, 1728 sum r(a)^2 r(b)^2 r(a - b)^2
    cubes = np.fft.rfft(square).real ** 3
    third = 1728 * (2 * cubes.sum() - cubes[0] - (cubes[-1] if n % 2 == 0 else 0.0))
    return (_of_skewness(float(skewness), FACTORIAL[3] * n ** 2 / of_third),
            of_kurtosis(float(kurtosis), third / of_fourth ** 1.5))


def _of_skewness(z, n):
    """Return the deviate of a standardised skewness (D'Agostino, Biometrika 57, 1970)."""
    n = max(n, 8.0)
    beta = 3 * (n * n + 27 * n - 70) * (n + 1) * (n + 3) / (
        (n - 2) * (n + 5) * (n + 7) * (n + 9))
    square = np.sqrt(2 * (beta - 1)) - 1
    return float(np.arcsinh(z / np.sqrt(2 / (square - 1))) / np.sqrt(np.log(square) / 2))


def of_kurtosis(z, skewness):
    """
    Return the Gaussian deviate of a standardised kurtosis, of such skewness by chance.

    Source: Anscombe and Glynn, Biometrika 70, 1983.
    """
    a = 6 + 8 / skewness * (2 / skewness + np.sqrt(1 + 4 / skewness ** 2))
    shrunk = 1 + z * np.sqrt(2 / (a - 4))
    return float((1 - 2 / (9 * a) - np.cbrt((1 - 2 / a) / max(shrunk, 1e-9)))
                 / np.sqrt(2 / (9 * a)))


def spikes(record, rows):
    """Return p-value and text of samples, of one channel or of all, that no neighbour explains."""
    v = np.stack([record.series(a) for a in record.adjoint.T], axis=1)[rows]
    if len(rows) < FEWEST:
        return 1.0, 'too little is recorded'
    count = v.shape[1]
    white = v @ np.linalg.inv(np.linalg.cholesky(v.T @ v / len(v))).T
    joint = (white ** 2).sum(axis=1)
    single = (v / v.std(axis=0)) ** 2
    at, (row, channel) = int(np.argmax(joint)), np.unravel_index(np.argmax(single), single.shape)
    tails = (chi2.sf(joint[at], count) * len(v), chi2.sf(single[row, channel], 1) * v.size)
    z = np.array([_cumulants(c)[1] for c in v.T])
    p_values = (*(min(1.0, t) for t in tails), two_sided(z, len(z)))
    alone = single[row, channel] > ALONE * joint[at]
    best = int(alone) if min(tails) < CLEAR else int(np.argmin(p_values))
    texts = (f'all channels together jump at {rows[at] / record.rate_hz:.2f} s',
             f'channel {record.channels[channel]} jumps at '
             f'{rows[row] / record.rate_hz:.2f} s',
             f'channel {record.channels[int(np.argmax(np.abs(z)))]} has more large and small '
             'errors than noise')
    return min(1.0, len(p_values) * min(p_values)), texts[best]


def switching_input(record, adjoint, rows):
    """Return p-value and text of an input, of this adjoint (k,), that is not Gaussian."""
    z = []
    if len(rows) < FEWEST:
        return 1.0, 'too little is recorded'
    for corner_hz in (*CORNERS_HZ, np.inf):
        series = record.series(adjoint / (1 + (record.frequencies_hz / corner_hz) ** 4))[rows]
        z += _cumulants(series)
    best = int(np.argmax(np.abs(z)))
    corner_hz = (*CORNERS_HZ, np.inf)[best // 2]
    band = f'below {corner_hz:g} Hz ' if np.isfinite(corner_hz) else ''
    return two_sided(np.array(z), len(z)), f'the input {band}' + (
        'is not the same to both sides' if best % 2 == 0 else
        'switches between levels' if z[best] < 0 else 'comes in bursts')
