"""From the covariances of one band to its candidate modes, with spreads and reasons."""
from dataclasses import dataclass

import numpy as np

from ssi_ros.identify.realise import factorise, noise_floor, poles_of
from ssi_ros.identify.spread import functionals, lag_weights, pole_spreads
from ssi_ros.identify.stability import chain, hard_criteria, orders_to_try, verdict
from ssi_ros.identify.traced import BandTrace
from ssi_ros.records import Pole

MEMBERS = 3             # orders that a mode is averaged over
SPREAD_MAX = 0.015      # relative spread of frequency beyond which nothing was measured
FLOOR_MARGIN = 1.1      # noise correlations of a finite record scatter about their edge


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
    shape : ndarray, shape (l,)
        Of the channels in their units, largest component 1.
    votes : int
        Orders in which it appeared.
    band : int
        Number of the band.

    """

    frequency_hz: float
    damping_ratio: float
    shape: np.ndarray
    frequency_std_hz: float
    damping_ratio_std: float
    votes: int
    band: int


def band_modes(covariances, band, number, rows, settings):
    """
    Identify the modes of one band in one window.

    Parameters
    ----------
    covariances : Covariances
        Lags 0 to 2 i - 1.
    band : Band
        Its rate and range.
    number : int
        Its number, 0 for the full rate.
    rows : int
        Block rows i.
    settings : Identification
        Settings.

    Returns
    -------
    candidates : list of Candidate
    rejected : list of Pole
    trace : BandTrace
        What decided.

    """
    rank = min(settings.order_max, (rows - 1) * covariances.values.shape[1])
    factors = factorise(covariances, rows, rank, settings.weighting)
    floor = FLOOR_MARGIN * noise_floor(rows, factors.channels, covariances.counts)
    if settings.weighting != 'cva':
        floor *= factors.singular_values[0]
    significant = int(np.count_nonzero(factors.singular_values > floor))
    if significant < 2:      # a mode needs two states
        return [], [], BandTrace(band.rate_hz, factors.singular_values, floor, ())
    orders = orders_to_try(significant, len(factors.singular_values), rank, settings.orders)
    every = [poles_of(factors, n, band.rate_hz) for n in orders]
    reasons = [hard_criteria(p, band.low_hz, band.high_hz, settings.damping_max) for p in every]
    usable = [np.array([k for k, r in enumerate(rs) if not r], dtype=int) for rs in reasons]
    rejected = [Pole(float(p.frequency_hz[k]), float(p.damping_ratio[k]), p.order, r)
                for p, rs in zip(every, reasons) for k, r in enumerate(rs) if r]
    candidates, accepted, spreads = [], [], {}
    for c in chain(every, usable):
        reason = verdict(c, orders, significant)
        if reason:
            rejected.extend(_poles(c, reason))
            continue
        candidate = _candidate(c, covariances, factors, rows, band, number, spreads)
        if candidate.frequency_std_hz > SPREAD_MAX * candidate.frequency_hz:
            rejected.extend(_poles(c, f'its frequency is spread over more than '
                                      f'{100 * SPREAD_MAX:g} %'))
            continue
        candidates.append(candidate)
        accepted.extend(_poles(c))
    return candidates, rejected, BandTrace(band.rate_hz, factors.singular_values, floor,
                                           tuple(accepted))


def _poles(c, reason=''):
    return [Pole(float(p.frequency_hz[k]), float(p.damping_ratio[k]), p.order, reason)
            for p, k in c.members]


def _candidate(c, covariances, factors, rows, band, number, spreads):
    """Average the middle members of a chain, weighted by their spreads."""
    middle = len(c.members) // 2
    members = c.members[max(0, middle - MEMBERS // 2):middle + MEMBERS // 2 + 1]
    rows_of = []
    for poles, k in members:
        if poles.order not in spreads:
            which = np.flatnonzero((poles.frequency_hz >= band.low_hz)
                                   & (poles.frequency_hz <= band.high_hz))
            weights = lag_weights(*functionals(factors, poles, which, rows))
            spreads[poles.order] = np.full((2, len(poles.mu)), np.nan)
            spreads[poles.order][:, which] = pole_spreads(
                covariances, weights, poles.mu[which], band.rate_hz)
        sf, sx = spreads[poles.order]
        rows_of.append((poles.frequency_hz[k], poles.damping_ratio[k], sf[k], sx[k]))
    table = np.array(rows_of)
    weight = 1.0 / np.maximum(np.nan_to_num(table[:, 2], nan=1.0), 1e-300) ** 2
    weight /= weight.sum()
    best = int(np.argmax(weight))
    poles, k = members[best]
    shape = poles.shapes[k] * np.where(covariances.scale > 0.0, covariances.scale, 1.0)
    shape = shape / shape[np.argmax(np.abs(shape))]
    f, x, sf, sx = weight @ table
    return Candidate(float(f), float(x), shape, float(sf), float(sx), len(c.members), number)
