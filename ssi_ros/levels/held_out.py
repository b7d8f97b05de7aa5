"""Levels of the part of a record that a fit has not seen."""
import numpy as np

from ssi_ros.gap.inference.model_fit import LONGEST
from ssi_ros.gap.inference.whittle import whiten

STEPS = 3
STANDS = 0.01           # of the logarithm of a level: what is left moves no gap


def held_out(fit, spectra, fold):
    """
    Return what a Fit expects, (a, k, l, l), of the half that it has not seen, and its Spectra.

    Levels differ from recording to recording, and the impulses that half of the segments hold are
    not as many as those of the other half: neither says that an effect is wrong.
    """
    evidence = spectra.halves[1 - fold]
    ratios, model, whitened = np.ones(len(fit.levels)), fit.model, whiten(fit.model, evidence)
    for _ in range(STEPS):
        flat = whitened.directions([r * s for r, s in zip(ratios, fit.shares)])
        flat = flat.reshape(len(flat), -1)
        step = np.linalg.pinv(flat @ flat.T, hermitian=True) @ (flat @ whitened.excess.ravel())
        moved = ratios * np.exp(np.clip(step, -LONGEST, LONGEST))
        changed = fit.model + sum((r - 1) * s for r, s in zip(moved, fit.shares))
        there = whiten(changed, evidence)
        if not np.isfinite(there.likelihood):
            break
        model, ratios, whitened = changed, moved, there
        if np.abs(step).max() < STANDS:
            break
    return model, evidence
