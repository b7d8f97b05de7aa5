"""What filled gaps take from the sizes that are fitted to a record, eq. (110c)."""
from dataclasses import replace

import numpy as np

from ssi_ros.gap.candidate import priors_of
from ssi_ros.gap.nominal import model_answer
from ssi_ros.gap.selection.evidence import SizePrior


def filled_share(record):
    """Return the share of the rows of a Record that are filled, of those that are used."""
    if not record.raw:
        return 0.0
    used = ~np.isnan(record.samples.values).any(axis=1)
    return float(np.mean(np.isnan(record.raw[0].values).any(axis=1)[used]))


def wider(fit, share):
    """
    Return a Fit with the bias of filled rows in its covariance.

    Filled rows are drawn without the effect, so a share `share` of the rows says that its size is
    nought: it comes out smaller by as much, and the true one lies within that of it.
    """
    sizes = [p if isinstance(p, SizePrior) else None for p in priors_of(fit.candidate)]
    bias = [0.0 if p is None else 1 / abs(p.power) if p.distance is None else p.distance
            for p in sizes]
    return replace(fit, covariance=fit.covariance + np.diag(np.square(bias)) * share ** 2)


def parameters(comparison, ranked, detections):
    """Return the quantities of a candidate, see `model_answer`; intervals hold that bias."""
    share = filled_share(comparison.record)
    ranked = replace(ranked, fit=wider(ranked.fit, share), others=tuple(
        replace(r, fit=wider(r.fit, share)) for r in ranked.others)) if share else ranked
    return model_answer.parameters(ranked, detections)
