"""
Fill missing samples of a window by their conditional mean under the model, eq. (136).

The variance that the rows around do not determine is lost. Whole records are filled by draws,
see `gap/spectra/imputation.py`; a window has no time for it.
"""
from dataclasses import replace

import numpy as np
from scipy.linalg import solve

from ssi_ros.arrays import runs
from ssi_ros.gap.candidate import Candidate

REACH = 30      # rows on each side that a missing one is conditioned on
LONGEST = 10    # rows in a row that can be filled: longer ones made false alarms


def autocovariance(simulator):
    """Return E[y(k + m) y(k)^T] of the nominal model at lags m = 0, 1, ..., shape (m, l, l)."""
    lags = 2 * REACH + LONGEST
    # with a taper that overlaps itself by one at these lags and by nothing beyond, the expected
    # periodogram of eq. (95) is their Fourier transform
    frame = replace(simulator.frame, rows=4 * lags, first=0, last=2 * lags + 1,
                    overlap=np.concatenate([np.ones(lags), np.zeros(3 * lags)]))
    return np.fft.irfft(simulator.on(frame).expected(Candidate()).at_nominal[0], axis=0)[:lags]


def fill(rows, covariance):
    """Return rows (n, l) with NaN filled; ValueError for more than LONGEST rows in one gap."""
    gone = np.isnan(rows)
    if not gone.any():
        return rows
    out, inverses = rows.copy(), {}
    for first, last in runs(gone.any(axis=1)):
        if last - first > LONGEST:
            raise ValueError(f'{last - first} rows are missing in a row; up to {LONGEST} can be '
                             'filled')
        begin, end = max(0, first - REACH), min(len(rows), last + REACH)
        count = end - begin
        if count not in inverses:
            inverses[count] = np.linalg.inv(_of_rows(covariance, count))
        # with the inverse of the whole only the missing samples have to be solved for
        inverse, near = inverses[count], rows[begin:end].flatten()
        lost = np.isnan(near)
        there = -inverse[np.ix_(lost, ~lost)] @ near[~lost]
        near[lost] = solve(inverse[np.ix_(lost, lost)], there, assume_a='pos')
        out[first:last] = near.reshape(count, -1)[first - begin:last - begin]
    return out


def _of_rows(covariance, count):
    """Return the covariance of so many rows in a row, shape (count l, count l)."""
    lag = np.arange(count)[:, None] - np.arange(count)[None, :]
    blocks = covariance[np.abs(lag)]
    blocks = np.where((lag >= 0)[:, :, None, None], blocks, blocks.swapaxes(-1, -2))
    return blocks.transpose(0, 2, 1, 3).reshape(count * covariance.shape[1], -1)
