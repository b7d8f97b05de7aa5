# Licensed under the Apache License, Version 2.0.
"""
The generator's own gap meter, and what the true effect at its true size would reduce.

Sbar_k is the expected periodogram of the truth without effect: its covariance times the taper's
own, transformed back (debiased Whittle, Sykulski et al. 2019). Y_k whitened by it gives per band
of n bins What = mean e e^H and D = tr What - log det What - c [nats], G = mean D, the levels of
loads and noise set to where G is least. The true effect is put in as the band means E that it
leaves in whitened simulations of its own, with and without it at equal seeds: D of E^-1/2 What
E^-1/2. Of a record with gaps the longest segment is used.
"""
from dataclasses import replace

from blindgen.physics.record import simulate
from blindgen.physics.spectrum import spectrum
import numpy as np
from scipy.optimize import minimize
from scipy.signal.windows import tukey

LOW_BINS = 8
BANDS = 60
FADED = 0.1                 # share of a record that the taper fades: leakage is in Sbar, not in G
RECORDS = 8                 # simulations of the floor, and pairs of them for an effect
SEED = 7_000_000            # of these simulations; no case has it


class Meter:
    """G of records of so many samples of a scenario without effect."""

    def __init__(self, scenario, samples):
        """Compute the expected tapered periodograms of loads and noise, (bins, c, c) each."""
        rate = scenario.craft.rate_hz
        period = 2 ** int(np.ceil(np.log2(2 * samples)))
        self.taper = tukey(samples, FADED)
        self.taper /= np.sqrt(np.mean(self.taper**2))
        overlap = np.fft.irfft(np.abs(np.fft.rfft(self.taper, period))**2, period) / samples
        self.parts = []
        for part in spectrum(scenario, np.fft.rfftfreq(period, 1 / rate)):
            covariance = np.fft.irfft(part, period, axis=0) * overlap[:, None, None]
            folded = covariance[:samples].copy()
            folded[1:] += covariance[period - samples + 1:]     # negative lags
            self.parts.append(np.fft.fft(folded, axis=0)[:samples // 2 + 1])
        bins = samples // 2 - LOW_BINS
        self.width = bins // BANDS
        self.kept = slice(LOW_BINS, LOW_BINS + self.width * BANDS)

    def whitened(self, values, levels=(0.0, 0.0)):
        """Return What (bands, c, c) of a record (samples, c) at logarithms of the levels."""
        y = np.fft.rfft(values * self.taper[:, None], axis=0) / np.sqrt(len(values))
        a, b = np.exp(levels)
        s, r = (part[self.kept] for part in self.parts)
        e = np.linalg.solve(np.linalg.cholesky(a * s + b * r), y[self.kept][:, :, None])[:, :, 0]
        e = e.reshape(BANDS, self.width, -1)
        return np.einsum('bki,bkj->bij', e, e.conj()) / self.width

    def gap(self, values, effect=None):
        """Return G [nats] of a record at the levels where it is least; effect is E, if any."""
        root = None if effect is None else np.linalg.cholesky(effect)

        def mean_gap(levels):
            what = self.whitened(values, levels)
            if root is not None:
                half = np.linalg.solve(root, what)
                what = np.linalg.solve(root, np.conj(np.swapaxes(half, -1, -2)))
            d = np.einsum('bii->b', what).real - np.linalg.slogdet(what)[1] - what.shape[-1]
            return float(np.mean(d))

        return minimize(mean_gap, [0.0, 0.0], method='Nelder-Mead',
                        options={'xatol': 1e-3, 'fatol': 1e-6, 'maxfev': 60}).fun


def closed_by_truth(plain, scenario, values, index):
    """
    Return before, floor and after [nats], and the closed share of the true effects at true size.

    closed is None where the gap exceeds the floor by less than 3 sd.

    Parameters
    ----------
    plain, scenario : Scenario
        The record's own, without and with its effects.
    values, index : (n, c) array, (n,) int array
        The record.

    """
    values = longest(values, index)
    plain, scenario = (replace(s, gaps=(), dropped=0.0) for s in (plain, scenario))
    rate, meter = plain.craft.rate_hz, Meter(plain, len(values))
    nulls = [simulate(plain, len(values) / rate, SEED + k)[0] for k in range(RECORDS)]
    gaps = [meter.gap(record) for record in nulls]
    low, spread = float(np.mean(gaps)), float(np.std(gaps, ddof=1))
    before = meter.gap(values)
    data = {'before': before, 'floor': low, 'floor_std': spread, 'after': None, 'closed': None}
    if before < low + 3 * spread:
        return data
    with_it = np.mean([meter.whitened(simulate(scenario, len(values) / rate, SEED + k)[0])
                       for k in range(RECORDS)], axis=0)
    # over that of the same loads without it: a ratio stays positive where little is over
    root = np.linalg.cholesky(np.mean([meter.whitened(record) for record in nulls], axis=0))
    half = np.linalg.solve(root, with_it)
    after = meter.gap(values, np.linalg.solve(root, np.conj(np.swapaxes(half, -1, -2))))
    return {**data, 'after': after, 'closed': (before - after) / (before - low)}


def longest(values, index, least=20):
    """Return the longest segment (n, c) of a record, single lost scans read from a line."""
    cuts = np.flatnonzero(np.diff(index) > least)
    begins, ends = np.append(0, cuts + 1), np.append(cuts, len(index) - 1)
    best = np.argmax(index[ends] - index[begins])
    own = slice(begins[best], ends[best] + 1)
    k = np.arange(index[own][0], index[own][-1] + 1)
    k = k[:len(k) // 2 * 2]
    return np.stack([np.interp(k, index[own], column) for column in values[own].T], axis=1)
