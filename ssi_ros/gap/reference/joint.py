"""Weigh an amplitude-dependent joint against a plain change of the structure, eq. (157)."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.gap.reference.amplitude import significance
from ssi_ros.gap.reference.extra import distortion_of, nonlinearity
from ssi_ros.gap.reference.fit import fit
from ssi_ros.gap.reference.forms import Form, stiffness_scale
from ssi_ros.gap.reference.rank import SURE

LOCKED = 5.0            # standard deviations of bursts that follow the phase of a mode
OTHER_LEVEL = 0.2       # natural logarithm of power, beyond which levels differ
MOVED = 4.0             # standard deviations by which a mode must have moved
SLOPE = 1e-3            # p-value of a slope inside the record, all modes together
DISTORTION = 1e-3       # share of the power of a channel


@dataclass(frozen=True, eq=False)
class Joint:
    """
    A nonlinear joint as a candidate, with the log odds of what no mean spectrum shows.

    `bursts` are those of the power that follows the phase of a mode, as part of them.
    """

    form: Form
    bonus: float
    bursts: float = 0.0


def joint(nominal, base, one, two, pair, dependence, names):
    """
    Return the nonlinear joints that the recordings speak for, and why in words.

    Three signs count: power far from the modes that follows the phase of a mode and grows faster
    than the level; a frequency that depends on the amplitude inside the record; modes that moved
    between recordings of another level. The last alone a plain change of stiffness explains as
    well.

    Parameters
    ----------
    nominal, base, one, two
        As elsewhere.
    pair : Pair
        The recordings.
    dependence : Dependence
        Of the record.
    names : sequence of str
        Effects to consider.

    Returns
    -------
    tuple of Joint
    tuple of str

    """
    modes = nominal.modes
    if not len(modes):
        return (), ()
    level = float(base.x[0])
    added, share = distortion_of(nominal, base, two.mean)
    locked = dependence.bursts / np.maximum(dependence.burst_stds, 1e-300)
    distorted = float(share.max()) > DISTORTION and locked.max() > LOCKED and level > OTHER_LEVEL
    slopes = len(modes) * significance(dependence.frequency_slopes, dependence.frequency_stds)
    sloped = float(slopes.min()) < SLOPE
    each = [f for f in stiffness_scale(nominal) if len(f.numbers) == len(modes)][-1]
    moved = fit(nominal, two.mean, one.freedom, two.freedom, (each,))
    z = moved.x[2:2 + len(modes)] / np.sqrt(np.diag(moved.covariance)[2:2 + len(modes)])
    shifted = np.abs(z).max() > MOVED and abs(level) > OTHER_LEVEL
    if not (distorted or sloped or shifted):
        return (), ()
    sign = level if abs(level) > OTHER_LEVEL else 1.0
    weights = np.clip(np.abs(z), 0, 20) ** 2
    rise = float(np.sum(weights * moved.x[2:2 + len(modes)]) / weights.sum() * np.sign(sign))
    if sloped and not shifted:
        rise = float(dependence.frequency_slopes[np.argmin(slopes)])
    if rise > 0:
        effect, also = 'cubic_stiffness', ('hinge_freeplay',)
        meaning = 'frequencies rise with the amplitude: hardening, or play that closes'
    else:
        effect, also = 'hinge_friction', ('hinge_freeplay',)
        meaning = 'frequencies fall with the amplitude: clearance that opens, or slip'
    texts, bonus, bursts = [], 0.0, 0.0
    if distorted:
        worst = int(np.argmax(locked))
        bursts = float(locked.max()) ** 2 / 2
        bonus += bursts
        texts.append(f'{100 * share.max():.2g} % of the power of {pair.channels[share.argmax()]} '
                     'is distortion that the level does not explain; it follows the phase of the '
                     f'mode at {modes.frequencies_hz[worst]:.4g} Hz ({locked[worst]:.0f} sd)')
    if sloped:
        bonus += min(SURE, -np.log(max(float(slopes.min()), 1e-300)))
        k = int(np.argmin(slopes))
        texts.append(f'inside the record the mode at {modes.frequencies_hz[k]:.4g} Hz changes by '
                     f'{100 * dependence.frequency_slopes[k]:+.2g} % where its amplitude grows '
                     'e-fold')
    if shifted:
        texts.append(f'the level differs by {10 * level / np.log(10):+.1f} dB and modes moved: '
                     f'{meaning}')
    chosen = effect if effect in names else next((n for n in also if n in names), None)
    if chosen is None:
        return (), tuple(texts)
    also = tuple(n for n in (effect, *also) if n != chosen)
    form = nonlinearity(nominal, chosen, added if distorted else None, meaning, also)
    return (Joint(form, bonus, bursts),), tuple(texts)
