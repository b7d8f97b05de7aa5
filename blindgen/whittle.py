# Licensed under the Apache License, Version 2.0.
"""
The generator's own gap meter, and what the true effect at its true size would close.

Sbar_k is the expected periodogram of the nominal model: its covariance times the taper's own,
transformed back (debiased Whittle, Sykulski et al. 2019). Y_k whitened by it gives per band of n
bins What = mean e e^H and D = tr What - log det What - 4 [nats], G = mean D, the levels of loads
and noise set to where G is least. The true effect is put in as the band means E that it leaves in
whitened simulations of its own, with and without it at equal seeds: D of E^-1/2 What E^-1/2.
"""
from functools import lru_cache

from blindgen.detect import NOMINAL
from blindgen.effects import EFFECTS
from blindgen.record import simulate
from blindgen.scenario import RATE_HZ
from blindgen.spectrum import _h, spectrum
import numpy as np
from scipy.optimize import minimize
from scipy.signal.windows import tukey

LOW_HZ = 0.1
BAND_BINS = 300             # 0.5 Hz of 600 s: wide bands see a divergence best over the floor
FADED = 0.1                 # share of a record that the taper fades: leakage is in Sbar, not in G
RECORDS = 8                 # simulations of the floor, and pairs of them for an effect
SEED = 7_000_000            # of these simulations; no case has it


@lru_cache(maxsize=2)
def expected(samples):
    """Return the expected tapered periodograms of loads and noise, (bins, 4, 4) each."""
    period = 2 ** int(np.ceil(np.log2(2 * samples)))
    f = np.fft.rfftfreq(period, 1 / RATE_HZ)
    w = _taper(samples)
    overlap = np.fft.irfft(np.abs(np.fft.rfft(w, period))**2, period) / samples
    out = []
    for part in spectrum(NOMINAL, f):
        covariance = np.fft.irfft(part, period, axis=0) * overlap[:, None, None]
        folded = covariance[:samples].copy()
        folded[1:] += covariance[period - samples + 1:]     # negative lags
        out.append(np.fft.fft(folded, axis=0)[:samples // 2 + 1])
    return tuple(out)


def gap(values, effect=None):
    """
    Return G [nats] of a record (samples, 4) [m/s^2] at the levels where it is least.

    effect : (bands, 4, 4) array
        E of an effect; the nominal model alone when left out.
    """
    y, s, r = _bins(values)
    root = None if effect is None else np.linalg.cholesky(effect)

    def mean_gap(levels):
        what = _whitened(y, s, r, levels)
        if root is not None:
            half = np.linalg.solve(root, what)
            what = np.linalg.solve(root, _h(half))
        d = np.einsum('bii->b', what).real - np.linalg.slogdet(what)[1] - 4
        return float(np.mean(d))

    best = minimize(mean_gap, [0.0, 0.0], method='Nelder-Mead',
                    options={'xatol': 1e-3, 'fatol': 1e-6, 'maxfev': 80})
    return best.fun


def whitened_bands(values):
    """Return What (bands, 4, 4) of a record (samples, 4) at nominal levels."""
    return _whitened(*_bins(values), (0.0, 0.0))


def _bins(values):
    """Return Y (k, 4) and the expected parts (k, 4, 4) of the bins of whole bands."""
    samples = len(values)
    y = np.fft.rfft(values * _taper(samples)[:, None], axis=0) / np.sqrt(samples)
    first = int(np.ceil(LOW_HZ * samples / RATE_HZ))
    bands = (samples // 2 - first) // BAND_BINS
    kept = slice(first, first + bands * BAND_BINS)
    return y[kept], *(part[kept] for part in expected(samples))


def _whitened(y, s, r, levels):
    a, b = np.exp(levels)
    e = np.linalg.solve(np.linalg.cholesky(a * s + b * r), y[:, :, None])[:, :, 0]
    e = e.reshape(-1, BAND_BINS, 4)
    return np.einsum('bki,bkj->bij', e, e.conj()) / BAND_BINS


@lru_cache(maxsize=2)
def floor(duration_s):
    """Return mean and standard deviation of G over records without effect, and their What."""
    records = [simulate(NOMINAL, duration_s, SEED + k)[0] for k in range(RECORDS)]
    gaps = [gap(record) for record in records]
    return (float(np.mean(gaps)), float(np.std(gaps, ddof=1)),
            [whitened_bands(record) for record in records])


def closed_by_truth(values, index, label, duration_s):
    """
    Return before, floor and after [nats], and the closed share of the true effects at true size.

    closed is None where the gap exceeds the floor by less than 3 sd. Missing scans are read from
    the line between their neighbours, in the record and in the simulations alike.
    """
    low, spread, nulls = floor(duration_s)
    before = gap(whole(values, index, duration_s))
    told = {'before': before, 'floor': low, 'floor_std': spread, 'after': None, 'closed': None}
    if before < low + 3 * spread or not label['effects']:
        return told
    scenario = NOMINAL
    for effect in label['effects']:
        scenario = EFFECTS[effect['name']].apply(scenario, effect['parameters'])
    # at nominal levels, which the simulations have; those of the record are found with E in place
    with_it = np.mean([whitened_bands(whole(*simulate(scenario, duration_s, SEED + k),
                                            duration_s)) for k in range(len(nulls))], axis=0)
    # over that of the same loads without it: a ratio stays positive where little is left
    root = np.linalg.cholesky(np.mean(nulls, axis=0))
    half = np.linalg.solve(root, with_it)
    after = gap(whole(values, index, duration_s), np.linalg.solve(root, _h(half)))
    return {**told, 'after': after, 'closed': (before - after) / (before - low)}


def whole(values, index, duration_s):
    """Return a record without missing scans."""
    k = np.arange(int(round(duration_s * RATE_HZ)))
    return np.stack([np.interp(k, index, column) for column in values.T], axis=1)


def _taper(samples):
    w = tukey(samples, FADED)
    return w / np.sqrt(np.mean(w**2))
