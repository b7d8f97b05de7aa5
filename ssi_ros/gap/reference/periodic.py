"""What two recordings of one periodic excitation tell: signs and forms, eq. (170) to (177)."""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.reference.extra import positive, replacing
from ssi_ros.gap.reference.forms import Form, Number
from ssi_ros.gap.reference.pieces import spectra_of
from ssi_ros.gap.reference.repeats import (
    at_instants, delay_between, ENOUGH_PERIODS, LEAST_PERIODS, repeats_of, SAME_SIGNAL,
    same_signal)
from ssi_ros.gap.reference.signs import NEVER, Sign
from ssi_ros.gap.reference.swing import swing
from ssi_ros.gap.reference.unrepeated import line, sweep

TOLERANCE_PPM = 50.0    # by which clocks of two good recorders differ, and no gap
SURE = 6.0              # spreads of a period
GRID = 1000             # instants of a group at which a level is taken


def both_repeat(pair, period):
    """
    Return the periods of both recordings, or None where one has too few or does not repeat.

    Parameters
    ----------
    pair : Pair
        The recordings, without dither.
    period : int or None
        Rows of a period of the reference.

    Returns
    -------
    tuple of Repeats, or None

    """
    if period is None:
        return None
    both = [repeats_of(v, pair.rate_hz, period) for v in (pair.reference, pair.record)]
    return None if None in both else tuple(both)


def enough(repeats):
    """Return whether both recordings repeat themselves so often that the rest can be judged."""
    return repeats is not None and min(len(r.periods) for r in repeats) >= ENOUGH_PERIODS


def in_phase(pair, repeats):
    """
    Return recordings that begin at the same row of one signal, as far as their lengths allow.

    A segment under its taper holds some of the signal and not all of it; begun elsewhere it holds
    another part, and the spectra of the very same motion differ.

    Parameters
    ----------
    pair : Pair
        The recordings.
    repeats : tuple of Repeats, or None
        As of `both_repeat`.

    Returns
    -------
    Pair
        The same where they do not repeat themselves or had other signals.

    """
    if repeats is None:
        return pair
    delay, alike = delay_between(*repeats)
    if alike <= SAME_SIGNAL:
        return pair
    rows = len(repeats[0].mean)
    late = int(round(delay)) % rows
    sizes = len(pair.reference), len(pair.record)

    def left(cut):
        return min((n - c + 1) // rows for n, c in zip(sizes, cut)), -sum(cut)
    cut = max(((0, late), ((rows - late) % rows, 0)), key=left)
    if left(cut)[0] < LEAST_PERIODS:
        return pair
    return replace(pair, reference=pair.reference[cut[0]:], record=pair.record[cut[1]:],
                   missing=tuple(m[c:] for m, c in zip(pair.missing, cut)))


def clock(one, two):
    """
    Compare the lengths of the periods by the clocks of both recorders, (172).

    Only for one signal: another signal may have another period.
    """
    ppm = 1e6 * (one.period_rows / two.period_rows - 1)
    spread = 1e6 * np.hypot(one.period_std, two.period_std) / two.period_rows
    if abs(ppm) < TOLERANCE_PPM + SURE * spread or not same_signal(one, two):
        return None
    return Sign('clock_rate', {}, {'ppm': (float(ppm), '1e-6')}, NEVER,
                f'one signal repeats itself after {two.period_rows:.2f} rows of the record and '
                f'{one.period_rows:.2f} of the reference: a clock is wrong by {ppm:+.0f} ppm')


def periodic_signs(repeats, level, names):
    """
    Return the signs of a pair of periodic recordings.

    Parameters
    ----------
    repeats : tuple of Repeats, or None
        As of `both_repeat`; None has no signs.
    level : float
        Power of the record over that of the reference.
    names : sequence of str
        Effects to consider.

    Returns
    -------
    list of Sign

    """
    if repeats is None:
        return []
    signs = [clock(*repeats)]
    if enough(repeats):
        signs += [line(*repeats, level), sweep(*repeats), swing(*repeats)]
    return [s for s in signs if s is not None and s.effect in names]


def of_clock(sign, pair, cut):
    """Return the form of a clock: the reference, sampled by it, (177)."""
    step = 1 + 1e-6 * sign.numbers['ppm'][0]
    rows = np.arange(int((len(pair.reference) - 1) / step) + 1) * step
    return replacing(sign, pair, at_instants(pair.reference, rows), cut)


def of_unrepeated_sweep(sign, repeats, cut):
    """Return the form of a sweep: the power that does not repeat, where it passed, (177)."""
    one, two = (spectra_of(r.rest, cut).mean for r in repeats)
    low, high = sorted(v[0] for v in sign.numbers.values())
    passed = (cut.middles_hz > low - cut.width_hz) & (cut.middles_hz < high + cut.width_hz)
    added = positive(np.where(passed[:, None, None], two - one, 0.0))
    return Form(sign.effect, {}, (Number('relative_power', '1', 1.0, 0.0, 100.0),),
                lambda n, x: (None, x[0] * added), sign.text, constants=sign.numbers,
                measured=passed.sum() * added.shape[-1] ** 2 / 3)


def of_swing(sign, two, late_s):
    """
    Return the form of a level that swings: the power of each group over the mean of all.

    Spectra may begin so many seconds after the recording.
    """
    cosine, sine = sign.place['sizes']
    ends = np.cumsum(two.weights) * two.cut.rows / two.cut.rate_hz
    times = (np.arange(GRID * len(ends)) + 0.5) / GRID * ends[-1] / len(ends)
    angle = 2 * np.pi * (late_s + times) / sign.numbers['period_s'][0]
    power = np.square(1 + cosine * np.cos(angle) + sine * np.sin(angle))
    group = np.searchsorted(ends, times)
    levels = np.bincount(group, power) / np.bincount(group)
    levels /= levels @ two.weights / two.weights.sum()
    return Form(sign.effect, {}, (), lambda n, x: (None, None), sign.text, levels=levels,
                constants=sign.numbers)
