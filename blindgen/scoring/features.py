# Licensed under the Apache License, Version 2.0.
"""What the baselines compare: a record with a healthy recording, whatever the spacecraft."""
import numpy as np
from scipy.signal import csd

BANDS = 24                  # of equal width up to half the rate
SEGMENT = 1024
PEAKS = 6
REACH = 4                   # bins on either side of a peak


def features(bag, healthy):
    """
    Return what differs between two records: {'spectrum', 'shifts', 'samples'}, each (f,).

    Parameters
    ----------
    bag, healthy : (values (n, c), index (n,))
        Of one spacecraft.

    """
    segment = min(SEGMENT, min(len(values) for values, _ in (bag, healthy)) // 8)
    new, old = (_spectra(values, segment) for values, _ in (bag, healthy))
    ratio = np.log(new[0] / old[0])                            # (bins, c)
    bands = np.array([part.mean(axis=0) for part in np.array_split(ratio, BANDS)])
    bands = bands - np.median(bands)                           # a level alone is nothing
    odd = bands - np.median(bands, axis=1, keepdims=True)      # of one channel against the others
    coherence = np.array([np.abs(part).mean() for part in np.array_split(new[1] - old[1], BANDS)])
    worst = odd[:, np.argmax(np.abs(odd).sum(axis=0))]
    spectrum = np.concatenate([np.median(bands, axis=1), worst, np.abs(odd).max(axis=1),
                               coherence])
    return {'spectrum': spectrum, 'shifts': _shifts(new[0].sum(axis=1), old[0].sum(axis=1)),
            'samples': _samples(*bag) - _samples(*healthy)}


def _spectra(values, n):
    """Return the power (bins, c) and coherence with the next channel (bins, c), by Welch's n."""
    power = csd(values, values, nperseg=n, axis=0)[1].real[1:]
    turned = np.roll(values, 1, axis=1)
    cross = csd(values, turned, nperseg=n, axis=0)[1][1:]
    coherence = np.abs(cross)**2 / (power * np.roll(power, 1, axis=1))
    return power, coherence


def _shifts(new, old):
    """Return relative shift of frequency and of width (2 PEAKS,) of the old's highest peaks."""
    data, free = [], old.copy()
    for _ in range(PEAKS):
        k = int(np.argmax(free))
        near = slice(max(k - REACH, 0), k + REACH + 1)
        bins, moments = np.arange(len(old))[near], []
        for power in (old[near], new[near]):
            p = np.maximum(power - np.median(power), 1e-30)
            moments.append((p @ bins / p.sum(), p.sum()**2 / (p @ p)))
        data.append((k, moments[1][0] / max(moments[0][0], 1) - 1,
                     np.log(moments[1][1] / moments[0][1])))
        free[near] = 0
    data.sort()
    return np.array([t[1:] for t in data]).T.ravel()


def _samples(values, index):
    """Return what no spectrum shows: lost scans, tails, rounding, clipping, unsteadiness."""
    centred = values - values.mean(axis=0)
    rms = centred.std(axis=0)
    levels = np.log([part.std() for part in np.array_split(centred / rms, 10)])
    steps = np.unique(np.abs(np.diff(np.unique(values[:2000, 0]))))
    kurtosis = np.mean((centred / rms)**4, axis=0)
    return np.array([
        np.mean(np.diff(index) > 1), np.log(np.abs(centred / rms).max()),
        np.log(kurtosis.max()), np.log(kurtosis.min()),
        np.log(steps[0] / rms[0] if len(steps) else 1.0),
        np.mean(np.abs(values) == np.abs(values).max()), levels.std(), levels[-1] - levels[0],
        np.mean(np.diff(values, axis=0) == 0)])
