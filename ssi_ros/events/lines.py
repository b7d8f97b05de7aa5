"""How far a bin of a whole record stands out of its neighbours: a line or a narrow mode."""
import numpy as np

from ssi_ros.gap.inference.goodness_of_fit import Z90

AROUND = 10             # bins around a line in which the reference is compared
OWN_BINS = 3            # of a line itself under its taper, on each side
SAME_MODE = 0.05        # relative difference of frequency of one mode in two recordings
LESS = 3.0              # times less damping than was identified a mode may have


def resonances(f, recordings):
    """Return how far narrow modes stand out of the bins around them, (f, 1) from 1 on."""
    step, found = f[1], np.ones(len(f))
    reach = 2 * AROUND * step
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


def flanks(power, between):
    """Return the mean power (f, l) around each bin, of bins where `between` (f, 1) is 1."""
    flank = np.ones(2 * AROUND + 1)
    flank[AROUND - OWN_BINS:AROUND + OWN_BINS + 1] = 0.0

    def summed(values):
        return np.apply_along_axis(np.convolve, 0, values, flank, 'same')
    return np.maximum(summed(power * between) / np.maximum(summed(between), 1.0), 1e-300)
