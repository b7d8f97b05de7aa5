"""A channel whose values follow a curve, or a product of others, that they did not before."""
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.polynomial.hermite_e import hermeval
from scipy.fft import irfft, rfft

from ssi_ros.open_set.curves import ORDERS
from ssi_ros.open_set.families import calibrated, Finding, NEW
from ssi_ros.open_set.products import two_sided
from ssi_ros.tails import chi2

LEAST_REST = 0.01       # of what a channel shows, that another does not
CHANCE, SOME = 1e-3, 0.2        # by which a curve is in other channels too


@dataclass(frozen=True, eq=False)
class Motion:
    """One recording of n rows and l channels, and what its past says of it."""

    values: np.ndarray      # (n, l), without their means
    adjoint: np.ndarray     # (n, l): its product with what is added to channels is the score of it
    level: np.ndarray       # (n,), of the inputs, slow, in any unit
    rate_hz: float

    @cached_property
    def steady(self):
        """Motion and adjoint of unit variance at every level, (n, l) each."""
        # a level that varies has a kurtosis too
        values, adjoint = (v / self.level[:, None] for v in (self.values, self.adjoint))
        # what follows the motion of the same moment follows no curve; it would scatter more there
        adjoint = adjoint - values @ np.linalg.lstsq(values, adjoint, rcond=None)[0]
        return [v / np.where((s := v.std(axis=0)) > 0, s, 1.0) for v in (values, adjoint)]

    def polynomial(self, i, order):
        """Return the Hermite polynomial of channel `i`, (n,)."""
        return hermeval(self.steady[0][:, i], np.eye(order + 1)[order])

    def product(self, pair):
        """Return the product of two channels, (n,)."""
        return np.prod(self.steady[0][:, pair], axis=1)

    @cached_property
    def adjoint_spectra(self):
        """Spectra of that adjoint, (f, l)."""
        return rfft(self.steady[1], axis=0)

    @cached_property
    def adjoint_power(self):
        """Squares of their sizes, (f, l)."""
        return np.abs(self.adjoint_spectra) ** 2


def curve_beside(reference, record, channels):
    """
    Return the Finding of the channel that follows another curve than in the reference, eq. (188a).

    Of Gaussian motion a Hermite polynomial of one channel has no correlation with what any filter
    makes of all channels, so also not with the adjoint of the linear prediction, by which a change
    of that channel alone is seen best. What chance makes of it is seen at other shifts in time.

    Parameters
    ----------
    reference, record : Motion
        Of the same channels; the reference is None beside a model, whose sensors are linear.
    channels : sequence of str
        Their names.

    Returns
    -------
    Finding
        Of the family 'curve of a channel'.

    """
    z = np.array([_change(lambda m: _with_curves(m, i), reference, record)
                  for i in range(len(channels))])
    p_values = chi2.sf(np.sum(z ** 2, axis=1), len(ORDERS))
    i = int(np.argmin(p_values))
    duration_s = min(len(m.values) / m.rate_hz for m in (reference or record, record))
    p_value = calibrated('curve', min(1.0, len(p_values) * p_values[i]), duration_s)
    odd = [k % 2 for k in ORDERS]
    cubic = z[i, ORDERS.index(3)]
    how = 'one side differs from the other' if np.sum(z[i] ** 2 * np.subtract(1, odd)) > np.sum(
        z[i] ** 2 * odd) else f'its large motion is too {"large" if cubic > 0 else "small"}'
    order = ORDERS[int(np.argmax(np.abs(z[i])))]
    alone = _alone(record, record.polynomial(i, order), i)
    new = NEW * bool(reference)
    text = f'Channel {channels[i]} follows a curve, no straight line{new}: {how}.'
    if not alone:
        text = f'A force follows a curve of channel {channels[i]}{new}.'
    return Finding('curve of a channel', p_value, text, channels[i] if alone else '')


def product_beside(reference, record, channels):
    """Return the Finding of the channel that holds a product of two others, as `curve_beside`."""
    pairs = list(combinations(range(len(channels)), 2))
    if not pairs:
        return Finding('product of channels', 1.0, 'One channel has no product with others.')
    z = np.array([_change(lambda m: _correlations(m, m.product(p)), reference, record)
                  for p in pairs])
    at, i = np.unravel_index(np.argmax(np.abs(z)), z.shape)
    one, two = (channels[k] for k in pairs[at])
    alone = _alone(record, record.product(pairs[at]), i)
    what = f'Channel {channels[i]} holds' if alone else 'A force follows'
    return Finding('product of channels', two_sided(z, z.size),
                   f'{what} a product of {one} and {two}{NEW * bool(reference)}.',
                   channels[i] if alone else '')


def _alone(motion, curve, i):
    """Return whether a curve (n,) is in channel `i` alone, so that no force makes it."""
    if motion.values.shape[1] == 1:
        return True
    seen, scatter = _correlations(motion, curve)
    z = seen / scatter
    # adjoints of channels are correlated, and what one holds is seen in all
    of, spectra = np.abs(rfft(curve - curve.mean())) ** 2, motion.adjoint_spectra
    both = of @ (spectra[:, [i]].conj() * spectra).real
    power = of @ motion.adjoint_power
    alike = both / np.sqrt(np.maximum(power * power[i], 1e-300))
    rest = np.delete((z - alike * z[i]) ** 2 / np.maximum(1 - alike ** 2, LEAST_REST), i)
    # what is large is foreseen with an error of its own size
    return chi2.sf(rest.sum(), len(rest)) > CHANCE or rest.sum() < SOME * z[i] ** 2


def _with_curves(motion, i):
    """Return the correlations of an adjoint with the polynomials of its channel, and scatters."""
    found = [_correlations(motion, motion.polynomial(i, k)) for k in ORDERS]
    seen, scatter = np.array(found)[:, :, i].T
    # Gaussian y and v: cov(He_k(y) v) = k! r^k R + k k! r^(k - 1) c(t) c(-t), where the scatter
    # at other shifts has the first alone
    n = len(motion.level)
    y, v = rfft(motion.steady[0][:, i]), motion.adjoint_spectra[:, i]
    alike, own, crossed = (irfft(x, n) / n for x in (
        np.abs(y) ** 2, motion.adjoint_power[:, i], y.conj() * v))
    both_ways = crossed * np.roll(crossed[::-1], 1)
    first, second = (np.array([np.sum(alike ** (k - p) * x) for k in ORDERS])
                     for p, x in ((0, own), (1, both_ways)))
    share = ORDERS * np.maximum(second, 0.0) / np.maximum(first, 1e-300)
    return seen, scatter * np.sqrt(1 + share)


def _change(correlations, reference, record):
    """Return by how many deviations correlations of a record are others than before."""
    (before, spread), (now, more) = (correlations(m) if m else (0.0, 0.0)
                                     for m in (reference, record))
    return (now - before) / np.hypot(spread, more)


def _correlations(motion, curve):
    """Return the correlation of all adjoints with a curve (n,), (l,), and its scatter, (l,)."""
    n, curve = len(curve), curve - curve.mean()
    curve = curve / max(curve.std(), 1e-300)
    # the mean square over all shifts in time is that of chance: few of them are near 0
    power = np.abs(rfft(curve)) ** 2 @ motion.adjoint_power
    return motion.steady[1].T @ curve / n, np.maximum(np.sqrt(2 * power) / n ** 2, 1e-300)
