"""
Fill gaps in the data by draws from a Gaussian process, given all other samples, eq. (110a, b).

A row that counts as zero leaks the strong resonances into all bins alike and buries the
antiresonances. A draw keeps the spectrum; a conditional mean would lack power, and one given near
rows alone would fill the antiresonances.
"""
import inspect

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.special import ndtr, ndtri

from ssi_ros.hermitian import applied
from ssi_ros.integrity.missing import parts_between, segment_rows

NEAR = 1e-4             # residual, relative, at which conjugate gradients stop
STEPS = 500             # of them, at most
ALONE = 1e-4            # of the precision, or less, between samples that are drawn apart
FORGOTTEN = 1e-3        # of the covariance, at which the ends of a record are none
SWEEPS = 6              # of draws beyond the clipping limits
BURST = 16              # rows that are drawn one after the other
COUPLED = 0.5           # coupling of a value with all drawn at once, over its own precision
SEGMENTS, LEAST_ROWS = 8, 64    # of an own spectrum: so many a channel, so long, at least
SMOOTH = 3              # bins over which it is a mean
CHUNK = 4               # segments that are filled at once
RIDGE = 1e-6            # of the power of a channel, that no direction has less than
SEED = 43


def filled_alike(values, gaps, longest):
    """
    Return a recording with gaps filled by draws from its own spectrum, (n, l).

    Parameters
    ----------
    values : ndarray, shape (n, l)
        Without offset.
    gaps : ndarray of bool, shape (n,)
        Rows that are missing; the rest is complete.
    longest : int
        Rows that the spectrum is resolved over, at most.

    Returns
    -------
    ndarray, shape (n, l)

    Raises
    ------
    ValueError
        If the parts between the gaps are too short for a spectrum.

    """
    parts, width = parts_between(~gaps, 0), values.shape[1]
    rows = segment_rows(parts, longest, LEAST_ROWS, SEGMENTS * width)
    if not rows:
        raise ValueError(f'the longest of {len(parts)} parts between the gaps has '
                         f'{np.diff(parts).max(initial=0)} samples: too short for a spectrum of '
                         f'{width} channels')
    spectrum, draws = _own_spectrum(values, parts, rows), np.random.default_rng(SEED)
    out, known = np.where(gaps[:, None], np.nan, values), {}
    for first, last in parts_between(gaps, 0):
        for begin in range(first, last, CHUNK * rows):
            low, end = max(0, begin - rows), min(begin + CHUNK * rows, last)
            high = min(len(out), end + rows)
            period = 2 * next_fast_len((high - low + rows) // 2, real=True)
            if period not in known:
                known[period] = _at(spectrum, period // 2 + 1)
            nowhere = np.full((high - low, width), np.nan)
            out[begin:end] = draw(out[low:high], nowhere, known[period],
                                  draws)[begin - low:end - low]
    return out


def _own_spectrum(values, parts, rows):
    """Return the mean spectrum of half overlapping segments in parts, (rows // 2 + 1, l, l)."""
    taper = np.hanning(rows + 1)[:-1]
    taper /= np.sqrt(np.sum(taper ** 2))
    begins = [b for first, last in parts for b in range(first, last - rows + 1, rows // 2)]
    total = 0.0
    for begin in begins:
        y = rfft(values[begin:begin + rows] * taper[:, None], axis=0)
        total = total + y[:, :, None] * y[:, None, :].conj()
    total = total / len(begins)
    wide = np.concatenate([total[SMOOTH // 2:0:-1].conj(), total, total[-2:-2 - SMOOTH // 2:-1]])
    return np.stack([wide[i:i + SMOOTH].mean(axis=0) for i in range(len(total))])


def _at(spectrum, bins):
    """Return a spectrum at so many bins from zero to half of the rate, positive definite."""
    at = np.linspace(0.0, len(spectrum) - 1, bins)
    low = np.minimum(at.astype(int), len(spectrum) - 2)
    share = (at - low)[:, None, None]
    found = (1 - share) * spectrum[low] + share * spectrum[low + 1]
    power = np.einsum('kii->i', spectrum).real / len(spectrum)
    return found + RIDGE * np.diag(power)


def draw(rows, limits, spectrum, draws):
    """
    Return rows (n, l) with missing samples, NaN, drawn from their distribution given the others.

    By Matheron's rule: a record y* drawn from the model, and the conditional mean of its
    difference to the record, -K_mm^-1 K_mo (y - y*), K the inverse of the covariance, eq. (110a).
    `limits`, (n, l), are values that missing ones are beyond, or NaN; `spectrum` is that of
    `spectrum` for an even period of at least n rows.
    """
    period = 2 * (len(spectrum) - 1)
    begin = (period - len(rows)) // 2       # of the record, in what the model says is periodic
    beside = (begin, period - len(rows) - begin), (0, 0)
    wide, limits = (np.pad(x, beside, constant_values=np.nan) for x in (rows, limits))
    inverse, gone = np.linalg.inv(spectrum), np.isnan(wide)
    precision, covariance = irfft(inverse, period, axis=0), irfft(spectrum, period, axis=0)
    other = np.roll(record_of(np.linalg.cholesky(spectrum), draws), begin, axis=0)
    pull = _filtered(inverse, rfft(np.where(gone, 0.0, wide - other), axis=0), period)
    wide = np.where(gone, other, wide)
    for part in _apart(gone[begin:begin + len(rows)], begin, _reach(precision, ALONE),
                       _reach(covariance, FORGOTTEN)):
        wide[part] += _conditional_mean(precision, covariance, gone[part], pull[part])
    if not np.isnan(limits).all():
        _beyond(wide, limits, inverse, draws)
    return wide[begin:begin + len(rows)]


def _reach(kernel, share):
    """Return the lag from which on a kernel (period, l, l) has less than a share of its size."""
    half = len(kernel) // 2
    scale = np.sqrt(np.diag(kernel[0]))
    size = np.abs(kernel[:half] / np.outer(scale, scale)).max(axis=(1, 2))
    small = np.sqrt(np.cumsum(size[::-1] ** 2)[::-1]) < share
    return int(np.argmax(small)) if small.any() else half


def _apart(gone, begin, reach, memory):
    """
    Return slices of rows whose missing samples have nothing to do with those of other slices.

    `gone` (n, l) is of a record that begins at a row; a slice within `reach` of its ends has
    `memory` rows beyond it, which are missing as well.
    """
    lost = np.flatnonzero(gone.any(axis=1))
    cuts = np.flatnonzero(np.diff(lost) > reach) + 1
    found = []
    for each in np.split(lost, cuts):
        first = begin + each[0] if each[0] > reach else max(0, begin - memory)
        last = begin + each[-1] + 1 + (memory if len(gone) - each[-1] <= reach else 0)
        found.append(slice(first, last))
    return found


def _conditional_mean(precision, covariance, gone, pull):
    """Return the solution of K_mm x = -pull by conjugate gradients, zero where nothing is gone."""
    from scipy.sparse.linalg import cg, LinearOperator      # here, for it takes a while

    # before SciPy 1.12 it is called tol
    near = {name: NEAR for name in ('rtol', 'tol') if name in inspect.signature(cg).parameters}
    count, lost = len(gone), np.nonzero(gone)
    period = min(next_fast_len(2 * count, real=True), len(precision))
    lags = np.r_[0:period - period // 2, -(period // 2):0]

    def of(kernel):
        matrices = rfft(kernel[lags], axis=0)

        def filtered(x):
            wide = np.zeros((period, gone.shape[1]))
            wide[lost] = x
            return _filtered(matrices, rfft(wide, axis=0), period)[lost]
        return LinearOperator((len(lost[0]),) * 2, filtered)
    # the covariance of what is missing is nearly the inverse of its precision, but at the edges
    mean, _ = cg(of(precision), -pull[lost], M=of(covariance), atol=0.0, maxiter=STEPS, **near)
    out = np.zeros(pull.shape)
    out[lost] = mean
    return out


def record_of(root, draws):
    """
    Return a periodic record (2 k, l) drawn from a spectrum.

    `root`, (k + 1, l, l), is its Cholesky factor at frequencies up to half of the rate.
    """
    rows, channels = 2 * (len(root) - 1), root.shape[-1]
    return _filtered(root, rfft(draws.standard_normal((rows, channels)), axis=0), rows)


def _filtered(matrices, transform, count):
    return irfft(applied(matrices, transform), count, axis=0)


def _beyond(wide, limits, inverse, draws):
    """Draw clipped values anew, from beyond their limits, by Gibbs sampling, eq. (110b)."""
    rows, channels = wide.shape
    precision = irfft(inverse, rows, axis=0)
    own, std = np.diag(precision[0]), 1 / np.sqrt(np.diag(precision[0]))
    reach = np.abs(precision[:rows // 2]).max(axis=(1, 2)) / own.min()
    beside = 2 * channels * np.cumsum(reach[::-1])[::-1]        # all that is as far, or farther
    # bursts of rows so far apart that they are almost independent are drawn at once
    stride = next(n for n in BURST * 2 ** np.arange(1, 30)
                  if n >= rows // 4 or beside[n - BURST] * BURST / n < COUPLED)
    for begin in [*range(0, stride, BURST)] * SWEEPS:
        at = np.arange(begin, rows - BURST + 1, stride)[:, None] + np.arange(BURST)
        at = at[~np.isnan(limits[at]).all(axis=(1, 2))]
        if not len(at):
            continue
        pull = _filtered(inverse, rfft(wide, axis=0), rows)[at]
        for row, channel in np.ndindex(BURST, channels):
            limit = limits[at[:, row], channel]
            hit = np.flatnonzero(~np.isnan(limit))
            if not len(hit):
                continue
            limit, place = limit[hit], (at[hit, row], channel)
            mean = wide[place] - pull[hit, row, channel] / own[channel]
            side = np.sign(limit)
            tail = ndtr((mean - limit) * side / std[channel]) * draws.random(len(hit))
            value = mean + side * std[channel] * -ndtri(np.maximum(tail, 1e-300))
            moved = precision[:BURST - row, :, channel]
            pull[hit, row:] += (value - wide[place])[:, None, None] * moved
            wide[place] = value
