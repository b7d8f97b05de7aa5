"""Levels of the part of a record that a fit has not seen."""
import numpy as np

from ssi_ros.gap.inference.model_fit import LONGEST
from ssi_ros.gap.inference.whittle import whiten

STEPS = 3


def held_out(fit, spectra, fold):
    """
    Return what a Fit expects, (a, k, l, l), of the half that it has not seen, and its Spectra.

    Levels differ from recording to recording, and the impulses that half of the segments hold are
    not as many as those of the other half: neither says that an effect is wrong.
    """
    evidence = spectra.only(spectra.segments[1 - fold::2])
    model, ratios = fit.model, np.ones(len(fit.levels))
    for _ in range(STEPS):
        whitened = whiten(model, evidence)
        flat = whitened.directions([r * s for r, s in zip(ratios, fit.shares)])
        flat = flat.reshape(len(flat), -1)
        step, *_ = np.linalg.lstsq(flat.T, whitened.excess.ravel(), rcond=None)
        moved = ratios * np.exp(np.clip(step, -LONGEST, LONGEST))
        changed = fit.model + sum((r - 1) * s for r, s in zip(moved, fit.shares))
        if not np.isfinite(whiten(changed, evidence).likelihood):
            break
        model, ratios = changed, moved
    return model, evidence
