"""
Which modes an excitation and a set of sensors can reach, and how long that takes, eq. (35).

A mode must be driven (excited), stand out of the noise of some sensor (seen), and be known better
than its distance from the next one (told apart).
"""
from dataclasses import dataclass
import math

import numpy as np

from ssi_ros.model.information import information, modal_view, spreads

NOT_EXCITED = 1e-5      # of the largest response rms: below are only the rounding errors of a zero
SEEN_AT = 0.1           # peak of the spectral density over that of the noise, best channel
FREQUENCY_TARGET = 1e-3
DAMPING_TARGET = 0.1


@dataclass(frozen=True)
class ModeReach:
    """
    What can be known about one mode.

    Attributes
    ----------
    frequency_hz, damping_ratio : float
        From theory.
    verdict : str
        'reached', 'not excited', 'not seen' or 'not told apart' (within an hour).
    rms : float
        That this mode alone gives to its best channel, in the unit of the channel.
    channel : str
        The best channel.
    peak_to_noise : float
        Spectral density at its peak over that of the noise, best channel [1].
    frequency_s, damping_s, apart_s : float
        Shortest record for a standard deviation of 0.1 % in frequency, of 10 % in damping, and
        of a quarter of the distance to the next reached mode [s]; infinite if there is none.
    frequency_spread, damping_spread : float
        Least relative standard deviation times the root of the length [s^0.5].

    """

    frequency_hz: float
    damping_ratio: float
    verdict: str
    rms: float
    channel: str
    peak_to_noise: float
    frequency_s: float = math.inf
    damping_s: float = math.inf
    apart_s: float = math.inf
    frequency_spread: float = math.inf
    damping_spread: float = math.inf


def reach(system, excitation=None):
    """
    Say which modes of a system can be excited, seen and told apart.

    Parameters
    ----------
    system : System
        Structure, sensors and, unless given, excitation.
    excitation : tuple, optional
        Parts that act in place of the system's own; only random, stationary ones count.

    Returns
    -------
    tuple of ModeReach
        By rising frequency. The lengths are Cramer-Rao bounds: no unbiased method needs less.

    """
    view = modal_view(system, excitation, at_channels=True)
    channels = len(system.channels)
    rows = np.eye(channels)
    noise = np.sqrt(np.diag(sum((s.noise_covariance(channels) for s in system.chain),
                                np.zeros((channels, channels)))))
    rms = view.amplitudes(rows)
    best = np.argmax(rms, axis=0)
    strongest = rms[best, np.arange(len(best))]
    # A resonance of variance s^2 peaks at the two-sided density s^2 / (2 pi xi f).
    peak = strongest ** 2 / (2 * np.pi * view.damping_ratios * view.frequencies_hz)
    ratio = peak / np.maximum(noise[best] ** 2 / view.rate_hz, 1e-300)
    excited = strongest > NOT_EXCITED * strongest.max() if strongest.max() > 0 else rms[0] > 0
    kept = np.flatnonzero(excited & (ratio > SEEN_AT))
    spread_f = np.full(len(best), math.inf)
    spread_xi, apart = spread_f.copy(), spread_f.copy()
    if len(kept):
        info = information(view, rows, noise, kept)
        spread_f[kept], spread_xi[kept] = spreads(info, len(kept))
        f = view.frequencies_hz[kept]
        for k, mode in enumerate(kept):
            others = np.delete(f, k)
            gap = np.min(np.abs(others / f[k] - 1)) if len(others) else math.inf
            apart[mode] = (4 * spread_f[mode] / gap) ** 2
    found = []
    for i in range(len(best)):
        verdict = ('not excited' if not excited[i] else 'not seen' if i not in kept else
                   'not told apart' if apart[i] > 3600 else 'reached')
        found.append(ModeReach(
            float(view.frequencies_hz[i]), float(view.damping_ratios[i]), verdict,
            float(strongest[i]), system.channels[best[i]], float(ratio[i]),
            float((spread_f[i] / FREQUENCY_TARGET) ** 2),
            float((spread_xi[i] / DAMPING_TARGET) ** 2), float(apart[i]),
            float(spread_f[i]), float(spread_xi[i])))
    return tuple(found)
