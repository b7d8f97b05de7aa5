"""
Modes whose frequencies differ between the recordings, by the spreads of both, eq. (182), (183).

A mode that is sharper than a band moves inside it and changes no spectrum there; the
identification, which takes the whole recording, shows it.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects import ModalPattern
from ssi_ros.gap.nominal.modal.reference import FARTHEST, HOPS
from ssi_ros.gap.nominal.thresholds import LIMITS
from ssi_ros.identify.shapes import mac
from ssi_ros.scipy_later import linear_sum_assignment
from ssi_ros.tails import student

SIZES = np.geomspace(1e-5, 0.3, 40)     # of logarithms of frequency ratios
PRICE = 3.0             # nats of an unknown size
NAMED = 4               # modes that are named, which moved most
OVERLAP = 2.0           # half-power half-widths of both, within which two resonances overlap
ALL = (ModalPattern.COMMON_FREQUENCY_RATIO, ModalPattern.FREQUENCY_DRIFT)
EACH = (ModalPattern.MODE_FREQUENCIES, ModalPattern.HARDENING, ModalPattern.SOFTENING)


@dataclass(frozen=True)
class Shifted:
    """Whether modes are elsewhere."""

    p_value: float = 1.0    # of the largest shift, of all modes; 1 where none is detected
    alike: float = 0.0      # log odds over chance that all frequencies changed by one factor
    each: float = 0.0       # the same, each by its own
    text: str = ''          # in words, empty where nothing is detected

    def weighted(self, form):
        """Return a form with the log odds that the frequencies of the modes give it."""
        odds = {**dict.fromkeys(ALL, self.alike), **dict.fromkeys(EACH, self.each)}
        known = self.text and form.pattern in odds
        return replace(form, odds=odds[form.pattern]) if known else form


def shifted_modes(again, width_hz=np.inf):
    """Compare the frequencies of modes, as of `modes_again`, that moved by less: a `Shifted`."""
    # One that moved farther than the width of a band is another mode, or its spectrum shows it.
    frequencies, ratios, spreads = again[:, np.abs(again[0] * np.expm1(again[1])) < width_hz]
    if not len(ratios):
        return Shifted()
    z = ratios / spreads
    p = np.minimum(1.0, len(z) * 2 * student.sf(np.abs(z), HOPS - 1))
    if p.min() > LIMITS.detected.value:
        return Shifted()
    sure = np.sort([i for i in np.argsort(-np.abs(z))[:NAMED] if p[i] <= LIMITS.detected.value])
    each, limit = _odds_each(z, spreads), LIMITS.mode_odds.value
    believed = min(each, limit)
    # the difference of both counts in full, within what is believed
    alike = float(np.clip(believed + _odds_alike(ratios, spreads) - each, -limit, limit))
    words = [f'at {f:.4g} Hz moved by {100 * np.expm1(r):+.2g} % ({abs(d):.0f} sd)'
             for f, r, d in zip(frequencies[sure], ratios[sure], z[sure])]
    return Shifted(float(p.min()), alike, believed, f'the mode {", the one ".join(words)}')


def modes_again(before, after):
    """
    Return the modes of `identified` that are found again in a second recording (3, n).

    Rows: their frequencies [Hz], the logarithms of their ratios, and the spreads of those. With
    one channel, close modes are not distinguished: none is compared.
    """
    if not before or not after or len(before[0].shape) < 2:
        return np.zeros((3, 0))
    (f_one, s_one, shapes_one), (f_two, s_two, shapes_two) = (
        (np.array([m.frequency_hz for m in modes]),
         np.array([m.frequency_std_hz / m.frequency_hz for m in modes]),
         np.array([m.shape for m in modes])) for modes in (before, after))
    alike = mac(shapes_one, shapes_two)
    ratios = np.log(f_two / f_one[:, None])
    pairs = [(i, j) for i, j in zip(*linear_sum_assignment(
        1 - alike + np.abs(ratios) / FARTHEST)) if alike[i, j] > LIMITS.same_mode.value]
    # another of its shape near by may be that one; other forces show overlapping ones elsewhere
    pairs = [(i, j) for i, j in pairs
             if 2 * abs(ratios[i, j]) < min(_apart(before, i), _apart(after, j))]
    i, j = np.array(pairs, int).reshape(-1, 2).T
    return np.array([f_one[i], ratios[i, j], np.hypot(s_one[i], s_two[j])])


def _apart(modes, i):
    """Return the way from a mode to the nearest other of its shape, 0 if one overlaps it."""
    f, xi = np.array([(m.frequency_hz, m.damping_ratio) for m in modes]).T
    shapes = np.array([m.shape for m in modes])
    others = np.arange(len(f)) != i
    if np.any(np.abs(f - f[i]) < OVERLAP * (xi * f + xi[i] * f[i]), where=others):
        return 0.0
    like = others & (mac(shapes[i:i + 1], shapes)[0] > LIMITS.like_mode.value)
    return np.abs(np.log(f[like] / f[i])).min(initial=np.inf)


def _odds_each(z, spreads):
    """Return the log odds of changes of one size, each mode its own, over none, (183)."""
    share = SIZES[:, None] ** 2 / (SIZES[:, None] ** 2 + spreads ** 2)
    return float((share * z ** 2 + np.log1p(-share)).sum(axis=1).max() / 2) - PRICE


def _odds_alike(ratios, spreads):
    """Return the log odds of one factor for all frequencies over none."""
    weights = 1 / spreads ** 2
    gain = np.sum(weights * ratios) ** 2 / np.sum(weights)
    return float(gain - np.log1p(gain)) / 2 - PRICE
