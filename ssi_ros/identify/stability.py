"""
From the poles of all orders to the modes of a band: stabilisation without a chart.

A pole that belongs to the structure comes back at almost every order with the same frequency,
damping and shape; a pole that fits noise does not. Poles are chained from order to order, one
pole an order at most, so that a close pair that differs only in shape stays two chains. What
happened to every other pole is kept with its reason. Section 5 of docs/theory-identification.md.
"""
from dataclasses import dataclass

import numpy as np

from ssi_ros.identify.shapes import mac
from ssi_ros.scipy_later import linear_sum_assignment

FREQUENCY_STEP = 0.01    # largest relative change of frequency from order to order
MAC_STEP = 0.5           # least MAC from order to order
SHARE = 0.6              # of the orders from its first on, in which a mode must appear
COST_FREQUENCY = 0.003   # relative change of frequency that weighs as much as MAC 0
COST_DAMPING = 0.02      # change of damping that weighs as much
LOW = 0.7                # of the significant singular values in the lowest order that votes
BEYOND = 2               # orders past the significant ones at which a mode may first appear


@dataclass
class Chain:
    """Poles that continue each other over the orders: (poles, index) an order."""

    members: list
    first: int               # position of the first order in the list of orders


def orders_to_try(significant, rank, order_max, count, lowest=LOW):
    """
    Return the even model orders that vote.

    Parameters
    ----------
    significant : int
        Singular values above the noise floor.
    rank : int
        Columns of the factors.
    order_max : int
        Setting of the user.
    count : int
        Number of orders wanted.
    lowest : float
        Of the significant ones in the lowest order.

    Returns
    -------
    tuple of int

    """
    top = min(rank, order_max, max(significant + 12, int(1.3 * significant)))
    low = max(2, int(lowest * min(significant, top)))
    return tuple(sorted({2 * round(0.5 * n) for n in np.linspace(low, top, count)
                         if 2 <= 2 * round(0.5 * n) <= rank}))


def hard_criteria(poles, low_hz, high_hz, damping_max):
    """
    Judge every pole of an order on its own.

    Returns
    -------
    dict
        The reason why a pole cannot be a mode, by its index.

    """
    f, x = poles.frequency_hz, poles.damping_ratio
    outside = (f < low_hz) | (f > high_hz)
    reasons = dict.fromkeys(np.flatnonzero(outside).tolist(),
                            f'outside {low_hz:.4g} to {high_hz:.4g} Hz, the range of its band')
    for k in np.flatnonzero(~outside & (x > damping_max)).tolist():
        reasons[k] = f'damping ratio above {damping_max:g}'
    for k in np.flatnonzero(~outside & (x < -0.01)).tolist():
        reasons[k] = 'unstable: negative damping'
    return reasons


def chain(all_poles, usable):
    """
    Chain the usable poles from order to order.

    Parameters
    ----------
    all_poles : sequence of Poles
        By rising order.
    usable : sequence of ndarray of int
        Indices of the poles that passed the hard criteria.

    Returns
    -------
    list of Chain

    """
    chains = []
    f, x, shapes = np.empty(0), np.empty(0), None          # of the newest pole of every chain
    for position, (poles, picks) in enumerate(zip(all_poles, usable)):
        if not len(picks):
            continue
        own_f, own_x = poles.frequency_hz[picks], poles.damping_ratio[picks]
        own_shapes, free = poles.shapes[picks], np.ones(len(picks), dtype=bool)
        if chains:
            likeness = mac(shapes, own_shapes)
            step = np.abs(own_f - f[:, None]) / f[:, None]
            cost = (step / COST_FREQUENCY + 1.0 - likeness
                    + np.abs(own_x - x[:, None]) / COST_DAMPING)
            barred = (step > FREQUENCY_STEP) | (likeness < MAC_STEP)
            cost[barred] = 1e3
            c, k = linear_sum_assignment(cost)
            fits = ~barred[c, k]
            c, k = c[fits], k[fits]
            f[c], x[c], shapes[c], free[k] = own_f[k], own_x[k], own_shapes[k], False
            for one, pole in zip(c.tolist(), picks[k].tolist()):
                chains[one].members.append((poles, pole))
        chains.extend(Chain([(poles, k)], position) for k in picks[free].tolist())
        f, x = np.concatenate([f, own_f[free]]), np.concatenate([x, own_x[free]])
        shapes = own_shapes[free] if shapes is None else np.concatenate([shapes, own_shapes[free]])
    return chains


def verdict(c, orders, significant):
    """
    Judge a chain: '' for a mode, otherwise the reason why it is none.

    A mode is there as soon as the order covers the significant singular values, and stays; what
    only appears beyond them fits noise.

    Parameters
    ----------
    c : Chain
        The poles.
    orders : sequence of int
        All orders tried.
    significant : int
        Singular values above the noise floor.

    Returns
    -------
    str

    """
    first = c.members[0][0].order
    enough = min((n for n in orders if n >= significant), default=orders[-1])
    if first > max(enough, min(significant + BEYOND, orders[-1] - 6)):
        return f'only from order {first} on; the {significant} significant ones do not need it'
    needed = max(3, int(np.ceil(SHARE * (len(orders) - c.first))), len(orders) // 2 + 1)
    needed = min(needed, len(orders))         # without noise the rank leaves few orders
    if len(c.members) < needed:
        return f'in {len(c.members)} of {len(orders)} orders; {needed} are needed'
    return ''
