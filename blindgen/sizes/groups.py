# Licensed under the Apache License, Version 2.0.
"""
Size of an effect that no template holds: groups of statistics that any diagnosis could take.

A family's function is drawn at random, so its own matched test is nobody's. Simulations with equal
seeds, with and without the effect, give the shift of each statistic; records without effect give
its spread. Groups: the spectrum by band and by pair of channels, beyond what the unknowns explain;
power by time, band and channel; the scores of a static curve of degree 2 to 6 in each channel;
tails of each whitened channel and of each deconvolved input. `alone` adds all shifts up, as if the
pattern were known; `attainable` searches the groups.
"""
from dataclasses import replace
from functools import lru_cache

from blindgen.physics.record import simulate
from blindgen.physics.spectrum import response
from blindgen.sizes import sparse
import numpy as np
from numpy.polynomial import hermite_e

NULLS, PAIRS = 6, 2
TIMES, TIME_BANDS, BANDS = 24, 4, 16
DEGREES = range(2, 7)
LIMITS = (3.0, 4.0, 5.0)
SEED = 6_500_000            # of these simulations; no case has it
LINEAR = ('random_filter', 'extra_oscillator', 'extra_input')


def sizes(knowledge, effect, parameters):
    """Return {'alone': d', 'attainable': d'} of an effect of a family."""
    record = knowledge.record
    scenario = effect.apply(record.scenario, parameters)
    if effect.name in LINEAR:
        return _searched(*_spectral(knowledge, record.change(scenario), None))
    power, count = [], []
    pairs = [_shift(knowledge, scenario, SEED + 100 + k) for k in range(PAIRS)]
    for a, b in zip(*pairs):
        # independent pairs: what is noise in both has no product
        power.append(np.sum(a * b, axis=-1).ravel())
        count.append(np.full(power[-1].shape, a.shape[-1]))
    from blindgen.sizes.predict import simulated
    u = [simulated(knowledge, scenario, SEED + 200 + k) for k in range(PAIRS)]
    spectral = _spectral(knowledge, *u)
    return _searched(np.concatenate([*power, spectral[0]]), np.concatenate([*count, spectral[1]]),
                     sum(p.sum() for p in power[:1]) + sum(p.sum() for p in power[2:])
                     + spectral[2])


def _searched(power, count, total=None):
    total = np.sum(power) if total is None else total
    return {'alone': float(np.sqrt(max(total, 0.0))),
            'attainable': sparse.omnibus(np.maximum(power, 0.0), count)}


def _spectral(knowledge, u, other):
    """Return power and dimension of the groups of a change of the spectrum, and all its power."""
    record = knowledge.record
    f, channels = record.grid[0], len(record.scenario.craft.sensors)
    both = [u] if other is None else [u, other]
    total = knowledge.inner(both[0], both[-1])
    both = [v - record.v.T @ np.linalg.solve(
        knowledge.before + record.fisher, record.v @ v) for v in both]
    product = (both[0] * both[-1]).reshape(len(f), channels**2)
    band = np.minimum(BANDS * np.arange(len(f)) // len(f), BANDS - 1)
    cells = np.array([product[band == b].sum(axis=0) for b in range(BANDS)])
    off = (channels**2 - channels) // 2
    pairs = np.hstack([cells[:, :channels],
                       cells[:, channels:channels + off] + cells[:, channels + off:]])
    each = np.append(np.ones(channels), np.full(off, 2.0))
    # a band has some ten resolution cells along frequency whose pattern is not known either
    deep = 4.0
    power = np.concatenate([pairs.ravel(), pairs.sum(axis=0), pairs.sum(axis=1)])
    count = np.concatenate([np.tile(deep * each, BANDS), deep * BANDS * each,
                            np.full(BANDS, deep * channels**2)])
    return power, count, total


def _shift(knowledge, scenario, seed):
    """Return the shifts of the statistics in units of their spread, one array a kind."""
    record = knowledge.record
    mean, spread = _null(knowledge)

    def of(one):
        plain = replace(one, gaps=(), warming=0.0)
        return statistics(record, simulate(plain, record.duration_s, seed)[0])

    without = record.once(('statistics', seed), lambda: of(record.scenario))
    return [(b - a) / s for a, b, s in zip(without, of(scenario), spread)]


@lru_cache(maxsize=1)
def _null(knowledge):
    """Return mean and spread of each statistic over records without effect."""
    record = knowledge.record
    plain = replace(record.scenario, gaps=(), warming=0.0)
    got = [statistics(record, simulate(plain, record.duration_s, SEED + k)[0])
           for k in range(NULLS)]
    means = [np.mean([g[k] for g in got], axis=0) for k in range(len(got[0]))]
    spreads = []
    for k in range(len(means)):
        variance = np.var([g[k] for g in got], axis=0, ddof=1)
        # times are alike, and so are channels: their spreads are pooled
        pooled = np.broadcast_to(variance.mean(axis=tuple(range(1, variance.ndim - 1)) or (0,),
                                               keepdims=True), variance.shape)
        if k == 0:
            pooled = np.broadcast_to(variance.mean(axis=(0, 2), keepdims=True), variance.shape)
        spreads.append(np.sqrt(np.maximum(pooled, 1e-30)))
    return means, spreads


def statistics(record, values):
    """
    Return the statistics of a record (samples, c), one array a kind; groups by the last axis.

    power (channels, bands, times), power along time over all bands and channels (1, times), curves
    (channels, degrees), tails of channels and inputs (channels + inputs, limits)
    """
    craft = record.scenario.craft
    samples, rate = len(values), craft.rate_hz
    f = np.fft.rfftfreq(samples, 1 / rate)
    near = np.clip(np.searchsorted(record.grid[0], f), 0, len(record.grid[0]) - 1)
    inside = (f >= record.grid[0][0]) & (f <= record.grid[0][-1])
    y = np.fft.rfft(values, axis=0)
    white = np.einsum('kij,kj->ki', record.root[near], y) * inside[:, None]
    tops = np.quantile(np.flatnonzero(inside), np.arange(TIME_BANDS + 1) / TIME_BANDS)
    power = []
    for low, high in zip(tops[:-1].astype(int), tops[1:].astype(int)):
        part = np.zeros_like(white)
        part[low:high] = white[low:high]
        e = np.fft.irfft(part, samples, axis=0)**2
        cut = e[:samples // TIMES * TIMES].reshape(TIMES, -1, e.shape[1]).mean(axis=1)
        power.append((np.log(cut) - np.log(cut.mean(axis=0))).T)
    power = np.stack(power, axis=1)
    root = record.root[near]
    inverse = np.einsum('kji,kj->ki', root.conj(), white)
    dual = np.fft.irfft(inverse, samples, axis=0)
    scale = np.sqrt(np.einsum('kii->ki', record.spectrum).real.T @ record.share)
    curves = np.array([[np.sum(dual[:, c] * hermite_e.hermeval(
        np.clip(values[:, c] / scale[c], -3, 3), np.eye(7)[d])) for d in DEGREES]
        for c in range(values.shape[1])])
    g = response(record.scenario, record.grid[0])[near]
    u = np.fft.irfft(np.einsum('kij,ki->kj', g.conj(), inverse), samples, axis=0)
    series = np.hstack([np.fft.irfft(white, samples, axis=0), u[:, :craft.inputs]])
    series = series / np.median(np.abs(series), axis=0) * 0.6745
    tails = np.stack([np.log(np.mean(np.maximum(np.abs(series) - limit, 0)**2, axis=0)
                             + 1e-3 / samples) for limit in LIMITS], axis=-1)
    return power, power.mean(axis=(0, 1))[None], curves, tails
