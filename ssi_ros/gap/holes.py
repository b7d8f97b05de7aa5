"""
Fill holes by a draw from what the model says of them, given all else, eq. (110a) and (110b).

A row that counts as zero spreads the strong resonances over all bins, the same in each, and the
valleys between them are lost. A draw leaves a record with the spectrum of the model, valleys and
all; a conditional mean would lack power, and one by near rows alone fills the valleys.
"""
from dataclasses import replace

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.sparse.linalg import cg, LinearOperator
from scipy.stats import norm

from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.check import runs
from ssi_ros.gap.fit import fit
from ssi_ros.gap.likelihood import Evidence
from ssi_ros.gap.scores import power_of
from ssi_ros.gap.spectra import make_frame, spectra

LONGEST_S = 1.0         # of a hole that is filled
BLOCK_S, BESIDE_S = 1200.0, 60.0        # filled at once, and what is looked at on both sides
ROUNDS = 5              # of filling and fitting the level, at most
ALIKE = 0.01            # logarithms of levels of two rounds
NEAR = 1e-5             # residual, relative, at which conjugate gradients stop
STEPS = 500             # of them, at most
SWEEPS = 6              # of draws beyond the rails
BURST = 16              # rows that are drawn one after the other
ALONE = 0.5             # of its own precision, that all values drawn at once may tell of one
SEED = 41


def without_rails(samples, effects):
    """
    Take out what a `saturation` among effects cut off.

    Parameters
    ----------
    samples : Samples
        The record.
    effects : sequence of Effect
        What is known of it.

    Returns
    -------
    samples : Samples
        NaN where a value is at the rails; the same ones where none is, or for too long.
    rails : ndarray, shape (n, l)
        The values at the rails, beyond which the true ones are; NaN elsewhere.

    """
    limit = min((e.limit_m_s2 for e in effects if e.name == 'saturation'), default=np.inf)
    with np.errstate(invalid='ignore'):
        railed = np.abs(samples.values) >= limit
    at = runs(railed.any(axis=1))
    if any(last - first > LONGEST_S * samples.rate_hz for first, last in at):
        railed[:] = False
    rails = np.where(railed, samples.values, np.nan)
    if not railed.any():
        return samples, rails
    return replace(samples, values=np.where(railed, np.nan, samples.values)), rails


def completed(simulator, samples, rails, settings):
    """
    Return a record without bias and holes, filled at its own level, and what is seen of it.

    What is filled in has the level that it is drawn at, so that both are told in turn. The noise
    of the sensors stays nominal: what is filled in would have more of it each time.

    Parameters
    ----------
    simulator : Simulator
        Model side, in the frame of the samples.
    samples : Samples
        NaN where a sample is missing.
    rails : ndarray, shape (n, l)
        As of `without_rails`.
    settings : DiagnosisSettings
        How a record is cut.

    Returns
    -------
    simulator : Simulator
        In the frame of the record without holes.
    samples : Samples
    evidence : Evidence
    levels : ndarray
        As of `Fit`.

    """
    lost = np.isnan(samples.values)
    # a bias is told with what the rails left of their values: without, the other side counts more
    bias = np.nanmean(np.where(lost, rails, samples.values), axis=0)
    samples, rails = replace(samples, values=samples.values - bias), rails - bias
    level, whole, frame = 1.0, filled(simulator, samples, rails), simulator.frame
    if whole is not samples:
        frame = make_frame(len(whole.values), whole.rate_hz, settings,
                           ~np.isnan(whole.values).any(axis=1))
        simulator = simulator.on(frame)
    for i in range(ROUNDS):
        evidence = Evidence(frame, spectra(whole, frame), frame.used)
        levels = fit(simulator, evidence).levels
        if whole is samples or i == ROUNDS - 1:
            break
        seen = excited(simulator, levels) / level
        if abs(np.log(seen)) < ALIKE:
            break
        # the filled share says what it was filled with
        level *= seen ** (1 / (1 - lost.mean()))
        bias = np.nanmean(whole.values, axis=0)
        samples, rails = replace(samples, values=samples.values - bias), rails - bias
        whole = filled(simulator, samples, rails, level)
    return simulator, whole, evidence, levels


def excited(simulator, levels):
    """Return the power of all excitation at levels, over nominal."""
    parts = [power_of([s]) for s in simulator.expected(Candidate()).shares[:-1]]
    return float(np.dot(parts, levels[:-1]) / np.sum(parts))


def filled(simulator, samples, rails=None, level=1.0):
    """
    Return the samples with every hole of up to LONGEST_S filled.

    Parameters
    ----------
    simulator : Simulator
        Model side.
    samples : Samples
        NaN where a sample is missing.
    rails : ndarray, shape (n, l), optional
        Values that missing ones are beyond, NaN where nothing is known.
    level : float
        Power of the excitation over nominal.

    Returns
    -------
    Samples
        The same ones if there is no such hole.

    """
    gone = np.isnan(samples.values)
    missing, longest = runs(gone.any(axis=1)), LONGEST_S * samples.rate_hz
    if not any(last - first <= longest for first, last in missing):
        return samples
    values, draws, known = samples.values.copy(), np.random.default_rng(SEED), {}
    rails = np.full(values.shape, np.nan) if rails is None else rails
    rows, beside = len(values), round(BESIDE_S * samples.rate_hz)
    edges = np.linspace(0, rows, max(1, round(rows / samples.rate_hz / BLOCK_S)) + 1).astype(int)
    for first, last in zip(edges, edges[1:]):
        if not gone[first:last].any():
            continue
        begin, end = max(0, first - beside), min(rows, last + beside)
        period = 2 * next_fast_len((end - begin + 1) // 2, real=True)
        if period not in known:
            known[period] = spectrum(simulator, period, level)
        # what was drawn in the block before is known to this one
        values[first:last] = draw(values[begin:end], rails[begin:end], known[period],
                                  draws)[first - begin:last - begin]
    for first, last in missing:
        if last - first > longest:
            values[first:last] = samples.values[first:last]
    return replace(samples, values=values)


def spectrum(simulator, period, level):
    """Return the spectrum of a record of the model of an even period, (period // 2 + 1, l, l)."""
    lags = np.arange(period)
    # flat to half of the period, so that autocovariances keep their value, then smooth to nothing
    fade = np.cos(np.pi / 2 * np.clip(2 * lags / period - 1, 0.0, 1.0)) ** 2
    side = simulator.on(replace(simulator.frame, rows=period, first=0, last=period // 2 + 1,
                                overlap=fade))
    nominal = side.expected(Candidate())
    levels = np.append(np.full(len(nominal.names) - 1, level), 1.0)
    values, vectors = np.linalg.eigh(nominal.at(levels)[0])
    # no direction has less than the noise of the sensors, whatever rounding and fading say
    least = np.linalg.eigvalsh(nominal.shares[-1][0])[:, :1]
    return (vectors * np.maximum(values, least)[:, None, :]) @ vectors.conj().swapaxes(-1, -2)


def draw(rows, rails, spectrum, draws):
    """
    Return rows with what is missing drawn from its distribution given the rest.

    By Matheron's rule: a record y* drawn from the model, and what its difference to the record
    says of the holes, -K_mm^-1 K_mo (y - y*), K the inverse of the covariance, by conjugate
    gradients, eq. (110a).

    Parameters
    ----------
    rows : ndarray, shape (n, l)
        NaN where a sample is missing.
    rails : ndarray, shape (n, l)
        Values that missing ones are beyond, or NaN.
    spectrum : ndarray, shape (p // 2 + 1, l, l)
        Of `spectrum`, for an even period of p >= n rows.
    draws : numpy.random.Generator
        Of the draws.

    Returns
    -------
    ndarray, shape (n, l)

    """
    beside = np.full((2 * (len(spectrum) - 1) - len(rows), rows.shape[1]), np.nan)
    wide, rails = np.concatenate([rows, beside]), np.concatenate([rails, beside])
    inverse = np.linalg.inv(spectrum)
    white = rfft(draws.standard_normal(wide.shape), axis=0)
    other = _filtered(np.linalg.cholesky(spectrum), white, len(wide))
    lost = np.nonzero(np.isnan(wide))
    # of the inverse covariance the block of one row, which is most of it
    own = np.linalg.inv(irfft(inverse, len(wide), axis=0)[0])

    def spread(x):
        out = np.zeros(wide.shape)
        out[lost] = x
        return out

    def applied(x):
        return _filtered(inverse, rfft(x, axis=0), len(wide))[lost]

    size = (len(lost[0]),) * 2
    difference = np.where(np.isnan(wide), 0.0, wide - other)
    told, _ = cg(LinearOperator(size, lambda x: applied(spread(x))), -applied(difference),
                 M=LinearOperator(size, lambda x: (spread(x) @ own)[lost]),
                 rtol=NEAR, maxiter=STEPS)
    wide[lost] = other[lost] + told
    if not np.isnan(rails).all():
        _beyond(wide, rails, inverse, draws)
    return wide[:len(rows)]


def _filtered(matrices, transform, count):
    return irfft((matrices @ transform[:, :, None])[..., 0], count, axis=0)


def _beyond(wide, rails, inverse, draws):
    """
    Draw what is at the rails anew, from beyond them, by Gibbs sampling, eq. (110b).

    Bursts of rows so far apart that they hardly tell of each other are drawn at once.
    """
    rows, channels = wide.shape
    precision = irfft(inverse, rows, axis=0)
    own, std = np.diag(precision[0]), 1 / np.sqrt(np.diag(precision[0]))
    reach = np.abs(precision[:rows // 2]).max(axis=(1, 2)) / own.min()
    beside = 2 * channels * np.cumsum(reach[::-1])[::-1]        # all that is as far, or farther
    stride = next(n for n in BURST * 2 ** np.arange(1, 30)
                  if n >= rows // 4 or beside[n - BURST] * BURST / n < ALONE)
    for begin in [*range(0, stride, BURST)] * SWEEPS:
        at = np.arange(begin, rows - BURST + 1, stride)[:, None] + np.arange(BURST)
        at = at[~np.isnan(rails[at]).all(axis=(1, 2))]
        pull = _filtered(inverse, rfft(wide, axis=0), rows)[at]
        for row, channel in np.ndindex(BURST, channels):
            rail = rails[at[:, row], channel]
            hit = np.flatnonzero(~np.isnan(rail))
            if not len(hit):
                continue
            rail, place = rail[hit], (at[hit, row], channel)
            mean = wide[place] - pull[hit, row, channel] / own[channel]
            side = np.sign(rail)
            tail = norm.sf((rail - mean) * side / std[channel]) * draws.random(len(hit))
            value = mean + side * std[channel] * norm.isf(np.maximum(tail, 1e-300))
            moved = precision[:BURST - row, :, channel]
            pull[hit, row:] += (value - wide[place])[:, None, None] * moved
            wide[place] = value
