# Licensed under the Apache License, Version 2.0.
"""
Where an effect shows, from the generator's own model with and without it.

Over frequency: the divergence of the two Gaussian models, bin by bin, excitation and noise level
projected out (linear effects); or the power of the difference of two records with equal loads and
noise, with and without the effect, whitened by the nominal spectrum (all others). Over time: that
difference's power alone, for effects that come and go. Sensors and arrays: those of the effect's
own parameters. Whatever is spread evenly is left empty: there is no place to name.
"""
from blindgen.craft import assemble, frequencies
from blindgen.detect import NOMINAL
from blindgen.effects import EFFECTS
from blindgen.record import simulate
from blindgen.scenario import CHANNELS, RATE_HZ, SENSOR_ARRAY
from blindgen.spectrum import GRID_BINS, GRID_HZ, spectrum
import numpy as np

BAND_HZ = 0.5               # of the true shares over frequency, 0 to 50 Hz
TIMES = 20                  # true shares over the record
HALF_POWERS = 3             # a mode reaches +-3 half-power bands, as far as the next does not
IN_TIME = ('stiffness_drift', 'nonstationary_excitation', 'impulsive_events', 'saturation',
           'gain_wander', 'electromagnetic_spikes', 'rotating_geometry')


def where(name, parameters, duration_s, seed):
    """
    Return where an effect shows, as plain data: site, channels, arrays, bands, modes, times.

    bands: share of each 0.5 Hz; modes: frequency [Hz] and share of each; times: share of each
    twentieth of the record. Shares are of all that the effect changes; an empty list says that
    there is no such place.
    """
    effect, p = EFFECTS[name], parameters
    channels = [p[k] for k in ('channel',) if p.get(k, 'all') != 'all']
    arrays = ([p['array']] if 'array' in p else
              [f'E{1 + SENSOR_ARRAY[CHANNELS.index(c)]}' for c in channels])
    told = {'site': effect.site, 'channels': channels, 'arrays': arrays, 'bands': [], 'modes': [],
            'times': []}
    if effect.predict == 'count':                # missing scans are nowhere in a spectrum
        return told
    if effect.predict in ('spectrum', 'rounding'):
        density = over_frequency(effect.apply(NOMINAL, p))
        times = None
    if effect.predict not in ('spectrum', 'rounding') or name in IN_TIME:
        per_bin, times = difference(effect.apply(NOMINAL, p), duration_s, seed)
        density = per_bin if effect.predict not in ('spectrum', 'rounding') else density
    if not np.sum(density) > 0:                  # so weak that nothing was clipped, or the like
        return told
    band = np.minimum((GRID_HZ / BAND_HZ).astype(int), int(50 / BAND_HZ) - 1)
    told['bands'] = _shares(np.bincount(band, density, int(50 / BAND_HZ)))
    told['modes'] = _modes(density)
    if name in IN_TIME and np.sum(times) > 0:
        told['times'] = _shares(times)
    return told


def over_frequency(scenario):
    """Return the divergence from the nominal at each point of the grid, levels projected out."""
    s0, r0 = spectrum(NOMINAL)
    s1, r1 = spectrum(scenario)
    i0, i1 = np.linalg.inv(s0 + r0), np.linalg.inv(s1 + r1)

    def density(a, b, left=i0, right=i0):
        return GRID_BINS * np.einsum('kij,kji->k', left @ a, right @ b).real

    change = s1 + r1 - s0 - r0
    f = np.array([[density(a, b).sum() for b in (s0, r0)] for a in (s0, r0)])
    level = np.linalg.solve(f, [density(a, change).sum() for a in (s0, r0)])
    # a share is at least 0: the projected divergence is not, where it nearly vanishes
    change = change - level[0] * s0 - level[1] * r0
    return np.maximum(density(change, change, i0, i1), 0.0)


def difference(scenario, duration_s, seed):
    """
    Return the whitened power of what an effect changes in one record.

    Returns
    -------
    density : (grid,) array
        At each point of the frequency grid.
    times : (TIMES,) array
        In each part of the record.

    """
    records = []
    for each in (NOMINAL, scenario):
        values, index = simulate(each, duration_s, seed)
        whole = np.zeros((int(round(duration_s * RATE_HZ)), 4))
        whole[index] = values
        records.append(whole)
    # as much silence after the record: whitening rings for minutes, not into its start
    samples = len(records[0])
    change = np.fft.rfft(records[1] - records[0], 2 * samples, axis=0)
    f = np.fft.rfftfreq(2 * samples, 1 / RATE_HZ)
    near = np.clip(np.searchsorted(GRID_HZ, f), 0, len(GRID_HZ) - 1)
    root = np.linalg.cholesky(sum(spectrum(NOMINAL)))
    white = np.linalg.solve(root[near], change[:, :, None])[:, :, 0]
    white[f < 0.1] = 0                           # the drift of a free hub
    density = np.bincount(near, np.sum(np.abs(white)**2, axis=1), len(GRID_HZ))
    power = np.sum(np.fft.irfft(white, 2 * samples, axis=0)[:samples]**2, axis=1)
    return density, np.array([part.sum() for part in np.array_split(power, TIMES)])


def _modes(density):
    """Return [frequency_hz, share] of each mode of the nominal spacecraft."""
    hz, damping = frequencies(assemble(NOMINAL))
    inside = np.abs(GRID_HZ[:, None] - hz) <= HALF_POWERS * damping * hz
    nearest = np.argmin(np.abs(GRID_HZ[:, None] - hz), axis=1)
    total = [density[inside[:, k] & (nearest == k)].sum() for k in range(len(hz))]
    return [[round(float(f), 4), round(float(v / density.sum()), 4)] for f, v in zip(hz, total)]


def _shares(values):
    return [round(float(v), 4) for v in np.asarray(values) / np.sum(values)]
