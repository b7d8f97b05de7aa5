"""How far a reference agrees with itself: the share of its bands that can be trusted."""
import numpy as np
from scipy.ndimage import uniform_filter1d

from ssi_ros.gap.reference.distance import divergence, theory_floor

SMOOTH = 15             # bands over which the wandering of power is looked at
USUAL = 1.3             # times the scatter of Gaussian noise, which chance alone may show
WIDE, USUAL_APART = 61, 1.05    # the same for the way between the halves of a recording
WANDERS = 2.0           # how much more a random walk parts two recordings than two halves of one


def steadiness(spectra):
    """
    Return the share of each band's independent spectra that is left where it wanders, (143).

    Two looks: the power of the groups has the variance 1 / n where all is Gaussian and stationary,
    and the first half is as far from the second as theory says. Bursts have more of the one, and
    noise that came up or settled more of the other: a reference that differs from itself cannot
    tell that a record differs by less.

    Parameters
    ----------
    spectra : Spectra
        Of the reference.

    Returns
    -------
    ndarray, shape (b,)

    """
    power = np.einsum('gbii->gbi', spectra.groups).real
    weights = spectra.weights / spectra.weights.sum()
    away = power / np.tensordot(weights, power, 1) - 1
    freedom = spectra.cut.freedom(spectra.weights)[:, None, None]
    seen = np.sum(freedom * away ** 2, axis=0) / max(len(power) - 1, 1)
    share = 1.0 / np.maximum(_smooth(seen.mean(axis=1)) / USUAL, 1.0)
    apart, chance = halves_apart(spectra)
    floor = theory_floor(spectra.freedom, spectra.freedom, power.shape[2])[0]
    excess = np.maximum(_smooth(apart, WIDE) - USUAL_APART * chance, 0.0)
    return np.minimum(share, floor / (floor + WANDERS * excess))


def halves_apart(spectra):
    """Return the distance of both halves of a recording, shape (b,), and what chance makes."""
    middle = len(spectra) // 2
    if middle < 1:
        return np.zeros(spectra.cut.bands), 0.0
    one, two = spectra.only(np.arange(middle)), spectra.only(np.arange(middle, len(spectra)))
    first, second = one.mean, two.mean
    level = np.median(np.einsum('bii->bi', second).real / np.einsum('bii->bi', first).real)
    return (divergence(level * first, second, one.freedom, two.freedom),
            theory_floor(one.freedom, two.freedom, first.shape[-1])[0])


def _smooth(values, size=SMOOTH):
    return uniform_filter1d(values, min(size, len(values)))
