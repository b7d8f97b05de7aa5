"""Poles that somebody picked in the stabilisation diagram, in place of the automatic choice."""
from dataclasses import dataclass
import json
import math

import numpy as np

from ssi_ros.identify.stability import Chain
from ssi_ros.records import Pole

SCHEMA = 'ssi_ros/picks/1'
REACH = 0.02            # relative distance within which a pole is the one that was picked
ORDER_MAX = 400


@dataclass(frozen=True)
class Pick:
    """A pole of one model order, by its frequency [Hz]."""

    frequency_hz: float
    order: int


def load_picks(path):
    """
    Read the picks that a page of `identify --plot` has saved.

    Parameters
    ----------
    path : path
        JSON of the form `ssi_ros/picks/1`: picks, each with frequency_hz and order.

    Returns
    -------
    tuple of Pick
        By rising frequency.

    Raises
    ------
    ValueError
        If the file is of another form, or a pick has no positive frequency or whole order.
    OSError
        If it cannot be read.

    """
    with open(path, encoding='utf-8') as file:
        try:
            found = json.load(file)
            picks = found['picks'] if found['schema'] == SCHEMA else None
            pairs = [(p['frequency_hz'], p['order']) for p in picks]
        except (ValueError, KeyError, TypeError, RecursionError):
            raise ValueError(f'{path} is not of the form {SCHEMA}: pick poles on the page of '
                             '`ssi_ros identify --plot`, and save them there') from None
    for frequency_hz, order in pairs:
        if not (isinstance(frequency_hz, (int, float)) and 0.0 < frequency_hz < math.inf
                and type(order) is int and 1 <= order <= ORDER_MAX):
            raise ValueError(f'{path}: a pick has frequency_hz={frequency_hz!r} and '
                             f'order={order!r}; a positive number and a whole one of 1 to '
                             f'{ORDER_MAX} are needed')
    if not pairs:
        raise ValueError(f'{path} holds no pick')
    return tuple(sorted((Pick(float(f), n) for f, n in set(pairs)),
                        key=lambda p: p.frequency_hz))


def orders_of(picks, band, rank):
    """Return the orders (rising) in which poles of a band were picked, at most its rank."""
    return tuple(sorted({min(p.order, rank) for p in picks
                         if band.low_hz <= p.frequency_hz <= band.high_hz}))


def picked_chains(every, picks, band):
    """
    Return the picked poles of a band as chains of one pole each, and those left out.

    Parameters
    ----------
    every : sequence of Poles
        Of each order of `orders_of`.
    picks : sequence of Pick
        What was picked, of all bands.
    band : Band
        Its range of frequencies.

    Returns
    -------
    chains : list of Chain
        Of each pick the nearest pole within REACH; none where this window has none.
    rejected : list of Pole
        The other poles of the band.

    """
    chains, taken = [], {poles.order: [] for poles in every}
    of_order = {poles.order: poles for poles in every}
    for pick in picks:
        # of a window of lower rank it is the highest order
        poles = of_order.get(min(pick.order, max(of_order, default=0)))
        if poles is None:
            continue
        away = np.abs(poles.frequency_hz / pick.frequency_hz - 1.0)
        away[taken[poles.order]] = np.inf
        k = int(away.argmin())
        if away[k] <= REACH:
            taken[poles.order].append(k)
            chains.append(Chain([(poles, k)], 0))
    rejected = [Pole(float(f), float(x), poles.order, 'not picked')
                for poles in every
                for k, (f, x) in enumerate(zip(poles.frequency_hz, poles.damping_ratio))
                if k not in taken[poles.order] and band.low_hz <= f <= band.high_hz]
    return chains, rejected


def one_of_each_pick(candidates, picks):
    """
    Resolve the overlap of the bands: of every pick the nearest candidate stays.

    Returns
    -------
    kept : list of Candidate
    double : list of Pole

    """
    pairs = sorted(((abs(c.frequency_hz / p.frequency_hz - 1.0), i, j)
                    for i, p in enumerate(picks) for j, c in enumerate(candidates)))
    of_pick = {}
    for away, i, j in pairs:
        if away <= REACH and i not in of_pick and j not in of_pick.values():
            of_pick[i] = j
    kept = set(of_pick.values())
    return ([c for j, c in enumerate(candidates) if j in kept],
            [Pole(c.frequency_hz, c.damping_ratio, 0, 'another band is nearer to what was picked')
             for j, c in enumerate(candidates) if j not in kept])
