"""Residuals over the level around them, so that events do not stand out by the level alone."""
import numpy as np

from ssi_ros.scipy_later import uniform_filter1d

AROUND = 160            # samples over which the level before and after is taken


def over_mean(residual, around):
    """Return residuals (n, l) over their level in so many samples around."""
    return residual / np.sqrt(uniform_filter1d((residual ** 2).mean(axis=1), around))[:, None]


def over_higher(residual):
    """Return residuals (n, l) over their level before or after, the higher; pulses are no part."""
    # so no crest stands out where motion begins or ends at once
    usual = uniform_filter1d(np.log((residual ** 2).mean(axis=1) + 1e-300), AROUND)
    at = np.clip(np.arange(len(residual)) + AROUND // 2 * np.array([[-1], [1]]), 0, len(usual) - 1)
    return residual / np.exp(usual[at].max(axis=0) / 2)[:, None]
