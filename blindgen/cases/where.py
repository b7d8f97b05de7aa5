# Licensed under the Apache License, Version 2.0.
"""
Where an effect shows, from the generator's own model with and without it.

Over frequency: the divergence of the two Gaussian models beyond what the unknowns explain (linear
effects); or the power of the difference of two records with equal loads and noise, with and
without the effect, whitened by the spectrum without (all others). Over time: that difference's
power alone, for effects that come and go. Sensors and arrays: those of the effect's own
parameters. Whatever is spread evenly has an empty list: there is no place to name.
"""
from dataclasses import replace

from blindgen.effects.base import EFFECTS
from blindgen.physics.propagate import modes_of
from blindgen.physics.record import simulate
import numpy as np

BANDS = 100                 # of equal width up to half the rate
TIMES = 20                  # true shares over the record
HALF_POWERS = 3             # a mode reaches +-3 half-power bands, as far as the next does not
IN_TIME = ('stiffness_drift', 'nonstationary_excitation', 'impulsive_events', 'saturation')


def where(knowledge, name, parameters, seed):
    """
    Return where an effect shows, as plain data: site, channels, arrays, bands, modes, times.

    bands: share of each hundredth of half the rate; modes: frequency [Hz] and share of each;
    times: share of each twentieth of the record. An empty list says that there is no such place.
    """
    effect, p, record = EFFECTS[name], parameters, knowledge.record
    craft, rate = record.scenario.craft, record.scenario.craft.rate_hz
    channels = [p[k] for k in ('channel',) if p.get(k, 'all') != 'all']
    arrays = ([p['array']] if 'array' in p else
              [craft.names[craft.sensors[craft.channels.index(c)].array] for c in channels])
    data = {'site': effect.site, 'channels': channels, 'arrays': arrays, 'half_rate_hz': rate / 2,
            'bands': [], 'modes': [], 'times': []}
    if effect.predict == 'count':                # missing scans are nowhere in a spectrum
        return data
    scenario, (f, _), linear = effect.apply(record.scenario, p), record.grid, (
        effect.predict in ('spectrum', 'rounding'))
    density = over_frequency(knowledge, scenario) if linear else None
    times = None
    if not linear or name in IN_TIME:
        per_bin, times = difference(record, scenario, seed)
        density = per_bin if density is None else density
    if not np.sum(density) > 0:                  # so weak that nothing was clipped, or the like
        return data
    band = np.minimum((f / rate * 2 * BANDS).astype(int), BANDS - 1)
    data['bands'] = _shares(np.bincount(band, density, BANDS))
    data['modes'] = _modes(record, density)
    if name in IN_TIME and np.sum(times) > 0:
        data['times'] = _shares(times)
    return data


def over_frequency(knowledge, scenario):
    """Return the power of a change at each point of the grid, beyond what the unknowns explain."""
    record = knowledge.record
    u = record.change(scenario)
    u = u - record.v.T @ np.linalg.solve(knowledge.before + record.fisher, record.v @ u)
    return np.sum(u.reshape(len(record.grid[0]), -1)**2, axis=1)


def difference(record, scenario, seed):
    """
    Return the whitened power of what an effect changes in one record.

    Returns
    -------
    density : (grid,) array
        At each point of the frequency grid.
    times : (TIMES,) array
        In each part of the record.

    """
    craft, rate = record.scenario.craft, record.scenario.craft.rate_hz
    both = []
    for each in (record.scenario, scenario):
        values, index = simulate(replace(each, gaps=()), record.duration_s, seed)
        whole = np.zeros((int(round(record.duration_s * rate)), len(craft.sensors)))
        whole[index] = values
        both.append(whole)
    # as much silence after the record: whitening rings for long, not into its start
    samples = len(both[0])
    change = np.fft.rfft(both[1] - both[0], 2 * samples, axis=0)
    f = np.fft.rfftfreq(2 * samples, 1 / rate)
    near = np.clip(np.searchsorted(record.grid[0], f), 0, len(record.grid[0]) - 1)
    white = np.einsum('kij,kj->ki', record.root[near], change)
    white[f < record.grid[0][0]] = 0             # the drift of a free hub
    density = np.bincount(near, np.sum(np.abs(white)**2, axis=1), len(record.grid[0]))
    power = np.sum(np.fft.irfft(white, 2 * samples, axis=0)[:samples]**2, axis=1)
    return density, np.array([part.sum() for part in np.array_split(power, TIMES)])


def _modes(record, density):
    """Return [frequency_hz, share] of each mode of the record without the effect."""
    hz, damping = modes_of(record.scenario)
    f = record.grid[0]
    inside = np.abs(f[:, None] - hz) <= HALF_POWERS * damping * hz
    nearest = np.argmin(np.abs(f[:, None] - hz), axis=1)
    total = [density[inside[:, k] & (nearest == k)].sum() for k in range(len(hz))]
    return [[round(float(a), 4), round(float(v / density.sum()), 4)] for a, v in zip(hz, total)]


def _shares(values):
    return [round(float(v), 4) for v in np.asarray(values) / np.sum(values)]
