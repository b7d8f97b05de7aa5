# Licensed under the Apache License, Version 2.0.
"""What the baselines look at: whitened spectra, a table of shifts, and plain statistics."""
from blindgen.craft import assemble, frequencies
from blindgen.detect import NOMINAL
from blindgen.scenario import RATE_HZ
from blindgen.whittle import whitened_bands, whole
import numpy as np

# e1_a, e1_b, e2_a, e2_b into symmetric and antisymmetric bending and torsion
MOTIONS = np.array([[1, 1, 1, 1], [1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]]) / 4
REACH = 0.02                # of a mode's frequency, on either side, where its peak is looked for


def features(values, index, duration_s):
    """
    Return what a record shows: {'spectrum': (f,), 'shifts': (40,), 'samples': (16,)}.

    spectrum: log diagonal and normalised off-diagonal of What of whittle.py; shifts: frequency
    [Hz] and damping of the nominal's 20 modes by peak picking; samples: what no spectrum tells.
    """
    what = whitened_bands(whole(values, index, duration_s))
    power = np.einsum('bii->bi', what).real
    off = what / np.sqrt(power[:, :, None] * power[:, None, :])
    upper = np.triu_indices(4, 1)
    spectrum = np.concatenate([np.log(power).ravel(), off[:, upper[0], upper[1]].real.ravel(),
                               off[:, upper[0], upper[1]].imag.ravel()])
    centred = values - values.mean(axis=0)
    rms = centred.std(axis=0)
    levels = np.log([part.std() for part in np.array_split(centred, 10)])
    steps = np.unique(np.abs(np.diff(np.unique(values[:2000, 0]))))
    samples = np.array([
        np.log(len(values)), np.log(np.abs(centred).max() / rms.max()),
        np.log(np.mean((centred / rms)**4)), np.log(steps[0] if len(steps) else 1.0),
        np.mean(np.abs(values) == np.abs(values).max()), *(levels - levels.mean()),
        levels.std()])
    return {'spectrum': spectrum, 'shifts': shifts(whole(values, index, duration_s)),
            'samples': samples}


def shifts(values):
    """
    Return frequency [Hz] and damping of each nominal mode, (40,), by peak picking.

    The motion that shows a mode best has its power's centroid and the bandwidth of its peak:
    (sum P)^2 / sum P^2 is pi zeta f for a resonance, in Hz, up to a factor that all records share.
    """
    samples = len(values)
    power = np.abs(np.fft.rfft((values * np.hanning(samples)[:, None]) @ MOTIONS.T, axis=0))**2
    f = np.fft.rfftfreq(samples, 1 / RATE_HZ)
    told = []
    for hz in frequencies(assemble(NOMINAL))[0]:
        near = np.abs(f - hz) <= max(REACH * hz, 6 / samples * RATE_HZ)
        p = power[near][:, np.argmax(power[near].sum(axis=0))]
        p = np.maximum(p - np.median(p), 0)
        told.append((p @ f[near] / p.sum(),
                     p.sum()**2 / (p @ p) * RATE_HZ / samples / (np.pi * hz)))
    return np.array(told).T.ravel()
