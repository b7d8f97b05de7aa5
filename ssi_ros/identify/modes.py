"""From the covariances of one band to its candidate modes, with spreads and reasons."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.identify.picks import orders_of, picked_chains
from ssi_ros.identify.realise import poles_of
from ssi_ros.identify.spread import block_spectra, spreads_of, unknown
from ssi_ros.identify.stability import chain, hard_criteria, LOW, orders_to_try, verdict
from ssi_ros.identify.traced import BandTrace
from ssi_ros.records import Pole

MEMBERS = 3             # orders that a mode is averaged over
SPREAD_MAX = 0.01       # relative spread of frequency beyond which nothing was measured
DAMPING_SPREAD = 0.01   # spread of damping beyond which a damping within it was not measured,
EXCESS = 4.0            # or so many times the least that its cycles allow
TYPICAL_DAMPING = 5e-3  # of a space structure
NEGATIVE = 5e-4         # a line's damping may come out so far below 0, whatever its spread
SHARE_MIN = 3e-4        # of the power of its band; sensors distort what is stronger by so much
LINE_DAMPING = 1e-3     # poles below it may be lines, whose power is not the structure's


@dataclass(frozen=True)
class Candidate:
    """
    One mode of one band.

    Attributes
    ----------
    frequency_hz, frequency_std_hz : float
        [Hz].
    damping_ratio, damping_ratio_std : float
        [1].
    shape, shape_std : ndarray, shape (l,)
        Of the channels in their units, largest component 1.
    votes : int
        Orders in which it appeared.
    band : int
        Number of the band.
    share : float
        Of the power of the band without its lines, in the channel where it is largest.

    """

    frequency_hz: float
    damping_ratio: float
    shape: np.ndarray
    frequency_std_hz: float
    damping_ratio_std: float
    votes: int
    band: int
    shape_std: np.ndarray = None
    share: float = 1.0


def band_modes(factors, floor, shares, covariances, band, number, rows, settings, picks=()):
    """
    Identify the modes of one band in one window.

    Parameters
    ----------
    factors : Factors
        Of the band.
    floor : float
        What singular values noise alone reaches.
    shares : callable
        (factors, poles, which) -> share of each channel's power that poles carry, shape (p, l).
    covariances : Covariances
        Lags 0 to 2 i - 1, with the data blocks from which the spreads come.
    band : Band
        Its rate and range.
    number : int
        Its number, 0 for the full rate.
    rows : int
        Block rows i.
    settings : Identification
        Settings.
    picks : sequence of Pick
        Poles to take in place of those that stabilise.

    Returns
    -------
    candidates : list of Candidate
    rejected : list of Pole
    trace : BandTrace
        What decided.

    """
    rank = len(factors.singular_values)
    significant = int(np.count_nonzero(factors.singular_values > floor))
    if significant < 2:      # a mode needs two states
        return [], [], BandTrace(band.rate_hz, factors.singular_values, floor, ())
    if picks:
        orders = orders_of(picks, band, rank)
        every = poles_of(factors, orders, band.rate_hz) if orders else ()
        chains, rejected = picked_chains(every, picks, band)
        return (_candidates(chains, orders, covariances, factors, shares, rows, band, number),
                rejected, BandTrace(band.rate_hz, factors.singular_values, floor,
                                    tuple(p for c in chains for p in _poles(c))))
    # responses to pulses have so little noise that lower orders only lack modes
    orders = orders_to_try(significant, rank, settings.order_max, settings.orders,
                           LOW if factors.inputs is not None else 1.0)
    every = poles_of(factors, orders, band.rate_hz)
    reasons = [hard_criteria(p, band.low_hz, band.high_hz, settings.damping_max) for p in every]
    usable = [np.array([k for k in range(len(p.mu)) if k not in r], dtype=int)
              for p, r in zip(every, reasons)]
    rejected = [Pole(float(p.frequency_hz[k]), float(p.damping_ratio[k]), p.order, why)
                for p, r in zip(every, reasons) for k, why in r.items()]
    stable = []
    for c in chain(every, usable):
        reason = verdict(c, orders, significant)
        if reason:
            rejected.extend(_poles(c, reason))
        else:
            stable.append(c)
    candidates, accepted = [], []
    found = _candidates(stable, orders, covariances, factors, shares, rows, band, number)
    for c, candidate in zip(stable, found):
        reason = unbelievable(candidate, covariances.held_s)
        if reason:
            rejected.extend(_poles(c, reason))
        else:
            candidates.append(candidate)
            accepted.extend(_poles(c))
    return candidates, rejected, BandTrace(band.rate_hz, factors.singular_values, floor,
                                           tuple(accepted))


def unbelievable(c, held_s):
    """
    Return why the numbers of a candidate show that it is no mode and no line, or ''.

    The least spread of a damping x from N cycles is sqrt(x / 2 pi N) (Gersch, Journal of the
    American Statistical Association 69, 1974): a mode in noise stays near it, a fit to noise not.
    """
    x, sx = c.damping_ratio, c.damping_ratio_std          # NaN where era and okid have none
    told = f'{100 * x:.2f} +- {100 * sx:.2f} %'
    if c.frequency_std_hz > SPREAD_MAX * c.frequency_hz:
        return f'its frequency is spread over more than {100 * SPREAD_MAX:g} %'
    if x < -(2.0 * np.nan_to_num(sx) + NEGATIVE):
        return f'its damping is negative beyond its spread: {told}'
    least = np.sqrt(TYPICAL_DAMPING / (2.0 * np.pi * c.frequency_hz * held_s))
    if sx > min(DAMPING_SPREAD, EXCESS * least) and x < 1.5 * sx:
        return f'its damping was not measured: {told}'
    if c.share < SHARE_MIN and x > LINE_DAMPING:
        return (f'it carries {c.share:.0e} of the power of its band; below {SHARE_MIN:g} the '
                'distortion of what is stronger looks the same')
    return ''


def _poles(c, reason=''):
    return [Pole(float(p.frequency_hz[k]), float(p.damping_ratio[k]), p.order, reason)
            for p, k in c.members]


def _middle(c):
    middle = len(c.members) // 2
    return c.members[max(0, middle - MEMBERS // 2):middle + MEMBERS // 2 + 1]


def _common_orders(chains, orders):
    """Return for every chain the order that stands for it; few orders serve all chains."""
    left, choice = set(range(len(chains))), {}
    has = [{p.order for p, _ in _middle(c)} for c in chains]
    while left:
        best = max(orders, key=lambda n: sum(n in has[k] for k in left))
        for k in [k for k in left if best in has[k]]:
            choice[k] = best
            left.remove(k)
    return choice


def _candidates(chains, orders, covariances, factors, shares, rows, band, number):
    """Average the middle members of every chain; shape and spreads are those of one of them."""
    choice = _common_orders(chains, orders)
    own_spreads = factors.inputs is not None
    spectra = block_spectra(covariances, rows) if chains and own_spreads else None
    scale = np.where(covariances.scale > 0.0, covariances.scale, 1.0)
    out = [None] * len(chains)
    for order in sorted(set(choice.values())):
        own = [k for k in range(len(chains)) if choice[k] == order]
        members = [next(m for m in _middle(chains[k]) if m[0].order == order) for k in own]
        poles, which = members[0][0], np.array([k for _, k in members])
        spreads = (spreads_of(factors, poles, which, rows, spectra, band.rate_hz, scale)
                   if own_spreads else unknown(len(own), factors.channels))
        shapes = poles.shapes[which] * scale
        top = np.abs(shapes).argmax(axis=1)
        largest = shapes[np.arange(len(own)), top][:, None]
        share = shares(factors, poles, which)
        for j, k in enumerate(own):
            few = _middle(chains[k])
            f = sum(float(p.frequency_hz[m]) for p, m in few) / len(few)
            x = sum(float(p.damping_ratio[m]) for p, m in few) / len(few)
            out[k] = Candidate(
                f, x, (shapes / largest)[j], float(spreads.frequency_hz[j]),
                float(spreads.damping_ratio[j]), len(chains[k].members), number,
                spreads.shape[j], share[j])
    lines = [c.share for c in out if c.damping_ratio < LINE_DAMPING]
    rest = np.maximum(1.0 - np.sum(lines, axis=0), 1e-6) if lines else 1.0
    return [replace(c, share=float((c.share / rest).max())) for c in out]
