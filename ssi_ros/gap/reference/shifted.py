"""
Modes whose frequencies differ between the recordings, by the spreads of both, eq. (182), (183).

A mode that is sharper than a band moves inside it and changes no spectrum there; the
identification, which takes the whole recording, sees it.
"""
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.stats import t as student

from ssi_ros.gap.reference.extra import NONLINEAR
from ssi_ros.gap.reference.nominal import FARTHEST, HOPS
from ssi_ros.identify.shapes import mac

SAME = 0.9              # MAC of a mode that is found again
LIKE = 0.5              # and of a neighbour that it could be taken for
SIZES = np.geomspace(1e-5, 0.3, 40)     # of logarithms of frequency ratios
SURE = 1e-3             # p-value of a shift that is told
PRICE = 3.0             # nats of an unknown size
MOST = 100.0            # log odds that are believed
ALL_ALIKE = ('stiffness_scale', 'stiffness_drift')


@dataclass(frozen=True)
class Shifted:
    """
    Whether modes are elsewhere.

    Attributes
    ----------
    p_value : float
        Chance of the largest shift, of all modes; 1 where none is told.
    alike, each : float
        Log odds over chance that all frequencies changed by one factor, and each by its own.
    text : str
        In words, empty where nothing is seen.

    """

    p_value: float = 1.0
    alike: float = 0.0
    each: float = 0.0
    text: str = ''

    def tell(self, form):
        """Return a form with the log odds that the modes give to its effect."""
        if not self.text:
            return form
        if form.effect in ALL_ALIKE and not form.place:
            return replace(form, odds=self.alike)
        if form.effect in ('stiffness_scale', *NONLINEAR):
            return replace(form, odds=self.each)
        return form


def shifted_modes(before, after, width_hz):
    """
    Compare the frequencies of the modes of two recordings.

    Parameters
    ----------
    before, after : tuple of identified modes
        As of `identified`; with one channel, close modes are not told apart, and nothing is said.
    width_hz : float
        Of a band: a mode that moved farther is another one, or its spectrum tells.

    Returns
    -------
    Shifted

    """
    if not before or not after or len(before[0].shape) < 2:
        return Shifted()
    frequencies, ratios, spreads = _again(before, after)
    inside = np.abs(frequencies * np.expm1(ratios)) < width_hz
    frequencies, ratios, spreads = frequencies[inside], ratios[inside], spreads[inside]
    if not len(ratios):
        return Shifted()
    z = ratios / spreads
    p = min(1.0, float(len(z) * 2 * student.sf(np.abs(z).max(), HOPS - 1)))
    if p > SURE:
        return Shifted()
    most = int(np.argmax(np.abs(z)))
    each = _odds_each(z, spreads)
    told = min(each, MOST)
    # what parts both counts in full, within what is believed
    alike = float(np.clip(told + _odds_alike(ratios, spreads) - each, -MOST, MOST))
    return Shifted(p, alike, told, f'the mode at {frequencies[most]:.4g} Hz moved by '
                   f'{100 * np.expm1(ratios[most]):+.2g} % ({abs(z[most]):.0f} sd)')


def _again(before, after):
    """Return frequencies, logarithms of their ratios and spreads of modes found again."""
    (f_one, s_one, shapes_one), (f_two, s_two, shapes_two) = (
        (np.array([m.frequency_hz for m in modes]),
         np.array([m.frequency_std_hz / m.frequency_hz for m in modes]),
         np.array([m.shape for m in modes])) for modes in (before, after))
    alike = mac(shapes_one, shapes_two)
    ratios = np.log(f_two / f_one[:, None])
    pairs = [(i, j) for i, j in zip(*linear_sum_assignment(
        1 - alike + np.abs(ratios) / FARTHEST)) if alike[i, j] > SAME]
    # one that has another of its shape near by, in either recording, may be that one
    pairs = [(i, j) for i, j in pairs
             if 2 * abs(ratios[i, j]) < min(_apart(f_one, shapes_one, i),
                                            _apart(f_two, shapes_two, j))]
    i, j = np.array(pairs, int).reshape(-1, 2).T
    return f_one[i], ratios[i, j], np.hypot(s_one[i], s_two[j])


def _apart(frequencies, shapes, i):
    """Return the way from a mode to the nearest other of its shape, in log frequency."""
    like = mac(shapes[i:i + 1], shapes)[0] > LIKE
    like[i] = False
    return np.abs(np.log(frequencies[like] / frequencies[i])).min(initial=np.inf)


def _odds_each(z, spreads):
    """Return the log odds of changes of one size, each mode its own, over none, (183)."""
    share = SIZES[:, None] ** 2 / (SIZES[:, None] ** 2 + spreads ** 2)
    return float((share * z ** 2 + np.log1p(-share)).sum(axis=1).max() / 2) - PRICE


def _odds_alike(ratios, spreads):
    """Return the log odds of one factor for all frequencies over none."""
    weights = 1 / spreads ** 2
    gain = np.sum(weights * ratios) ** 2 / np.sum(weights)
    return float(gain - np.log1p(gain)) / 2 - PRICE
