"""
How lively a record was, for noise that comes from its motion, eq. (95b).

Jitter turns motion into noise. The power of lightly damped modes in ten minutes is off its mean
by a few per cent, and so is their noise: taken for the mean, it makes the size of a jitter wrong
by more than its interval, and leaves a gap of its own. What the motion was, the record says.
"""
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class Lively:
    """
    The motion that made noise.

    Attributes
    ----------
    levels : dict of str to float
        Power over nominal of each random part of the excitation, that it is told against.
    turn : ndarray, shape (l, l)
        Turns the covariance of what the model makes noise of, at these levels, into that of what
        the record made noise of.

    """

    levels: dict
    turn: np.ndarray

    def of(self, part, noise):
        """Return the noise of a part of the excitation that the record has, (..., l, l)."""
        return self.levels.get(getattr(part, 'name', None), 1.0) * (
            self.turn @ noise @ self.turn.T)


def liveliness(simulator, setup, levels, evidence):
    """
    Return the motion of a record that jitter takes from each channel, eq. (95b).

    Parameters
    ----------
    simulator : Simulator
        Model side.
    setup : Setup
        With a jitter.
    levels : ndarray, or None
        Levels, power over nominal; without them one each.
    evidence : Evidence
        What was recorded.

    Returns
    -------
    Lively

    """
    frame = simulator.frame
    still = simulator.spectrum(replace(setup, jitter_rms_s=0.0))
    levels = np.ones(len(still.names)) if levels is None else levels
    motion = still.at(np.append(levels[:-1], 0.0)).mean(axis=0)
    model = simulator.spectrum(setup).at(levels).mean(axis=0)
    omega = 2 * np.pi * frame.frequencies_hz
    kept = np.exp(-(omega * setup.jitter_rms_s) ** 2 / 2)[:, None, None]
    # the best linear estimate of the motion: where there is more noise, its mean is as good
    gain = np.linalg.solve(model, kept * motion).conj().swapaxes(1, 2)
    seen = gain @ evidence.mean[0] @ gain.conj().swapaxes(1, 2) + motion - gain @ motion * kept
    of_record, of_model = (np.linalg.cholesky(np.sum((1 - kept ** 2) * x.real, axis=0))
                           for x in (seen, motion))
    return Lively(dict(zip(still.names, levels)), of_record @ np.linalg.inv(of_model))
