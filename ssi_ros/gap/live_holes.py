"""
Fill missing samples by their conditional mean under the model, eq. (136).

A row that counts as zero spreads the strong resonances over all bins, the same in each, and the
valleys between them are lost. What is filled in differs from the truth only by what the model
itself could not know, which is far below the sensors' noise in every bin.
"""
from dataclasses import replace

import numpy as np
from scipy.linalg import solve

from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.check import runs

REACH = 30      # rows on each side that a missing one is told from
LONGEST = 30    # rows in a row that can be filled
MOST = 30000    # holes of a record that are filled one by one


def autocovariance(simulator):
    """Return E[y(k + m) y(k)^T] of the nominal model at lags m = 0, 1, ..., shape (m, l, l)."""
    lags = 2 * REACH + LONGEST
    # with a taper that overlaps itself by one at these lags and by nothing beyond, the expected
    # periodogram of eq. (95) is their Fourier transform
    frame = replace(simulator.frame, rows=4 * lags, first=0, last=2 * lags + 1,
                    overlap=np.concatenate([np.ones(lags), np.zeros(3 * lags)]))
    nominal = simulator.on(frame).expected(Candidate())
    return np.fft.irfft(nominal.at(np.ones(len(nominal.names)))[0], axis=0)[:lags]


def without_rails(samples, effects):
    """
    Return the samples with those at the rails of a `saturation` among effects missing.

    What a rail cut off is told from its neighbours like a lost sample; where it cut off too much
    for that, the samples are returned as they are.
    """
    limit = min((e.limit_m_s2 for e in effects if e.name == 'saturation'), default=np.inf)
    with np.errstate(invalid='ignore'):
        railed = np.abs(samples.values) >= limit
    at = runs(railed.any(axis=1))
    if not 0 < len(at) <= MOST or max(last - first for first, last in at) > LONGEST:
        return samples
    return replace(samples, values=np.where(railed, np.nan, samples.values))


def filled(simulator, samples):
    """Return the samples with every hole filled that is short, unless there are too many."""
    short = [last - first <= LONGEST for first, last in runs(np.isnan(samples.values).any(axis=1))]
    if not any(short) or len(short) > MOST:
        return samples
    return replace(samples, values=fill(samples.values, autocovariance(simulator), strict=False))


def fill(rows, covariance, strict=True):
    """
    Return rows without gaps.

    Parameters
    ----------
    rows : ndarray, shape (n, l)
        NaN where a sample is missing; runs of up to LONGEST rows.
    covariance : ndarray, shape (m, l, l)
        Of `autocovariance`.
    strict : bool
        Whether longer runs are an error; otherwise they are left.

    Returns
    -------
    ndarray, shape (n, l)

    Raises
    ------
    ValueError
        If a run is longer.

    """
    gone = np.isnan(rows)
    if not gone.any():
        return rows
    out, inverses = rows.copy(), {}
    for first, last in runs(gone.any(axis=1)):
        if last - first > LONGEST:
            if not strict:
                continue
            raise ValueError(f'{last - first} rows are missing in a row; up to {LONGEST} can be '
                             'filled')
        begin, end = max(0, first - REACH), min(len(rows), last + REACH)
        count = end - begin
        if count not in inverses:
            inverses[count] = np.linalg.inv(_of_rows(covariance, count))
        # By the inverse of the whole only what is lost has to be solved for.
        inverse, near = inverses[count], rows[begin:end].flatten()
        lost = np.isnan(near)
        there = -inverse[np.ix_(lost, ~lost)] @ near[~lost]
        near[lost] = solve(inverse[np.ix_(lost, lost)], there, assume_a='pos')
        hole = slice(first - begin, last - begin)
        out[first:last] = near.reshape(count, -1)[hole]
    return out


def _of_rows(covariance, count):
    """Return the covariance of so many rows in a row, shape (count l, count l)."""
    lag = np.arange(count)[:, None] - np.arange(count)[None, :]
    blocks = covariance[np.abs(lag)]
    blocks = np.where((lag >= 0)[:, :, None, None], blocks, blocks.swapaxes(-1, -2))
    return blocks.transpose(0, 2, 1, 3).reshape(count * covariance.shape[1], -1)
