"""
One way to call every method: what a window holds in, a factorisation and its noise out.

The methods differ in the matrix that they factorise. Bands, selection over orders, labels and
tracks are the same for all; see section 10 of docs/theory-identification.md.
"""
from dataclasses import dataclass
from functools import partial

import numpy as np

from ssi_ros.identify.era import pulse_factors, pulse_shares
from ssi_ros.identify.okid import responses_and_noise
from ssi_ros.identify.realise import factorise, noise_floor, shares_of
from ssi_ros.identify.settings import METHODS
from ssi_ros.identify.ssi_data import data_factors

FLOOR_MARGIN = 1.1      # noise correlations of a finite record scatter about their edge
NOISE_OVER_MEDIAN = 2.0     # largest over median singular value of the noise of responses: the
#                         edge of a flat matrix is 1.5 (Gavish and Donoho 2014), and noise scatters
ROUNDING = 1e-10        # of the largest singular value
DISTORTION = 1e-4       # of the largest singular value; through a band's filter so much folds back
RESPONSE = 10           # samples of a pulse response over the block rows
RIDGE = 0.03            # noise that okid takes its past to have: an observer of it is stable
ERRORS = 2.0            # edge of the singular values of white errors that an observer's may reach
DECAYED = 0.5           # of the power that the first quarter has, at most, in the last one,
LEVEL = 1.1             # and so many times that of the quarter before, at most, in every one


@dataclass(frozen=True)
class Method:
    """
    How windows are identified.

    Attributes
    ----------
    name : str
        'ssi_cov', 'ssi_data', 'era' (free decays) or 'okid' (where the input is recorded).
    inputs : tuple of str
        Names of the recorded inputs, which okid needs; their columns follow those of the
        accelerometers.
    picks : tuple of Pick
        Poles that are the modes; none leaves the choice to what stabilises.

    Raises
    ------
    ValueError
        For an unknown name, and where the inputs do not fit the method.

    """

    name: str = 'ssi_cov'
    inputs: tuple = ()
    picks: tuple = ()

    def __post_init__(self):
        if self.name not in METHODS:
            raise ValueError(f'method={self.name!r} is not known; known: ' + ', '.join(METHODS))
        if self.name == 'okid' and not self.inputs:
            raise ValueError('method okid needs the recorded input, such as a torque: name its '
                             'channel, or use ssi_cov, which needs none')
        if self.inputs and self.name != 'okid':
            raise ValueError(f'method {self.name} takes no input, but {", ".join(self.inputs)} '
                             'is given: leave it out, or use okid')


def realise(method, covariances, values, inputs, rows, settings):
    """
    Factorise one band of one window.

    Parameters
    ----------
    method : Method
        The method.
    covariances : Covariances
        Lags 0 to 2 i - 1 of the band.
    values : ndarray, shape (n, l)
        The rows of the band, NaN where missing.
    inputs : ndarray, shape (n, r)
        Those of the inputs.
    rows : int
        Block rows i.
    settings : Identification
        Highest order and weighting.

    Returns
    -------
    factors : Factors
    floor : float
        What singular values noise alone reaches.
    shares : callable
        (factors, poles, which) -> share of each channel's power that poles carry, shape (p, l).

    Raises
    ------
    ValueError, numpy.linalg.LinAlgError
        Where the window is not what the method needs.

    """
    width = covariances.values.shape[1]
    rank = min(settings.order_max, (rows - 1) * width)
    if method.name in ('ssi_cov', 'ssi_data'):
        if method.name == 'ssi_cov':
            factors = factorise(covariances, rows, rank, settings.weighting)
        else:
            y = whole(values, 'ssi_data')
            factors = data_factors((y - y.mean(axis=0)) / covariances.scale, rows, rank,
                                   settings.weighting)
        floor = FLOOR_MARGIN * noise_floor(rows, factors.channels, covariances.counts)
        if settings.weighting != 'cva':
            floor *= factors.singular_values[0]
        return factors, floor, shares_of
    if method.name == 'era':
        responses = decaying(whole(values, 'era') / covariances.scale)[:, :, None]
        factors, middle = pulse_factors(responses, rows, rank)
        floor = max(NOISE_OVER_MEDIAN * middle, DISTORTION * factors.singular_values[0])
    else:
        both = whole(np.concatenate([inputs, values], axis=1), 'okid')
        u, y = np.split(both - both.mean(axis=0), [-width], axis=1)
        spread = u.std(axis=0)
        if not (spread > 0.0).all():
            raise ValueError('an input is constant; okid needs one that moves')
        count = RESPONSE * rows
        responses, noise = responses_and_noise(u / spread, y / covariances.scale, rows, count,
                                               RIDGE)
        factors, _ = pulse_factors(responses, rows, rank)
        sides = np.sqrt(rows * width) + np.sqrt((count - rows) * u.shape[1])
        floor = max(ERRORS * noise * sides, ROUNDING * factors.singular_values[0])
    return factors, floor, partial(pulse_shares, responses)


def whole(values, name):
    """Return the rows from the first complete one on; ValueError where one misses later."""
    complete = ~np.isnan(values).any(axis=1)
    first = int(np.argmax(complete))        # behind the filter of a band the first are missing
    lost = int(np.count_nonzero(~complete[first:]))
    if lost:
        raise ValueError(f'{lost} of {len(values)} rows miss a sample, and {name} needs all of '
                         'them: use ssi_cov')
    return values[first:]


def decaying(values):
    """Return the rows of a free decay; ValueError where they are none."""
    power = [float((part ** 2).mean()) for part in np.array_split(values, 4)]
    falls = all(b <= LEVEL * a for a, b in zip(power, power[1:]))
    if not (falls and power[-1] < DECAYED * power[0]):
        raise ValueError(
            'era needs the response to a pulse, or a free decay; the quarters of this window have '
            + ', '.join(f'{100 * p / power[0]:.3g}' for p in power) + ' % of the power of the '
            'first: begin right after the pulse, lengthen window_s, or use ssi_cov')
    return values
