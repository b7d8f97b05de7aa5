# Licensed under the Apache License, Version 2.0.
"""
How far an effect moves a record, in standard deviations: d', predicted before any record.

`alone` is d' of the effect at its own place, beyond all that the diagnosis may not know
(information.py); `attainable` pays for the search as well: which of the library's effects, where,
at which frequency (named and lines), or what at all (families). Linear effects: the divergence of
two Gaussian models. Sines, sweeps, pulses: the power ratio of their matched filter. Drift,
modulation, clipping limits and missing samples: their own counts. Nonlinear hinges: the shift of
the unknowns' scores between simulations with equal seeds, so that what only higher moments show
is not counted. Families: groups of statistics (groups.py).
"""
from dataclasses import replace

from blindgen.cases.draw import WARMING
from blindgen.effects import families, library, sensing  # noqa: F401  (they declare the effects)
from blindgen.effects.base import EFFECTS
from blindgen.physics.record import simulate
from blindgen.physics.spectrum import response
from blindgen.sizes import groups, sparse
from blindgen.sizes.information import flat
from blindgen.sizes.unknowns import unknowns
import numpy as np
from scipy.signal.windows import tukey
from scipy.special import erfc

CONTINUA = 4                # places that an effect with a free frequency or point is counted as
FADED = 0.05                # share of a record that the taper fades
PAIRS = 2                   # of simulations with and without a nonlinear effect
SEED = 6_000_000            # of these simulations; no case has it


def detectability(knowledge, name, parameters):
    """
    Return {'alone': d', 'attainable': d'} of an effect in the record of a Knowledge.

    Raises
    ------
    ValueError
        If no effect has the name.

    """
    effect = known(name)
    record, p = knowledge.record, parameters
    if effect.predict == 'statistics':
        return groups.sizes(knowledge, effect, p)
    if effect.predict == 'mean':
        return _rare(record, name, p)
    alone = _alone(knowledge, effect, p)
    return {'alone': alone, 'attainable': sparse.named(alone, hypotheses(record.scenario.craft))}


def known(name):
    """Return the Effect of a name, or raise a ValueError that lists the names."""
    if name not in EFFECTS:
        raise ValueError(f'effect {name!r} is not known; known are {", ".join(sorted(EFFECTS))}')
    return EFFECTS[name]


def hypotheses(craft):
    """Return how many effects and places of the library a diagnosis of a spacecraft searches."""
    channels, arrays, count = len(craft.channels), len(craft.arrays), 0
    variant = np.random.default_rng(0)
    for effect in EFFECTS.values():
        if effect.library and effect.fits(craft):
            v = effect.draw(variant, craft, 600.0)
            places = (channels * (channels - 1) if 'source' in v else channels if 'channel' in v
                      else arrays if 'array' in v else 1)
            count += places * (CONTINUA if {'f', 'along', 'angle', 'tau'} & set(v) else 1)
    return count


def _alone(knowledge, effect, p):
    """Return d' of an effect whose place is known, beyond what the unknowns explain."""
    record = knowledge.record
    scenario = record.scenario
    samples = float(np.sum(record.grid[1]) * 2)
    if effect.predict in ('spectrum', 'rounding'):
        return knowledge.distance(effect.apply(scenario, p))
    if effect.predict == 'level':
        # the score of all levels, weighted by a sine: half of its information
        levels = [k for k, u in enumerate(unknowns(scenario)) if u.name.startswith('level')]
        together = record.v[levels].sum(axis=0)
        return float(p['depth'] * np.sqrt(together @ together / 2))
    if effect.predict == 'drift':
        return _drift(knowledge, p['change'])
    if effect.predict == 'limits':
        power = np.einsum('kii->ki', record.spectrum).real.T @ record.share
        over = erfc(p['limit_m_s2'] / np.sqrt(2 * power))
        return float(np.sqrt(samples * np.sum(over)))
    if effect.predict == 'count':
        return float(np.sqrt(samples * p['fraction']))
    a, b = (simulated(knowledge, effect.apply(scenario, p), SEED + k) for k in range(PAIRS))
    return float(np.sqrt(max(knowledge.inner(a, b), 0.0)))


def _drift(knowledge, change):
    """Return d' of a drift: its mean as a change of stiffness, its ramp against the warming's."""
    record = knowledge.record
    half = record.change(EFFECTS['stiffness_scale'].apply(record.scenario,
                                                          {'scale': 1 + change / 2}))
    # a ramp of unit rise has the variance 1 / 12; half of it moved D by its mean
    ramp = (half @ half) * 4 / 12
    ramp = ramp / (1 + ramp / change**2 * WARMING**2)
    return float(np.sqrt(knowledge.size(half)**2 + ramp))


def simulated(knowledge, scenario, seed):
    """Return the change (as a vector) that an effect makes in the unknowns' scores, simulated."""
    record = knowledge.record

    def of(one):
        plain = replace(one, gaps=(), warming=0.0)
        return periodogram(record, simulate(plain, record.duration_s, seed)[0])

    without = record.once(('periodogram', seed), lambda: of(record.scenario))
    return knowledge.from_scores(record.v @ (of(scenario) - without))


def periodogram(record, values):
    """Return the whitened periodogram of values (samples, c), averaged onto a record's grid."""
    f, bins = record.grid
    taper = tukey(len(values), FADED)
    taper /= np.sqrt(np.mean(taper**2))
    dft = np.fft.rfft(values * taper[:, None], axis=0) / np.sqrt(len(values))
    edges = np.concatenate([[f[0]], (f[1:] + f[:-1]) / 2, [f[-1]]])
    # bin k lies from k - 1/2 to k + 1/2: a cell that ends within a bin takes its share of it
    at = edges * len(values) / record.scenario.craft.rate_hz + 0.5
    low = np.minimum(at.astype(int), len(dft) - 1)
    total = np.vstack([np.zeros((1, *2 * dft.shape[1:])),
                       np.cumsum(dft[:, :, None] * dft[:, None, :].conj(), axis=0)])
    upto = total[low] + (at - low)[:, None, None] * (total[low + 1] - total[low])
    mean = np.diff(upto, axis=0) / np.diff(at)[:, None, None]
    return flat(record.root @ mean @ np.conj(np.swapaxes(record.root, -1, -2)), bins)


def _rare(record, name, p):
    """Return the sizes of a waveform that is known but for its frequency or its instants."""
    scenario, (f, _) = record.scenario, record.grid
    samples = float(np.sum(record.grid[1]) * 2)
    g = (record.root @ response(scenario, f)[:, :, :1])[:, :, 0]
    quality = np.sum(np.abs(g)**2, axis=1)
    if name == 'impulsive_events':
        rate = scenario.craft.rate_hz
        height = p['impulse_n_m_s'] * rate * np.sqrt(np.average(quality, weights=record.share))
        d = sparse.pulses(height, p['rate_per_min'] / 60 / rate, samples)
        return {'alone': d, 'attainable': sparse.named(d, hypotheses(scenario.craft))}
    if name == 'harmonic_disturbance':
        at = np.array([p['frequency_hz']])
        root = record.root[np.argmin(np.abs(f - at))]
        q, cells = np.sum(np.abs(root @ response(scenario, at)[0, :, 0])**2), samples / 2
    else:                                        # a sweep has a first and a last frequency
        low, high = sorted((p['start_hz'], p['end_hz']))
        inside = (f >= low) & (f <= high)
        q = np.average(quality[inside], weights=record.share[inside])
        cells = (samples / 2)**2
    alone = float(p['torque_n_m'] * np.sqrt(samples / 2 * q))
    return {'alone': alone, 'attainable': sparse.searched(alone, cells)}


def size_for(knowledge, name, variant, target):
    """
    Return the parameters whose attainable d' is nearest to a target, and their sizes.

    A target that the bounds of the effect do not reach gives the bound and its own d'. The root of
    log d'(log m) by secants within a bracket, with a bisection every third step.
    """
    effect = known(name)
    cheap = effect.predict not in ('simulated', 'statistics')
    low, high = np.log(effect.low), np.log(effect.high)
    at, slope, found = (low + high) / 2, 1.0, []     # (log m, log d' / target, sizes)
    for turn in range(30 if cheap else 12):
        try:
            sizes = detectability(knowledge, name, effect.size(variant, float(np.exp(at))))
        except ArithmeticError:         # a motion that grows without end is seen by anything
            sizes = {'alone': np.inf, 'attainable': np.inf}
        # below its price a size says little of the slope: that of `alone` leads on
        d = max(sizes['attainable'], 0.05 * min(sizes['alone'], target), 1e-6)
        miss = np.log(d / target) if np.isfinite(d) else 20.0
        if found and at != found[-1][0]:
            slope = np.clip((miss - found[-1][1]) / (at - found[-1][0]), 0.5, 4.0)
        found.append((at, miss, sizes))
        if abs(miss) < (0.01 if cheap else 0.05) or high - low < 1e-3:
            break
        low, high = (at, high) if miss < 0 else (low, at)
        ahead = at - miss / slope
        at = ahead if low < ahead < high and turn % 3 != 2 else (low + high) / 2
    best, _, sizes = min(found, key=lambda one: abs(one[1]))
    return effect.size(variant, float(np.exp(best))), sizes
