# Licensed under the Apache License, Version 2.0.
"""
How far an effect moves a record, in standard deviations: d', predicted before any record.

Linear effects: J = sum over bins tr(S0^-1 dS S1^-1 dS), the symmetric divergence of the two
Gaussian models, whose small-effect limit is Fisher's information, with the part that a change of
excitation or noise level explains projected out; d' = sqrt(J). Sines, sweeps, pulses, spikes: the
power ratio of their matched filter, less what looking for them costs (sparse.py). Drift,
modulation, rails, rounding and missing samples: their own counts. Nonlinear effects: the shift of
nine probe scores (stiffness of each array and damping, in three bands) between simulations of
both with the same seeds. A diagnosis that must also look for the place of an effect sees
somewhat less.
"""
from dataclasses import replace
from functools import lru_cache

from blindgen import beyond, sparse  # noqa: F401  (beyond declares the ten effects outside)
from blindgen.effects import EFFECTS
from blindgen.record import simulate
from blindgen.scenario import RATE_HZ, Scenario
from blindgen.spectrum import _h, GRID_BINS, GRID_HZ, spectrum, transfer
import numpy as np

NOMINAL = Scenario()
PROBE_BANDS_HZ = ((0.1, 1.5), (1.5, 4.0), (4.0, 50.0))


def detectability(name, parameters, duration_s, level=1.0, seed=1):
    """
    Return the predicted d' of an effect with its parameters in a record of a length [s].

    The excitation level counts for the rails alone, where it changes all; elsewhere it moves d'
    by less than the 3 dB that it moves itself, and the prediction is for 0 dB.

    Raises
    ------
    ValueError
        If no effect has the name.

    """
    if name not in EFFECTS:
        raise ValueError(f'effect {name!r} is not known; known are {", ".join(sorted(EFFECTS))}')
    effect = EFFECTS[name]
    p = parameters
    bins = duration_s / 600                  # the grid counts the bins of 600 s
    samples = duration_s * RATE_HZ
    if effect.predict == 'spectrum':
        return np.sqrt(bins * divergence(effect.apply(NOMINAL, p)))
    if effect.predict == 'rounding':
        # Its noise, as if the noise level were known; that values repeat tells at any step.
        return np.sqrt(bins * divergence(effect.apply(NOMINAL, p), levels=False))
    if effect.predict == 'mean':
        return _rare(name, p, samples)
    if effect.predict == 'swing':
        # the score of the level, weighted by a sine: half of its information
        return p['depth'] * np.sqrt(bins * _level_information() / 2)
    if effect.predict == 'drift':
        # mean square of a ramp from 0 to 1
        half = EFFECTS['stiffness_scale'].apply(NOMINAL, {'scale': 1 + p['change'] / 2})
        return np.sqrt(bins * divergence(half) * 4 / 3)
    if effect.predict == 'wander':
        gain = {'channel': p['channel'], 'scale': 1 + p['rms']}
        return np.sqrt(bins * divergence(EFFECTS['sensor_gain'].apply(NOMINAL, gain)))
    if effect.predict == 'rails':
        from scipy.special import erfc
        return np.sqrt(samples * 4 * erfc(p['limit_m_s2'] / level / _signal_rms() / np.sqrt(2)))
    if effect.predict == 'count':
        return np.sqrt(samples * p['fraction'])
    return _simulated(effect.apply(NOMINAL, p), duration_s, seed)


def size_for(name, variant, target, duration_s, level=1.0):
    """
    Return the parameters whose predicted d' is nearest to a target, and that d'.

    A target that the bounds of the effect do not reach gives the bound and its own d'.
    """
    m, d = magnitude_for(name, variant, target, duration_s, level)
    return EFFECTS[name].size(variant, m), d


def magnitude_for(name, variant, target, duration_s, level=1.0):
    """
    Return the size m whose predicted d' is nearest to a target, and that d'.

    The root of log d'(log m) by secants within a bracket, with a bisection every third step.
    """
    effect = EFFECTS[name]
    cheap = effect.predict != 'simulated'
    low, high = np.log(effect.low), np.log(effect.high)
    at, slope = (low + high) / 2, 1.0
    found = []                                   # (log m, log d' / target)
    for turn in range(25 if cheap else 9):
        d = detectability(name, effect.size(variant, float(np.exp(at))), duration_s, level)
        miss = np.log(max(d, 1e-6) / target) if np.isfinite(d) else 20.0
        if found and at != found[-1][0]:
            slope = np.clip((miss - found[-1][1]) / (at - found[-1][0]), 0.5, 3.0)
        found.append((at, miss))
        if abs(miss) < (0.02 if cheap else 0.15) or high - low < 1e-3:
            break
        low, high = (at, high) if miss < 0 else (low, at)
        ahead = at - miss / slope
        inside = low < ahead < high
        at = ahead if inside and turn % 3 != 2 else (low + high) / 2
    best, miss = min(found, key=lambda pair: abs(pair[1]))
    return float(np.exp(best)), float(target * np.exp(miss))


def divergence(scenario, levels=True):
    """Return J of 600 s between the nominal and a scenario, free levels projected out."""
    s0, r0 = _nominal()
    s1, r1 = spectrum(scenario)
    i0, i1 = np.linalg.inv(s0 + r0), np.linalg.inv(s1 + r1)

    def inner(a, b):
        left, right = i0 @ a, i1 @ b
        return float(np.einsum('k,kij,kji->', GRID_BINS, left, right).real)

    change = s1 + r1 - s0 - r0
    if not levels:
        return inner(change, change)
    nuisance = [s0, r0]
    f = np.array([[inner(a, b) for b in nuisance] for a in nuisance])
    b = np.array([(inner(change, a) + inner(a, change)) / 2 for a in nuisance])
    return max(inner(change, change) - b @ np.linalg.solve((f + f.T) / 2, b), 0.0)


@lru_cache(maxsize=1)
def _nominal():
    return spectrum(NOMINAL)


@lru_cache(maxsize=1)
def _signal_rms():
    s, r = _nominal()
    return float(np.sqrt(np.einsum('k,k->', GRID_BINS, (s + r)[:, 0, 0].real) / GRID_BINS.sum()))


@lru_cache(maxsize=1)
def _level_information():
    s, r = _nominal()
    w = np.linalg.solve(s + r, 2 * s)
    return float(np.einsum('k,kij,kji->', GRID_BINS, w, w).real)


def _rare(name, p, samples):
    """Return d' of a waveform that is known but for its frequency or its instants."""
    s, r = _nominal()
    inverse = np.linalg.inv(s + r)
    if name == 'electromagnetic_spikes':
        quality = np.einsum('kii->k', inverse).real / 4      # all channels, own signs
        height = p['size_m_s2'] * np.sqrt(np.average(quality, weights=GRID_BINS))
        return sparse.spikes(height, p['rate_per_min'] / 60 / RATE_HZ, samples)
    g = transfer(NOMINAL)[:, :, :1]
    quality = (_h(g) @ inverse @ g)[:, 0, 0].real
    if name == 'impulsive_events':
        height = p['impulse_n_m_s'] * RATE_HZ * np.sqrt(np.average(quality, weights=GRID_BINS))
        return sparse.pulses(height, p['rate_per_min'] / 60 / RATE_HZ, samples)
    if name == 'harmonic_disturbance':
        at = transfer(NOMINAL, np.array([p['frequency_hz']]))[:, :, :1]
        near = np.argmin(np.abs(GRID_HZ - p['frequency_hz']))
        q, cells = (_h(at) @ inverse[near:near + 1] @ at)[0, 0, 0].real, samples / 2
    else:                                        # a sweep has a first and a last frequency
        low, high = sorted((p['start_hz'], p['end_hz']))
        inside = (GRID_HZ >= low) & (GRID_HZ <= high)
        q, cells = np.average(quality[inside], weights=GRID_BINS[inside]), (samples / 2)**2
    return sparse.searched(p['torque_n_m'] * np.sqrt(samples / 2 * q), cells)


@lru_cache(maxsize=1)
def _probes():
    """Return W (probes, bins, 4, 4) of the probe scores, two nuisances first, and F."""
    s, r = _nominal()
    inverse = np.linalg.inv(s + r)
    small = 1e-4
    changes = [s, r]
    for change in ({'plate_scale': (1 + small, 1.0)}, {'plate_scale': (1.0, 1 + small)},
                   {'damping_scale': 1 + 100 * small}):
        moved = sum(spectrum(replace(NOMINAL, **change))) - s - r
        changes += [moved * ((GRID_HZ >= low) & (GRID_HZ < high))[:, None, None]
                    for low, high in PROBE_BANDS_HZ]
    w = np.array([inverse @ change @ inverse for change in changes])
    f = np.array([[np.einsum('k,kij,kji->', GRID_BINS, a, c).real for c in changes] for a in w])
    return w, f


def _simulated(scenario, duration_s, seed):
    """Return the shift of the probe scores that an effect makes in simulations of its own."""
    w, f = _probes()
    shift = np.mean([_scores(scenario, duration_s, k, w) - _scores(NOMINAL, duration_s, k, w)
                     for k in (seed, seed + 1)], axis=0) * duration_s / 600
    f = f * duration_s / 600
    cross = np.linalg.solve(f[:2, :2], f[:2, 2:])
    shift, f = shift[2:] - cross.T @ shift[:2], f[2:, 2:] - f[2:, :2] @ cross
    return float(np.sqrt(max(shift @ np.linalg.solve(f, shift), 0.0)))


@lru_cache(maxsize=8)
def _periodogram(scenario, duration_s, seed):
    """Return the tapered periodogram of a simulation, averaged onto the grid, (bins, 4, 4)."""
    y, _ = simulate(scenario, duration_s, seed)
    taper = np.hanning(len(y))
    taper /= np.sqrt(np.mean(taper**2))
    f = np.fft.rfftfreq(len(y), 1 / RATE_HZ)
    dft = np.fft.rfft(y * taper[:, None], axis=0) / np.sqrt(len(y))
    power = dft[:, :, None] * dft[:, None, :].conj()
    edges = np.concatenate([GRID_HZ - 1 / 1200, [50.0]])
    edges[2399:-1] = GRID_HZ[2399:] - 0.005
    first = np.searchsorted(f, edges)
    total = np.vstack([np.zeros((1, 4, 4)), np.cumsum(power, axis=0)])
    count = np.maximum(first[1:] - first[:-1], 1)
    return (total[first[:-1] + count] - total[first[:-1]]) / count[:, None, None]


def _scores(scenario, duration_s, seed, w):
    key = scenario if not scenario.local else None
    power = (_periodogram(scenario, duration_s, seed) if key is not None
             else _periodogram.__wrapped__(scenario, duration_s, seed))
    return np.einsum('k,pkij,kji->p', GRID_BINS, w, power).real
