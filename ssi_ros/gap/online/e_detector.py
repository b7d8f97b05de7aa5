"""
An alarm with a bounded rate of false alarms over time: a bank of bets, eq. (130) to (133).

Each bet watches one statistic and gains a factor a hop whose mean is at most one where the model
is right. The bank is a mixture of Shiryaev-Roberts sums of these factors, an e-detector (Shin,
Ramdas, Rinaldo, New Engl. J. Stat. Data Sci. 2, 2023): however often it is evaluated, the mean
time to a false alarm is at least the declared one, whatever the dependence of the bets.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.gap.online.thresholds import LIMITS
from ssi_ros.records import read_only

BETS = (0.5, 1.0, 2.0)     # tilts of a standardised statistic: for small, middle, large shifts


@dataclass(frozen=True, eq=False)
class Bank:
    """Bets on statistics: log factor = tilt times statistic less price."""

    statistic: np.ndarray   # (m,), int, number of the statistic that a bet watches
    tilt: np.ndarray        # (m,)
    price: np.ndarray       # (m,), log mean of exp(tilt statistic) where the model is right
    log_weight: np.ndarray  # (m,), logarithm of the share in the mixture; shares add up to one


@dataclass(frozen=True, eq=False)
class Alarm:
    """The state of the alarm."""

    log_sums: np.ndarray    # (m,), logarithm of the Shiryaev-Roberts sum of every bet
    level: float = -np.inf  # logarithm of their mixture over the threshold; 0 is an alarm
    raised_ns: int = None   # end of the hop that raised it [ns]; stays until `quiet`
    statistic: int = -1     # that with the largest part of it then; -1 without an alarm


def bets_on(weights, inflation, variance):
    """
    Return (tilt, price) of the bets on a quadratic form in whitened spectra and on its opposite.

    The price is the log mean of exp(tilt z), eq. (131): with independent bins and hops, - sum
    log(1 - tilt w) - tilt w; correlated ones count as fewer. `weights` are the eigenvalues w of
    the form's matrix over all bins, of sum of squares 1, so that z has variance 1; `inflation` is
    that by neighbouring bins, `variance` that of z in the long run, which correlated hops raise
    above 1.
    """
    many = inflation * variance
    scaled = weights * many / np.sqrt(inflation)
    bets = []
    for sign in (1.0, -1.0):
        steepest = np.max(sign * scaled)
        most = LIMITS.steepest_bet.value / steepest if steepest > 0.0 else np.inf
        for size in sorted({min(b, most) for b in BETS}):
            pull = sign * size * scaled
            bets.append((sign * size, float(np.sum(-np.log1p(-pull) - pull) / many)))
    return bets


def quiet(bank):
    """Return the initial state of the alarm."""
    return Alarm(read_only(np.full(len(bank.tilt), -np.inf)))


def step(alarm, bank, statistics, log_threshold, end_ns):
    """Return the Alarm after one hop, which ended at `end_ns`."""
    # Without usable samples `statistics` is None, and no bet is made. `log_threshold` is the
    # logarithm of the mean number of hops between false alarms.
    gains = 0.0 if statistics is None else bank.tilt * statistics[bank.statistic] - bank.price
    sums = np.logaddexp(alarm.log_sums, 0.0) + gains            # R <- (R + 1) e, eq. (132)
    parts = sums + bank.log_weight
    top = parts.max()
    level = float(top + np.log(np.sum(np.exp(parts - top))) - log_threshold)
    new = replace(alarm, log_sums=read_only(sums), level=level)
    if alarm.raised_ns is None and level >= 0.0:
        new = replace(new, raised_ns=int(end_ns), statistic=int(bank.statistic[np.argmax(parts)]))
    return new
