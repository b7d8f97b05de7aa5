"""A stiffness that drifts, at few instants: the spectra at all others follow by interpolation."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects.edits import scale_stiffness

ERROR = 1e-5            # of an interpolated spectrum


def drifting(setup, times_s):
    """
    Return a drifting setup at few instants, and how its spectra at others follow from these.

    A resonance is an analytic function of its frequency, up to its damping ratio zeta: with r half
    of the range of the relative frequency a polynomial at n Chebyshev points errs by
    exp(-n arsinh(zeta / r)). Source: Trefethen, Approximation Theory and Approximation Practice,
    2013, theorem 8.2.

    Parameters
    ----------
    setup : Setup
        With a drift.
    times_s : ndarray, (t,)
        Middles of the parts of a record.

    Returns
    -------
    tuple of Setup, (n,)
        Without drift, at the nodes; n is t where fewer would not do.
    ndarray, (t, n)
        Weights of their spectra in those at the times.

    """
    changes = setup.drift * np.asarray(times_s) / setup.duration_s
    nodes, weights = changes, np.eye(len(changes))
    few = _count(setup.system.state_space.diagonal[0], np.ptp(changes) / 4)
    if few < len(changes):
        from scipy.interpolate import BarycentricInterpolator    # hardly any diagnosis needs it
        middle, half = (changes.max() + changes.min()) / 2, np.ptp(changes) / 2
        nodes = middle + half * np.cos(np.pi * (np.arange(few) + 0.5) / few)
        weights = BarycentricInterpolator(nodes, np.eye(few))(changes)
    arrays = [a.name for a in setup.spacecraft.arrays]
    return tuple(replace(setup, system=scale_stiffness(setup.system, arrays, 1.0 + change),
                         drift=0.0) for change in nodes), weights


def _count(poles, half):
    """Return how many nodes do for a half range of relative frequency."""
    swinging = poles[poles.imag > 0]
    damping = (-swinging.real / np.abs(swinging)).min(initial=1.0)
    if damping <= 0.0:
        return np.inf
    ratio = damping / max(half, 1e-300)
    return max(2, int(np.ceil(-np.log(ERROR) / np.arcsinh(ratio))))
