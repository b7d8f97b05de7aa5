"""
What intervals hold beside the scatter of a fit: what filled gaps and laws of a hinge are off by.

Filled rows are drawn without the effect, so that sizes come out smaller, eq. (110c). A hinge that
rubs or has play is fitted by the linear hinge that it is equivalent to, eq. (120), which errors
of the model, where they are fitted too, take up in part.
"""
from dataclasses import replace

import numpy as np

from ssi_ros.effects.base import is_log
from ssi_ros.gap.candidate import priors_of
from ssi_ros.gap.nominal import model_answer
from ssi_ros.gap.selection.evidence import SizePrior

LAW = 0.15              # of a logarithm: python -m validation.gap_nominal, laws of a hinge


def filled_share(record):
    """Return the share of the rows of a Record that are filled, of those that are used."""
    if not record.raw:
        return 0.0
    used = ~np.isnan(record.samples.values).any(axis=1)
    return float(np.mean(np.isnan(record.raw[0].values).any(axis=1)[used]))


def wider(fit, share, law):
    """
    Return a Fit whose covariance holds what its quantities are off by, beside their scatter.

    A share `share` of filled rows says that a size is nought: it comes out smaller by as much, and
    the true one lies within that of it. Of a law of a hinge all logarithms are off by `law`.
    """
    candidate, more = fit.candidate, []
    for (i, f), prior in zip(candidate.numbers(), priors_of(candidate)):
        bias = 0.0
        if isinstance(prior, SizePrior):
            bias = share * (1 / prior.power if prior.distance is None else prior.distance)
        e = candidate.effects[i]
        more.append(bias ** 2 + law ** 2 * (e.hinge and e.nonlinear and is_log(f)))
    return replace(fit, covariance=fit.covariance + np.diag(more))


def parameters(comparison, ranked, detections):
    """Return the quantities of a candidate, see `model_answer`; intervals hold what they lack."""
    off = filled_share(comparison.record), LAW if comparison.prior else 0.0
    return model_answer.parameters(replace(ranked, fit=wider(ranked.fit, *off), others=tuple(
        replace(r, fit=wider(r.fit, *off)) for r in ranked.others)), detections)
