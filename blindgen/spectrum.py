# Licensed under the Apache License, Version 2.0.
"""
Expected spectrum of a record, for the generator's own prediction of what can be detected.

S(f) (4 x 4) is the power of a bin of the discrete Fourier transform over the number of samples:
its mean over all bins is the covariance of the channels. Exact for the linear scenario at the
samples; the leakage of a finite record is left out, a prediction needs no more.
"""
from blindgen.craft import assemble, propagators, state_matrices
from blindgen.scenario import NOISE_RMS, PROCESS_RMS, RATE_HZ, TORQUE_RMS
import numpy as np

# Bins of 600 s below 4 Hz, where a resonance is a few bins wide; every sixth above.
GRID_HZ = np.concatenate([np.arange(1, 2400) / 600, np.arange(400, 5000) / 100 + 0.001])
GRID_BINS = np.concatenate([np.ones(2399), np.full(4600, 6.0)])
# A free hub has poles at rest that no eigenvector basis spans; 1 mHz of attitude spring parts
# them and is below the first bin.
REST_HZ = 1e-3
CHUNK = 8192


def transfer(scenario, f=GRID_HZ, progress=0.5):
    """Return accelerations per held load G(f), (bins, 4, 22), at nominal frequencies f."""
    craft = assemble(scenario, progress)
    for k in range(3):
        craft.stiffness[k, k] += craft.mass[k, k] * (2 * np.pi * REST_HZ)**2
    a, b, _, c, d, _ = state_matrices(craft)
    e, p0, p1 = propagators(a, 1 / RATE_HZ)
    poles, modes = np.linalg.eig(e)
    z = np.exp(2j * np.pi * f / (1 + scenario.ppm * 1e-6) / RATE_HZ)
    right = np.linalg.solve(modes, (p0 + p1) @ b)
    return ((c @ modes) / (z[:, None, None] - poles)) @ right + d


def spectrum(scenario, f=GRID_HZ):
    """Return the parts of S(f) that the loads and the sensors give, each (bins, 4, 4)."""
    power = np.array([TORQUE_RMS, scenario.second_torque] + 20 * [PROCESS_RMS])**2
    weight = np.repeat((power * scenario.level**2)[None], len(f), axis=0)
    weight /= (1 + (f / scenario.corner_hz)**2)[:, None]
    if scenario.telegraph:
        torque, rate = scenario.telegraph
        a = 1 - 2 * rate / RATE_HZ                # correlation of neighbouring samples
        z = np.exp(2j * np.pi * f / RATE_HZ)
        weight[:, 0] += torque**2 * (1 - a * a) / np.abs(1 - a / z)**2
    s = np.empty((len(f), 4, 4), dtype=complex)
    for begin in range(0, len(f), CHUNK):        # a transfer of all bins is 0.3 GB
        part = slice(begin, begin + CHUNK)
        g = transfer(scenario, f[part])
        s[part] = (g * weight[part, None, :]) @ _h(g)
    chain = sensor_chain(scenario, f)
    s = chain @ s @ _h(chain)
    if scenario.jitter_s:
        # a wandering instant adds white noise of the slope's power and takes it from the signal
        slope = (2 * np.pi * f * scenario.jitter_s)**2
        lost = np.minimum(slope, 1.0)[:, None, None] * s
        white = np.einsum('k,kii->i', _share(f), lost.real)
        s = s - lost + np.diag(white)
    noise = (NOISE_RMS * scenario.noise_level * np.array(scenario.noise_scales))**2
    r = np.repeat(np.diag(noise + scenario.step**2 / 12)[None], len(f), axis=0)
    for channel, rms, constant in scenario.drifts:
        a = np.exp(-1 / (RATE_HZ * constant))
        r[:, channel, channel] += rms**2 * (1 - a * a) / np.abs(
            1 - a * np.exp(-2j * np.pi * f / RATE_HZ))**2
    return s, r


def sensor_chain(scenario, f):
    """Return what the sensors make of true acceleration, (bins, 4, 4) complex."""
    chain = np.repeat(np.diag(scenario.gains)[None].astype(complex), len(f), axis=0)
    for source, channel, gain in scenario.crosstalk:
        chain[:, channel, source] += gain
    before = np.ones((len(f), 4), dtype=complex)
    for channel, corner in scenario.low_pass:
        s = 1j * f / corner
        columns = slice(None) if channel == 'all' else [channel]
        before[:, columns] /= (1 + np.sqrt(2) * s + s * s)[:, None]
    for channel, delay in scenario.delays:
        before[:, channel] *= np.exp(-2j * np.pi * f * delay)
    return chain * before[:, None, :]


def _share(f):
    """Return what share of all bins each point of the grid stands for."""
    if f is not GRID_HZ:
        return np.full(len(f), 1 / len(f))
    return GRID_BINS / GRID_BINS.sum()


def _h(a):
    return np.conj(np.swapaxes(a, -1, -2))
