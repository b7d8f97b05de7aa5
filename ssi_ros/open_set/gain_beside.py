"""A channel whose gain varies in time, as it did not in an earlier recording."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.open_set.families import Finding, NEW, of_short_record
from ssi_ros.open_set.products import SLOW
from ssi_ros.tails import chi2

# of motion that makes the tails of short records heavy: python -m validation.gap_odd_channels
SHORT_S = 60.0
CHANCE, SOME = 1e-2, 0.3        # by which other gains vary too
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
        Of the same channels; the reference is None beside a model, whose gains are constant.
    channels : sequence of str
        Their names.

    Returns
    -------
    Finding
        Of the family 'gain in time'.

    """
    before, now = (np.array([_slow(g, i)[0] if g else 0.0 for i in range(len(channels))])
                   for g in (reference, record))
    # as much as it varied in the reference is usual
    p_values = chi2.sf(now / np.maximum(1.0, before / (2 * SLOW)), 2 * SLOW)
    i = int(np.argmin(p_values))
    p_value = of_short_record(min(1.0, len(p_values) * p_values[i]), SHORT_S,
                              min(g.duration_s for g in (reference or record, record)))
    alone = _alone(record, i)
    what = f'The gain of channel {channels[i]} varies' if alone else (
        f'The structure changes, most near channel {channels[i]},')
    return Finding('gain in time', p_value, f'{what} slowly{NEW * bool(reference)}.',
                   channels[i] if alone else '')


def _alone(of, i):
    """Return whether the gain of channel `i` varies alone, so that nothing moves with it."""
    own, *mine = _slow(of, i)
    rest = [_beside(of, i, mine, j) for j in range(of.scores.shape[1]) if j != i]
    largest = max(rest, default=0.0)
    # what is large is foreseen with an error of its own size
    return len(rest) * chi2.sf(largest, 2 * SLOW) > CHANCE or largest < SOME * own


def _beside(of, i, mine, j):
    """Return the square of the deviations of gain `j` that those of gain `i` do not foresee."""
    (left, shapes, covariance), (_, theirs, other, many) = mine, _slow(of, j)
    begins = _begins(of)
    both = other.T @ (shapes * np.add.reduceat(of.scores[:, i] * of.scores[:, j], begins)[:, None])
    to = both @ np.linalg.pinv(covariance, hermitian=True)
    rest, many = theirs - to @ left, many - to @ both.T
    return float(rest @ np.linalg.lstsq(many, rest, rcond=None)[0])


def _begins(of):
    """Return the first rows of the blocks, (b,)."""
    return np.linspace(0, len(of.scores), min(BLOCKS, len(of.scores)), endpoint=False).astype(int)


def _slow(of, i):
    """
    Return how a gain varies slowly: the square of its deviations, and what that is made of.

    Sums of its scores with `SLOW` cosines and sines, (2 s,), beside what follows the strength of
    the motion, those shapes in every block, (b, 2 s), and the covariance of the sums.
    """
    begins = _begins(of)
    blocks = len(begins)
    lengths = np.diff(begins, append=len(of.scores))[:, None]
    score, power = (np.add.reduceat(of.scores[:, i] ** k, begins) for k in (1, 2))
    strength = np.add.reduceat(of.strength[:, i], begins) / lengths
    turns = np.exp(2j * np.pi * np.arange(1, SLOW + 1) * (np.arange(blocks)[:, None] + 0.5)
                   / blocks)
    usual = np.hstack([np.ones((blocks, 1)), strength])
    shapes = np.hstack([turns.real, turns.imag])
    if not score.any():
        return 0.0, np.zeros(2 * SLOW), shapes, np.eye(2 * SLOW)
    weighted = usual * power[:, None]
    shapes = shapes - usual @ (np.linalg.pinv(usual.T @ weighted, hermitian=True)
                               @ (weighted.T @ shapes))
    total, covariance = shapes.T @ score, (shapes * power[:, None]).T @ shapes
    return float(total @ np.linalg.solve(covariance, total)), total, shapes, covariance
