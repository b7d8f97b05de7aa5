"""Before and after in the user's units: frequencies, damping, shapes and rms of a model."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.identify import Identification, identify
from ssi_ros.identify.shapes import mac
from ssi_ros.model import natural_modes

HOPS = 40               # of the window, between which the spreads are taken
NEAR = 0.05             # relative distance of frequency within which a mode may be the same


@dataclass(frozen=True, eq=False)
class Pair:
    """An identified mode and the model's mode that it is; the model's numbers."""

    mode: object
    frequency_hz: float
    damping_ratio: float
    mac: float


def identify_whole(samples):
    """
    Identify the modes of a whole record in one window.

    Returns
    -------
    WindowModes
        Without modes, it carries the reason.

    """
    # whole hundredths, so that the window is a whole number of hops; the hops give the spreads
    hop_s = max(int(100 * samples.duration_s / HOPS) / 100, 0.01)
    settings = Identification(window_s=hop_s * HOPS, hop_s=hop_s)
    return identify(samples, settings)[-1]


def pair(modes, system):
    """
    Return for each identified mode the model's mode that it is, or None.

    Nearest in frequency and alike in shape; every mode of the model is used once.

    Parameters
    ----------
    modes : sequence of Mode
        Identified, with the channels of the system in its order.
    system : System
        The model.

    Returns
    -------
    list of Pair or None

    """
    theory = natural_modes(system)
    return _match(modes, theory.frequencies_hz, theory.damping_ratios, theory.shapes.T)


def match_modes(modes, others):
    """Return for each identified mode the one of another record that it is, as `pair` does."""
    return _match(modes, np.array([m.frequency_hz for m in others]),
                  np.array([m.damping_ratio for m in others]), np.array([m.shape for m in others]))


def _match(modes, frequencies_hz, damping_ratios, shapes):
    from scipy.optimize import linear_sum_assignment
    found = [None] * len(modes)
    if not modes or not len(frequencies_hz):
        return found
    f = np.array([m.frequency_hz for m in modes])
    step = np.abs(f[:, None] / frequencies_hz - 1)
    likeness = mac(np.array([m.shape for m in modes]), shapes)
    for i, k in zip(*linear_sum_assignment(step / NEAR + (1 - likeness))):
        if step[i, k] < NEAR and likeness[i, k] > 0.5:
            found[i] = Pair(modes[i], float(frequencies_hz[k]), float(damping_ratios[k]),
                            float(likeness[i, k]))
    return found


def rms(periodograms, frame):
    """Return the rms of every channel in the bins used, shape (l,), [m/s^2]."""
    power = np.einsum('kii->i', periodograms).real
    # both signs of frequency; the taper has sum w^2 = 1, so that a bin holds power over rows
    return np.sqrt(2.0 * power / frame.rows)
