"""How stationary a reference is: the weight of each of its bands, eq. (143)."""
import numpy as np

from ssi_ros.gap.inference.goodness_of_fit import divergence, floor_of_band
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.scipy_later import uniform_filter1d

SMOOTH = 15             # bands over which the variation of power is averaged
WIDE, USUAL_APART = 61, 1.05    # the same for the way between the halves of a recording


def steadiness(spectra):
    """Return the share (b,) of a band's spectra that counts where it varies, (143)."""
    # Two tests: the power of the groups has the variance 1 / n where all is Gaussian and
    # stationary, and the first half is as far from the second as theory says. Bursts have more of
    # the one, and noise that came up or settled more of the other: a reference that differs from
    # itself cannot show that a record differs by less.
    power = np.einsum('gbii->gbi', spectra.groups).real
    weights = spectra.weights / spectra.weights.sum()
    away = power / np.tensordot(weights, power, 1) - 1
    freedom = spectra.cut.freedom(spectra.weights)[:, None, None]
    observed = np.sum(freedom * away ** 2, axis=0) / max(len(power) - 1, 1)
    share = 1.0 / np.maximum(_smooth(observed.mean(axis=1)) / LIMITS.usual_scatter.value, 1.0)
    apart, chance = halves_apart(spectra)
    floor = floor_of_band(spectra.freedom, power.shape[2], spectra.freedom)[0]
    excess = np.maximum(_smooth(apart, WIDE) - USUAL_APART * chance, 0.0)
    return np.minimum(share, floor / (floor + LIMITS.random_walk.value * excess))


def halves_apart(spectra):
    """Return the distance of both halves of a recording, shape (b,), and what chance makes."""
    middle = len(spectra) // 2
    if middle < 1:
        return np.zeros(spectra.cut.bands), 0.0
    one, two = spectra.only(np.arange(middle)), spectra.only(np.arange(middle, len(spectra)))
    first, second = one.mean, two.mean
    level = np.median(np.einsum('bii->bi', second).real / np.einsum('bii->bi', first).real)
    return (divergence(level * first, second, one.freedom, two.freedom),
            floor_of_band(two.freedom, first.shape[-1], one.freedom)[0])


def _smooth(values, size=SMOOTH):
    return uniform_filter1d(values, min(size, len(values)))
