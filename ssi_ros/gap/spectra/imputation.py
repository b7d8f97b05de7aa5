"""
Fill gaps in the data by draws from the model, given all other samples, eq. (110a) and (110b).

A row that counts as zero leaks the strong resonances into all bins alike and buries the
antiresonances. A draw keeps the spectrum of the model; a conditional mean would lack power, and
one given near rows alone would fill the antiresonances.
"""
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.fft import next_fast_len

from ssi_ros.arrays import runs
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.spectra.segmentation import frame_of
from ssi_ros.gap.spectra.thresholds import LIMITS
from ssi_ros.hermitian import raised
from ssi_ros.integrity.filling import draw

BLOCK_S, BESIDE_S = 1200.0, 60.0        # filled at once, and used on both sides
LAGS_S = 300.0          # at which autocovariances count in full: slow modes of short records
ROUNDS = 5              # of filling and fitting the level, at most
SETTLINGS = 16.0        # in a period: what lasts would end with it, and leak into all bins
LEAST_SHARE = 0.1       # by which fitted levels follow those of filled samples, at least
LONGEST = 5.0           # step of the logarithm of a level that it comes to
TOO_QUIET = ('the noise of the sensors in the model is too far below the motion for double '
             'precision; give them a noise_rms of 1e-5 of the motion or more')
OFFSETS = 3             # rounds of filling long gaps and taking the offset
SEED = 41


def without_clipped(samples, effects):
    """Mark values at the clipping limits of effects as missing."""
    # Returns the samples, NaN where a value is clipped, the same ones where none is, or for too
    # long; and the clipped values (n, l), beyond which the true ones are, NaN elsewhere.
    limit = min((e.limit for e in effects), default=np.inf)
    if np.isinf(limit):
        return samples, np.broadcast_to(np.nan, samples.values.shape)
    with np.errstate(invalid='ignore'):
        clipped = np.abs(samples.values) >= limit
    at = runs(clipped.any(axis=1))
    if any(last - first > LIMITS.gap_s.value * samples.rate_hz for first, last in at):
        clipped[:] = False
    limits = np.where(clipped, samples.values, np.nan)
    if not clipped.any():
        return samples, limits
    return replace(samples, values=np.where(clipped, np.nan, samples.values)), limits


def completed(simulator, samples, limits, settings, levels=None):
    """
    Return a record without bias and gaps, filled at its own levels, and its evidence.

    `samples` and `limits` are those of `without_clipped`. Filled samples have the levels that they
    are drawn at, so that both are estimated in turn, from `levels` on. The noise of the sensors
    stays nominal: filled samples would have more of it each time. Returns the simulator in the
    frame of the record without gaps, samples, Evidence, and levels as of `Fit`.
    """
    lost, bias = np.isnan(samples.values), samples.values.mean(axis=0)
    if lost.any():
        # the bias includes clipped values: without them, the other side would count more
        bias = np.nanmean(np.where(lost, limits, samples.values), axis=0)
        limits = limits - bias
    samples = replace(samples, values=samples.values - bias)
    # the mean between long gaps is that of half waves, too: what is lost has a mean as well
    long_gaps = any(last - first > LIMITS.filled_s.value * samples.rate_hz
                    for first, last in runs(lost.any(axis=1)))
    for _ in range(OFFSETS if long_gaps else 0):
        whole = filled(simulator, samples, limits=limits)
        bias = whole.values.mean(axis=0) / np.mean(~lost, axis=0)
        samples, limits = replace(samples, values=samples.values - bias), limits - bias
    frame, level = simulator.frame, np.ones(len(simulator.expected(Candidate()).names))
    if levels is not None:
        level[:-1] = levels[:-1]

    def with_short_gaps_filled():
        return filled(simulator, samples, level, limits=limits, longest_s=LIMITS.filled_s.value)
    whole = with_short_gaps_filled()
    if whole is not samples:
        frame = frame_of(whole, settings)
        simulator = simulator.on(frame)
    found = moved = 0.0
    for i in range(ROUNDS):
        evidence = simulator.evidence(whole)
        if (alone := fit(simulator, evidence)) is None:
            raise ValueError(TOO_QUIET)
        levels = alone.levels
        if whole is samples or i == ROUNDS - 1:
            break
        before, found = found, np.append(np.log(levels[:-1] / level[:-1]), 0.0)
        if np.abs(found).max() < LIMITS.level_change.value:
            break
        # the filled share has the levels that it was drawn at; then as steps have changed before
        share = np.mean(~lost[~np.isnan(whole.values).any(axis=1)])
        if i:
            share = np.clip((before - found) / np.where(moved, moved, 1.0), LEAST_SHARE, 1.0)
        moved = np.clip(found / share, -LONGEST, LONGEST)
        level = level * np.exp(moved)
        bias = 0.0 if np.isnan(whole.values).any() else whole.values.mean(axis=0)
        samples, limits = replace(samples, values=samples.values - bias), limits - bias
        whole = with_short_gaps_filled()
    return simulator, whole, evidence, levels


def filled(simulator, samples, levels=None, candidate=Candidate(), *, limits=None,
           longest_s=np.inf):
    """
    Return the samples with every gap of up to `longest_s` filled; the same ones without any.

    They are drawn from the spectrum of a candidate at levels, (c,), 1 if not given, conditional on
    all that was recorded.
    `limits`, (n, l), are values that missing ones are beyond, NaN where there is none.
    """
    if simulator.known:
        return _beside_inputs(simulator, samples, levels, candidate, limits, longest_s)
    gone = np.isnan(samples.values)
    missing, longest = runs(gone.any(axis=1)), longest_s * samples.rate_hz
    if not any(last - first <= longest for first, last in missing):
        return samples
    values, draws, known = samples.values.copy(), np.random.default_rng(SEED), {}
    limits = np.full(values.shape, np.nan) if limits is None else limits
    rows, (beside, lags) = len(values), (round(s * samples.rate_hz) for s in (BESIDE_S, LAGS_S))
    edges = np.linspace(0, rows, max(1, round(rows / samples.rate_hz / BLOCK_S)) + 1).astype(int)
    for first, last in zip(edges, edges[1:]):
        if not gone[first:last].any():
            continue
        begin, end = max(0, first - beside), min(rows, last + beside)
        count = end - begin     # what is beside the record keeps its end from its begin
        period = 2 * next_fast_len(max((count + beside + 1) // 2, min(count, lags)), real=True)
        if period not in known:
            known[period] = spectrum(simulator, period, levels, candidate)
        # draws of the block before are given to this one
        values[first:last] = draw(values[begin:end], limits[begin:end], known[period],
                                  draws)[first - begin:last - begin]
    for first, last in missing:
        if last - first > longest:
            values[first:last] = samples.values[first:last]
    return replace(samples, values=values)


def _beside_inputs(simulator, samples, levels, candidate, limits, longest_s):
    """Return the samples with the gaps of the channels filled; inputs before them have none."""
    known, values = simulator.known, samples.values
    rest = replace(samples, values=values[:, known:], channels=samples.channels[known:])
    whole = filled(simulator.of_inputs(first=False, shown=False), rest, levels, candidate,
                   limits=limits if limits is None else limits[:, known:], longest_s=longest_s)
    return samples if whole is rest else replace(samples, values=np.hstack(
        [values[:, :known], whole.values]))


def spectrum(simulator, period, levels, candidate=Candidate()):
    """Return the spectrum of a record of an even period at levels, (period // 2 + 1, l, l)."""
    laws = simulator.setup(candidate).laws      # of hinges, whose stiffness depends on levels
    found = _of_period(simulator, period, candidate, tuple(levels) if laws and (
        levels is not None) else None)
    levels = np.ones(len(found.names)) if levels is None else levels
    return raised(found.at(levels)[0], found.shares[-1][0] * levels[-1])


@lru_cache(maxsize=1)
def _of_period(simulator, period, candidate, levels):
    """Return the Expected of a record of a period; the last one is kept, for other levels."""
    lags = np.arange(period)
    # flat to half of the period, so that autocovariances keep their value, then smooth to nothing
    fade = np.cos(np.pi / 2 * np.clip(2 * lags / period - 1, 0.0, 1.0)) ** 2
    side = simulator.on(replace(
        simulator.frame, rows=period, begins=(0,), first=0, last=period // 2 + 1, overlap=fade,
        taper=np.full(period, period ** -0.5), settlings=SETTLINGS))
    return side.spectrum(side.setup(candidate, levels))
