"""A channel whose gain varies in time, as it did not in an earlier recording."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.open_set.families import Finding, of_short_record
from ssi_ros.open_set.products import SLOW
from ssi_ros.tails import chi2

# of motion that makes the tails of short records heavy: python -m validation.gap_odd_channels
SHORT_S = 60.0
BLOCKS = 1000           # of a recording, within which what is slow is one value


@dataclass(frozen=True, eq=False)
class GainScores:
    """Scores of the gains of l channels in n rows, and how strong the motion is at each."""

    scores: np.ndarray      # (n, l), without correlation in time where no gain varies
    strength: np.ndarray    # (n, l, s), slow powers of the motion of each channel
    duration_s: float


def gain_beside(reference, record, channels):
    """
    Return the Finding of the channel whose gain varies more than in the reference, eq. (188b).

    Variation that goes with how strong the motion is does not count: curves make that of any
    channel, and nonlinear structures of those near by.

    Parameters
    ----------
    reference, record : GainScores
        Of the same channels.
    channels : sequence of str
        Their names.

    Returns
    -------
    Finding
        Of the family 'gain in time'.

    """
    before, now = (np.array([_slow(g, i) for i in range(len(channels))])
                   for g in (reference, record))
    # as much as it varied in the reference is usual
    p_values = chi2.sf(now / np.maximum(1.0, before / (2 * SLOW)), 2 * SLOW)
    i = int(np.argmin(p_values))
    p_value = of_short_record(min(1.0, len(p_values) * p_values[i]), SHORT_S,
                              min(g.duration_s for g in (reference, record)))
    return Finding('gain in time', p_value,
                   f'The gain of channel {channels[i]} varies slowly, and did not before.',
                   channels[i])


def _slow(of, i):
    """Return the square of the deviations of cosines and sines of one gain, `SLOW` of each."""
    blocks = min(BLOCKS, len(of.scores))
    begins = np.linspace(0, len(of.scores), blocks, endpoint=False).astype(int)
    lengths = np.diff(begins, append=len(of.scores))[:, None]
    score, power = (np.add.reduceat(of.scores[:, i] ** k, begins) for k in (1, 2))
    strength = np.add.reduceat(of.strength[:, i], begins) / lengths
    turns = np.exp(2j * np.pi * np.arange(1, SLOW + 1) * (np.arange(blocks)[:, None] + 0.5)
                   / blocks)
    shapes = np.hstack([np.ones((blocks, 1)), strength, turns.real, turns.imag])
    usual = shapes.shape[1] - 2 * SLOW
    total, many = shapes.T @ score, (shapes * power[:, None]).T @ shapes
    if not score.any():
        return 0.0
    to = many[usual:, :usual] @ np.linalg.pinv(many[:usual, :usual], hermitian=True)
    rest = total[usual:] - to @ total[:usual]
    return float(rest @ np.linalg.solve(many[usual:, usual:] - to @ many[:usual, usual:], rest))
