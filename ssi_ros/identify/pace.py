"""
Whether stamps come at the rate of the grid: a comb with the grid's period is held against them.

Stamps t_k in ticks of the grid give the phasors exp(2 pi i t_k). At the rate of the grid, or a
whole part of it, they point one way however many samples are lost; at another rate they turn, and
their mean is short. Jitter shortens it too, but then no other comb holds them together.
"""
import cmath
from dataclasses import dataclass

import numpy as np
from ssi_ros.arrays import distinct, phasors

SHORT = 64              # stamps that tell a gross difference, 2 % or more
LONG = 256              # stamps that tell a fine one
TOGETHER = 0.5          # mean phasor below which stamps are not on the comb: jitter of 0.19 ticks
COMB = 0.7              # of another comb, to be believed: a step by half a tick gives 0.64
CROWDED = 1.2           # samples a tick, of different stamps, beyond which the grid is too slow
DRIFT = 1e-3            # relative difference of a rate that fits: clocks drift by 1e-4
LOST = 1.5e-3           # the same for one that has fitted so far
ALL = 0.9               # share of blocks at another rate, beyond which it is no change within
COMBS = (0.25, 2.6)     # rates over that of the grid that are tried
STEPS = 4096            # of them at most
MOST = 1 << 18          # stamps that are looked at at once


def fits(ticks, drift=DRIFT):
    """
    Return whether stamps come at the rate of the grid.

    Parameters
    ----------
    ticks : ndarray, shape (n,)
        Stamps of one channel in ticks of the grid; lost and doubled ones may be among them.
    drift : float
        Relative difference of the rates that is allowed.

    Returns
    -------
    bool
        True as well where they are too few or too uneven to tell.

    """
    ticks = distinct(ticks)
    if len(ticks) < 8:
        return True
    span = ticks[-1] - ticks[0]
    if len(ticks) - 1 > CROWDED * span:
        return False
    parts = np.array_split(ticks, max(1, len(ticks) // SHORT))
    means = np.array([_mean(p) for p in parts])
    if np.abs(means).min() >= TOGETHER:
        middles = [np.median(p) for p in parts]
        return len(parts) < LONG // SHORT or abs(_drift(middles, means)) <= drift
    worst = parts[int(np.abs(means).argmin())]
    return _best_comb(worst) < COMB


def _mean(ticks, rate=1.0):
    return np.exp(2j * np.pi * np.mod(rate * ticks, 1.0)).mean()


def _drift(middles, means):
    """Return by how much the rates differ, from the turning of the phases of parts."""
    turns = np.cumsum([0.0, *(cmath.phase(b / a) for a, b in zip(means, means[1:]))])
    at = np.asarray(middles) - np.mean(middles)
    return float(at @ turns / (at @ at)) / (2 * np.pi)


def _best_comb(ticks):
    """Return the largest mean phasor at any other rate."""
    since = ticks - ticks[0]
    number = int(min(STEPS, 2 * (COMBS[1] - COMBS[0]) * since[-1]))
    rates = np.linspace(*COMBS, max(2, number))
    return max(float(np.abs(np.exp(2j * np.pi * np.outer(some, since)).mean(axis=1)).max())
               for some in np.array_split(rates, max(1, len(rates) // 256)))


@dataclass(frozen=True)
class Verdict:
    """Which samples of a batch may be used, and where the pace was lost."""

    use: np.ndarray
    lost_at: int = None         # number of samples of the batch before that


class _Block:
    """SHORT stamps in ticks; plain where they clearly are on the comb, as nearly always."""

    def __init__(self, ticks):
        # a view would keep a day of stamps
        self.ticks, self.mean, self.middle = ticks.copy(), _mean(ticks), ticks[len(ticks) // 2]
        self.plain = (abs(self.mean) >= TOGETHER
                      and len(ticks) - 1 <= CROWDED * abs(ticks[-1] - ticks[0]))


class Pace:
    """Follow one channel in blocks of a fixed number of stamps, however they are bunched."""

    def __init__(self, off=False):
        self.off = off
        self._block, self._size, self._blocks = [], 0, []

    def take(self, ticks):
        """Return the Verdict on stamps in ticks; those of a channel that is off are not used."""
        use, at, lost_at = np.zeros(len(ticks), dtype=bool), 0, None
        while at < len(ticks) and lost_at is None:      # the rest is judged by another rate
            plain = self._plain(ticks[at:at + MOST])
            if plain:
                use[at:at + plain] = True
                at += plain
                continue
            n = min(SHORT - self._size, len(ticks) - at)
            use[at:at + n] = not self.off
            self._block.append(ticks[at:at + n])
            self._size, at = self._size + n, at + n
            if self._size == SHORT and self._judge():
                lost_at = at
        return Verdict(use, lost_at)

    def _plain(self, ticks):
        """Take what is in whole blocks that clearly are on the comb; return how many stamps."""
        count, width = len(ticks) // SHORT, LONG // SHORT
        before = self._blocks[1 - width:]
        if self.off or self._size or count < width or not all(b.plain for b in before):
            return 0
        blocks = ticks[:count * SHORT].reshape(count, SHORT)
        means = phasors(np.mod(blocks, 1.0)).mean(axis=1).conj()
        good = (np.abs(means) >= TOGETHER) & (
            SHORT - 1 <= CROWDED * np.abs(blocks[:, -1] - blocks[:, 0]))
        middles = np.append([b.middle for b in before], blocks[:, SHORT // 2])
        means = np.append([b.mean for b in before], means)
        # as `_drift`, of all LONG stamps that end with each block
        windows = np.lib.stride_tricks.sliding_window_view
        turns = windows(np.cumsum(np.append(0.0, np.angle(means[1:] / means[:-1]))), width)
        at = windows(middles, width)
        at = at - at.mean(axis=1, keepdims=True)
        # stamps that stand still have no pace to keep
        spread = 2 * np.pi * (at * at).sum(axis=1)
        drifts = np.divide((at * turns).sum(axis=1), spread, out=np.full(len(at), np.inf),
                           where=spread > 0.0)
        good[count - len(drifts):] &= np.abs(drifts) <= LOST
        if not good.all():
            count = int(np.argmin(good))
        self._blocks = [*before, *map(_Block, blocks[max(0, count - width):count])][-width:]
        return count * SHORT

    def _judge(self):
        """Judge a block that is full; return whether the pace was lost with it."""
        block = _Block(np.concatenate(self._block))
        self._blocks = [*self._blocks, block][-LONG // SHORT:]
        self._block, self._size = [], 0
        if self.off:
            self.off = not self._fit_together(DRIFT)
            return False
        together = self._fit_together(LOST)
        self.off = not (block.plain or fits(block.ticks)) or (
            len(self._blocks) == LONG // SHORT and not together)
        if self.off:
            self._blocks = []
        return self.off

    def _fit_together(self, drift):
        """Return whether the last LONG stamps are there and fit."""
        blocks = self._blocks
        if len(blocks) < LONG // SHORT:
            return False
        if all(b.plain for b in blocks):
            return abs(_drift([b.middle for b in blocks], [b.mean for b in blocks])) <= drift
        return fits(np.concatenate([b.ticks for b in blocks]), drift)


def common_rate(rates_hz, before_hz=0.0):
    """
    Return the rate that most channels share [Hz].

    Parameters
    ----------
    rates_hz : sequence of float
        Of the channels.
    before_hz : float
        Of two rates with equally many channels the one near this is taken, else the first [Hz].

    """
    rates = np.asarray(rates_hz, dtype=float)
    near = np.abs(rates[:, None] / rates - 1.0) <= DRIFT
    many = near.sum(axis=1) + 0.5 * (np.abs(rates / (before_hz or np.inf) - 1.0) <= DRIFT)
    return float(np.median(rates[near[int(many.argmax())]]))


def misfit(name, stamps_ns, rate_hz):
    """
    Return at which other rate the stamps of a channel come, in words; empty where it fits.

    Parameters
    ----------
    name : str
        Of the channel.
    stamps_ns : ndarray of int64
        Its stamps [ns], in the order of arrival.
    rate_hz : float
        The rate asked for [Hz].

    """
    stamps = distinct(stamps_ns)
    if len(stamps) < 3:
        return ''
    steps = np.diff(stamps) * 1e-9
    own_hz = 1.0 / float(np.median(steps))
    # however many samples are lost, some steps are single ones; too slow: none is
    slow = np.quantile(steps, 0.01) > 1.5 / rate_hz
    fast = np.mean(steps) < 0.67 / rate_hz
    # the rate may change within the record, which is not the question here: all blocks must speak
    blocks = np.array_split(stamps, max(1, len(stamps) // LONG))
    some = blocks[::max(1, len(blocks) // 64)]
    off = np.mean([not fits((b - b[0]) * 1e-9 * rate_hz) for b in some]) > ALL
    if not (slow or fast or off):
        return ''
    return f'{name} comes at {own_hz:.5g} Hz'
