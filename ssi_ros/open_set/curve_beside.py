"""A channel whose values follow a curve, or a product of others, that they did not before."""
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.polynomial.hermite_e import hermeval

from ssi_ros.open_set.curves import ORDERS
from ssi_ros.open_set.families import calibrated, Finding
from ssi_ros.open_set.products import two_sided
from ssi_ros.tails import chi2

APART = 0.1     # of a recording: motion and curve that are so much apart have no correlation


@dataclass(frozen=True, eq=False)
class Motion:
    """One recording of n rows and l channels, and what its past says of it."""

    values: np.ndarray      # (n, l), without their means
    adjoint: np.ndarray     # (n, l): its product with what is added to channels is the score of it
    level: np.ndarray       # (n,), of the inputs, slow, in any unit
    rate_hz: float

    @property
    def steady(self):
        """Return motion and adjoint of unit variance at every level, (n, l) each."""
        # a level that varies has a kurtosis too
        both = [v / self.level[:, None] for v in (self.values, self.adjoint)]
        return [v / np.where((s := v.std(axis=0)) > 0, s, 1.0) for v in both]


def curve_beside(reference, record, channels):
    """
    Return the Finding of the channel that follows another curve than in the reference, eq. (188a).

    Of Gaussian motion a Hermite polynomial of one channel has no correlation with what any filter
    makes of all channels, so also not with the adjoint of the linear prediction, by which a change
    of that channel alone is seen best. What chance makes of it is seen where both are apart in
    time.

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
    z = _changes(reference, record, lambda unit, i: [hermeval(unit[:, i], np.eye(k + 1)[k])
                                                     for k in ORDERS])
    p_values = chi2.sf(np.sum(z ** 2, axis=1), len(ORDERS))
    i = int(np.argmin(p_values))
    duration_s = min(len(m.values) / m.rate_hz for m in (reference, record))
    p_value = calibrated('curve', min(1.0, len(p_values) * p_values[i]), duration_s)
    odd = [k % 2 for k in ORDERS]
    cubic = z[i, ORDERS.index(3)]
    how = 'one side differs from the other' if np.sum(z[i] ** 2 * np.subtract(1, odd)) > np.sum(
        z[i] ** 2 * odd) else f'its large motion is too {"large" if cubic > 0 else "small"}'
    return Finding('curve', p_value, f'Channel {channels[i]} follows a curve, no straight line, '
                   f'and did not before: {how}.', channels[i])


def product_beside(reference, record, channels):
    """Return the Finding of the channel that holds a product of two others, as `curve_beside`."""
    pairs = list(combinations(range(len(channels)), 2))
    if not pairs:
        return Finding('product', 1.0, 'One channel has no product with others.')
    z = _changes(reference, record, lambda unit, i: [unit[:, j] * unit[:, k] for j, k in pairs])
    i, at = np.unravel_index(np.argmax(np.abs(z)), z.shape)
    one, two = (channels[k] for k in pairs[at])
    return Finding('product', two_sided(z, z.size), f'Channel {channels[i]} holds a product of '
                   f'{one} and {two}, and did not before.', channels[i])


def _changes(reference, record, curves):
    """Return by how many deviations correlations of adjoints with curves changed, (l, k)."""
    (before, spread), (now, more) = (_correlations(m, curves) for m in (reference, record))
    return (now - before) / np.hypot(spread, more)


def _correlations(motion, curves):
    """Return the correlation of the adjoint of channels with curves, (l, k), and its scatter."""
    n, apart = len(motion.values), round(APART * len(motion.values))
    unit, adjoint = motion.steady
    found = []
    for i, of in enumerate(np.fft.rfft(adjoint, axis=0).conj().T / n):
        for curve in curves(unit, i):
            lags = np.fft.irfft(np.fft.rfft(curve - curve.mean()) * of, n)
            lags /= max(curve.std(), 1e-300)
            # of a channel that is silent all are 0
            found.append((lags[0], lags[apart:n - apart].std() or 1.0))
    return np.array(found).T.reshape(2, unit.shape[1], -1)
