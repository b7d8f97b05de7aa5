"""
A line that is none: a mode that the reference has not, narrower than any bin, eq. (184).

Momentum in a wheel turns a free axis into a slow nutation without damping, whose amplitude and
phase walk with the forces on it. A sine has no skirts; such a mode has.
"""
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import f as fisher

OWN = 2                 # bins of a line itself, on each side
AROUND = 12             # bins in which its skirts are looked for
SURE = 1e-3
NEW_MODES = ('gyroscopic_coupling', 'fuel_slosh', 'attitude_controller')


def skirts(one, two, frequency_hz, rate_hz):
    """
    Return the chance that what is beside a line is the motion of the reference.

    Parameters
    ----------
    one, two : ndarray, shape (n, l)
        Reference and record.
    frequency_hz : float
        Of the line, to a bin.
    rate_hz : float
        Rate [Hz].

    Returns
    -------
    float

    """
    rows = min(len(one), len(two))
    one, two = one[:rows], two[:rows]
    taper = np.hanning(rows + 2)[1:-1][:, None]
    t = np.arange(rows) / rate_hz

    def without(f):
        wave = np.column_stack([np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t)]) * taper
        return two * taper - wave @ np.linalg.lstsq(wave, two * taper, rcond=None)[0]
    step = rate_hz / rows
    best = minimize_scalar(lambda f: np.sum(without(f) ** 2), method='bounded',
                           bounds=(frequency_hz - step, frequency_hz + step))
    centre = int(np.rint(best.x / step))
    bins = centre + np.concatenate([np.arange(-AROUND, -OWN), np.arange(OWN + 1, AROUND + 1)])
    bins = bins[(bins > 0) & (bins <= rows // 2)]
    after, before = (np.abs(np.fft.rfft(v, axis=0)[bins]) ** 2
                     for v in (without(best.x), one * taper))
    # the channels may move as one, and a taper shares half of a bin with the next
    freedom = len(bins)
    ratio = np.median(after.sum(axis=0) / before.sum(axis=0))
    return float(fisher.sf(ratio, freedom, freedom))


def line_or_mode(sign, one, two, rate_hz):
    """
    Return the sign of a line, or of a mode that the reference has not if it has skirts.

    Parameters
    ----------
    sign : Sign or None
        Of a line.
    one, two : ndarray, shape (n, l)
        Reference and record.
    rate_hz : float
        Rate [Hz].

    Returns
    -------
    Sign or None

    """
    if sign is None or skirts(one, two, sign.numbers['frequency_hz'][0], rate_hz) > SURE:
        return sign
    return replace(sign, effect=NEW_MODES[0], text=f'{sign.text} with skirts, as a mode has that '
                   'the reference has not, or a machine whose speed wanders')
