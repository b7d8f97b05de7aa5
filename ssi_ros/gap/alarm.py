"""
An alarm with a controlled rate of false ones over time: a bank of bets, eq. (130) to (133).

Each bet watches one statistic and gains a factor a hop whose mean is at most one where the model
is right. The bank is a mixture of Shiryaev-Roberts sums of these factors, an e-detector (Shin,
Ramdas, Rinaldo, New Engl. J. Stat. Data Sci. 2, 2023): however often it is looked at, the mean
time to a false alarm is at least the one declared, whatever the bets have in common.
"""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.records import read_only

BETS = (0.5, 1.0, 2.0)     # tilts of a standardised statistic: for small, middle, large shifts
SHARPEST = 0.5             # of the tilt at which the mean of a factor would be infinite


@dataclass(frozen=True, eq=False)
class Bank:
    """
    Bets on statistics: log factor = tilt times statistic less price.

    Attributes
    ----------
    statistic : ndarray of int, shape (m,)
        Which statistic a bet watches.
    tilt, price : ndarray, shape (m,)
        Of the bet; `price` is the log of the mean of exp(tilt statistic) where the model is right.
    log_weight : ndarray, shape (m,)
        Logarithm of its share in the mixture; the shares add up to one.

    """

    statistic: np.ndarray
    tilt: np.ndarray
    price: np.ndarray
    log_weight: np.ndarray

    def gains(self, statistics):
        """Return the log factor of every bet for the statistics of one hop, shape (m,)."""
        return self.tilt * statistics[self.statistic] - self.price


@dataclass(frozen=True, eq=False)
class Alarm:
    """
    What the bank has collected.

    Attributes
    ----------
    log_sums : ndarray, shape (m,)
        Logarithm of the Shiryaev-Roberts sum of every bet.
    level : float
        Logarithm of their mixture over the threshold; an alarm at 0 and above.
    raised_ns : int or None
        Stamp of the end of the hop that raised the alarm; it stays until `quiet`.
    statistic : int
        The statistic that weighed most then; -1 without an alarm.

    """

    log_sums: np.ndarray
    level: float = -np.inf
    raised_ns: int = None
    statistic: int = -1


def bets_on(weights, crowding, repeats):
    """
    Return (tilt, price) of the bets on a quadratic form in whitened spectra and on its opposite.

    The price is the log mean of exp(tilt z), eq. (131): with independent bins and hops, - sum
    log(1 - tilt w) - tilt w; where they repeat each other, there are fewer of them.

    Parameters
    ----------
    weights : ndarray
        Eigenvalues w of the form's matrix over all bins, of sum of squares 1, so that z has
        variance 1.
    crowding : float
        How much neighbouring bins repeat each other.
    repeats : float
        Variance of z in the long run, which hops that repeat each other raise above 1.

    """
    many = crowding * repeats
    scaled = weights * many / np.sqrt(crowding)
    bets = []
    for sign in (1.0, -1.0):
        steepest = np.max(sign * scaled)
        most = SHARPEST / steepest if steepest > 0.0 else np.inf
        for size in sorted({min(b, most) for b in BETS}):
            pull = sign * size * scaled
            bets.append((sign * size, float(np.sum(-np.log1p(-pull) - pull) / many)))
    return bets


def quiet(bank):
    """Return the alarm at its beginning."""
    return Alarm(read_only(np.full(len(bank.tilt), -np.inf)))


def step(alarm, bank, statistics, log_threshold, end_ns):
    """
    Take one hop into account.

    Parameters
    ----------
    alarm : Alarm
        So far.
    bank : Bank
        The bets.
    statistics : ndarray or None
        Of the hop; None for a hop without usable samples, in which no bet is made.
    log_threshold : float
        Logarithm of the mean number of hops between false alarms.
    end_ns : int
        Stamp of the end of the hop [ns].

    Returns
    -------
    Alarm

    """
    gains = 0.0 if statistics is None else bank.gains(statistics)
    sums = np.logaddexp(alarm.log_sums, 0.0) + gains            # R <- (R + 1) e, eq. (132)
    parts = sums + bank.log_weight
    top = parts.max()
    level = float(top + np.log(np.sum(np.exp(parts - top))) - log_threshold)
    new = replace(alarm, log_sums=read_only(sums), level=level)
    if alarm.raised_ns is None and level >= 0.0:
        new = replace(new, raised_ns=int(end_ns), statistic=int(bank.statistic[np.argmax(parts)]))
    return new
