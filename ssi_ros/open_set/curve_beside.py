"""A channel whose values follow a curve that those of an earlier recording do not."""
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.hermite_e import hermeval

from ssi_ros.open_set.curves import ORDERS
from ssi_ros.open_set.families import calibrated, Finding
from ssi_ros.tails import chi2

APART = 0.1     # of a recording: motion and curve that are so much apart have no correlation


@dataclass(frozen=True, eq=False)
class Motion:
    """One recording, and what is expected of it: n rows, l channels, b bands."""

    values: np.ndarray      # (n, l), without their means
    level: np.ndarray       # (n,), of the inputs, slow, in any unit
    rate_hz: float
    middles_hz: np.ndarray  # (b,), of the bands
    mean: np.ndarray        # (b, l, l), spectra in them


def curve_beside(reference, record, channels):
    """
    Return the Finding of the channel that follows another curve than in the reference, eq. (188a).

    Of Gaussian motion a Hermite polynomial of one channel has no correlation with what any filter
    makes of all channels, so also not with S^-1 Y, by which a change of that channel alone is
    seen best. What chance makes of it is seen where both are apart in time.

    Parameters
    ----------
    reference, record : Motion
        Of the same channels.
    channels : sequence of str
        Their names.

    Returns
    -------
    Finding
        Of the family 'curve'.

    """
    (before, spread), (now, more) = (_correlations(m) for m in (reference, record))
    z = (now - before) / np.hypot(spread, more)
    p_values = chi2.sf(np.sum(z ** 2, axis=1), len(ORDERS))
    i = int(np.argmin(p_values))
    duration_s = min(len(m.values) / m.rate_hz for m in (reference, record))
    p_value = calibrated('curve', min(1.0, len(p_values) * p_values[i]), duration_s)
    odd = [k % 2 for k in ORDERS]
    cubic = z[i, ORDERS.index(3)]
    how = 'one side differs from the other' if np.sum(z[i] ** 2 * np.subtract(1, odd)) > np.sum(
        z[i] ** 2 * odd) else f'its large motion is too {"large" if cubic > 0 else "small"}'
    return Finding('curve', p_value, f'Channel {channels[i]} follows a curve, no straight line, '
                   f'and did not before: {how}.')


def _correlations(motion):
    """Return the correlation of S^-1 Y with polynomials of channels, (l, k), and its scatter."""
    n, apart = len(motion.values), round(APART * len(motion.values))
    found = np.zeros((2, motion.values.shape[1], len(ORDERS)))
    found[1] = 1.0
    # a level that varies has a kurtosis too
    adjoint, values = (v / motion.level[:, None] for v in (_adjoint(motion), motion.values))
    for i in np.flatnonzero((values.std(axis=0) > 0) & (adjoint.std(axis=0) > 0)):
        of = np.fft.rfft(adjoint[:, i] / adjoint[:, i].std()).conj() / n
        unit = values[:, i] / values[:, i].std()
        for j, k in enumerate(ORDERS):
            curve = hermeval(unit, np.eye(k + 1)[k])
            lags = np.fft.irfft(np.fft.rfft(curve - curve.mean()) * of, n) / curve.std()
            found[:, i, j] = lags[0], lags[apart:n - apart].std()
    return found


def _adjoint(motion):
    """Return the series of S^-1 Y in the bands, (n, l)."""
    n, hz = len(motion.values), motion.middles_hz
    f = np.fft.rfftfreq(n, 1 / motion.rate_hz)
    low, high = np.searchsorted(f, hz[[0, -1]])
    nearest = np.searchsorted((hz[1:] + hz[:-1]) / 2, f[low:high])
    spectrum = np.fft.rfft(motion.values, axis=0)
    inside = np.zeros_like(spectrum)
    inside[low:high] = np.einsum('kij,kj->ki', np.linalg.inv(motion.mean)[nearest],
                                 spectrum[low:high])
    return np.fft.irfft(inside, n, axis=0)
