"""How far a bin of a whole record stands out of its neighbours: a line or a narrow mode."""
import numpy as np

from ssi_ros.gap.inference.goodness_of_fit import Z90
from ssi_ros.scipy_later import maximum_filter1d
from ssi_ros.tails import fisher

AROUND = 10             # bins around a line in which the reference is compared
OWN_BINS = 3            # of a line itself under its taper, on each side
WIDE = 60               # the same of one channel alone, beside the bands of the reference
KNOWN_LINE = 16.0       # times its neighbours, the reference may have a line there
SAME_MODE = 0.05        # relative difference of frequency of one mode in two recordings
LESS = 3.0              # times less damping than was identified a mode may have


def of_one_channel(recordings, power, before):
    """
    Return the chance of a line in the channel that shows it best, of all bins and channels, (f,).

    `power` (f, l) and `before` are of the bins of record and reference. It is seen beside many
    neighbours, over the bands of the reference; the mean of all channels would hide it.
    """
    cut, alone = recordings.full_cut, []
    for values, rows in ((power, len(recordings.pair.record)),
                         (before, len(recordings.pair.reference))):
        f = np.arange(len(values)) * cut.rate_hz / rows
        bands = np.searchsorted(cut.middles_hz + cut.width_hz / 2, f).clip(0, cut.bands - 1)
        flat = values / np.einsum('bii->bi', recordings.full_mean).real[bands]
        flat /= resonances(f, recordings, WIDE)
        alone.append(flat / flanks(flat, np.ones((len(flat), 1)), WIDE))
    at = np.rint(np.arange(len(power)) * (len(before) - 1) / (len(power) - 1)).astype(int)
    known = maximum_filter1d(alone[1], 2 * AROUND + 1, axis=0)[at] > KNOWN_LINE
    chance = fisher.sf(alone[0], 2, 2 * (WIDE - OWN_BINS))
    return np.where(known, 1.0, chance).min(axis=1) * power.size


def resonances(f, recordings, around):
    """Return how far narrow modes stand out of so many bins around them, (f, 1) from 1 on."""
    step, found = f[1], np.ones(len(f))
    reach = 2 * around * step
    known = list(recordings.nominal.identified)
    for m in known + [m for m in recordings.record_modes if any(
            abs(m.frequency_hz / k.frequency_hz - 1) < SAME_MODE
            and m.damping_ratio > k.damping_ratio / LESS for k in known)]:
        # of few bins damping is hardly known
        least = max(np.nan_to_num(m.damping_ratio - Z90 * m.damping_ratio_std),
                    m.damping_ratio / LESS)
        width = max(least * m.frequency_hz, step)
        near = np.abs(f - m.frequency_hz) < reach
        found[near] = np.maximum(found[near], (1 + (reach / width) ** 2) / (
            1 + ((f[near] - m.frequency_hz) / width) ** 2))
    return found[:, None]


def flanks(power, between, around=AROUND):
    """Return the mean power (f, l) around each bin, of bins where `between` (f, 1) is 1."""
    flank = np.ones(2 * around + 1)
    flank[around - OWN_BINS:around + OWN_BINS + 1] = 0.0

    def summed(values):
        return np.apply_along_axis(np.convolve, 0, values, flank, 'same')
    return np.maximum(summed(power * between) / np.maximum(summed(between), 1.0), 1e-300)
