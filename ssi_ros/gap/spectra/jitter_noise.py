"""
The noise that sampling jitter makes of the motion of one record, eq. (95b).

The power of lightly damped modes in ten minutes is off its mean by a few per cent, and so is the
noise that jitter makes of it. Taken for the mean, it biases the jitter by more than its interval
and leaves a gap of its own. The record itself says what its motion was.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects.base import lateness


@dataclass(frozen=True, eq=False)
class JitterNoise:
    """Jitter noise of a record over that of the model."""

    levels: dict        # {name: power over nominal} of the random excitation that `turn` is of
    turn: np.ndarray    # (l, l), turns the model's covariance of it at these into the record's
    scan: tuple         # (l,), when each channel is read in a scan, whose instants err together

    def of(self, part, noise):
        """Return the noise of a part of the excitation that the record has, (..., l, l)."""
        return self.levels.get(getattr(part, 'name', None), 1.0) * (
            self.turn @ noise @ self.turn.T)


def scans_of(late):
    """Return when channels that are `late` are read if a scan begins with each of them."""
    # which channel is the first one no stamp says: rows pair channels by their nearest instants
    return [tuple(t + (t < first) for t in late) for first in sorted(set(late))] or [()]


def jitter_noise_of(simulator, setup, levels, evidence, scan):
    """Estimate the JitterNoise of an Evidence, a setup at levels, of a scan, eq. (95b)."""
    frame = simulator.frame
    still = simulator.spectrum(replace(setup, jitter_rms_s=0.0))
    motion = still.at(np.append(levels[:-1], 0.0)).mean(axis=0)
    model = simulator.spectrum(setup).at(levels).mean(axis=0)
    omega = 2 * np.pi * frame.frequencies_hz
    kept = np.exp(-(omega * setup.jitter_rms_s) ** 2 / 2)[:, None, None]
    # Wiener estimate of the motion: where noise dominates, its mean is as good
    gain = np.linalg.solve(model, kept * motion).conj().swapaxes(1, 2)
    observed = (gain @ evidence.mean[0] @ gain.conj().swapaxes(1, 2)
                + motion - gain @ motion * kept)
    lost = 1 - kept ** 2
    if scan:
        rows = lateness(np.subtract(scan, setup.late), frame.cycles)
        lost = lost * (rows[:, :, None] * rows[:, None].conj())
    of_record, of_model = (np.linalg.cholesky(np.sum((lost * x).real, axis=0))
                           for x in (observed, motion))
    return JitterNoise(dict(zip(still.names, levels)), of_record @ np.linalg.inv(of_model), scan)
