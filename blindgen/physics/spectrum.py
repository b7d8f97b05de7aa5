# Licensed under the Apache License, Version 2.0.
"""
Expected spectrum of a record, for the generator's own prediction of what can be detected.

S(f) (c x c) is the power of a bin of the discrete Fourier transform over the number of samples:
its mean over all bins is the covariance of the channels. Exact for the linear scenario at the
samples; the leakage of a finite record is left out.
"""
from dataclasses import fields
from functools import lru_cache

from blindgen.physics.assemble import assemble, Craft
from blindgen.physics.excitation import input_responses, input_rms
from blindgen.physics.propagate import propagators, state_matrices
from blindgen.physics.sensors import channel_responses, mixing, noise_rms
import numpy as np

# A free hub has poles at rest that no eigenvector basis spans; a weak attitude spring separates
# them, below the first bin.
REST = 1e-5                 # of the rate
CHUNK = 8192
KEPT, KEPT_BINS = 24, 4096     # transfers that are remembered, none of more bins: 0.1 GB


def transfer(scenario, f, progress=0.5):
    """Return accelerations per held load G(f), (bins, c, inputs), at nominal frequencies f."""
    craft = assemble(scenario, progress)
    matrices = tuple(getattr(craft, name.name) for name in fields(craft))
    args = (tuple(m.tobytes() for m in matrices), tuple(m.shape for m in matrices), f.tobytes(),
            scenario.craft.rate_hz, scenario.ppm)
    return (_transfer if len(f) <= KEPT_BINS else _transfer.__wrapped__)(*args)


def response(scenario, f):
    """Return what a record shows per held load, (bins, c, inputs), at the sensors' instants."""
    return sensor_chain(scenario, f) @ transfer(scenario, f)


def deflections(scenario, f):
    """
    Return what the local forces of a scenario feel per load, (bins, m, inputs).

    In continuous time, solved at each frequency: the poles at rest of a free hub, which a
    propagator over a step cannot tell apart, do no harm beside a hinge of any stiffness.
    """
    craft, s = assemble(scenario), 2j * np.pi * f[:, None, None]
    dynamic = s**2 * craft.mass + s * craft.damping + craft.stiffness
    return craft.directions[:, 1:].T @ np.linalg.solve(
        dynamic, np.broadcast_to(craft.loads, (len(f), *craft.loads.shape)))


@lru_cache(maxsize=KEPT)
def _transfer(matrices, shapes, f, rate, ppm):
    """Return the transfer of matrices given as bytes: most effects leave them as they are."""
    craft = Craft(*(np.frombuffer(m).reshape(s).copy() for m, s in zip(matrices, shapes)))
    f = np.frombuffer(f)
    for k in range(3):
        craft.stiffness[k, k] += craft.mass[k, k] * (2 * np.pi * REST * rate)**2
    a, b, _, c, d, _ = state_matrices(craft)
    e, p0, p1 = propagators(a, 1 / rate)
    poles, modes = np.linalg.eig(e)
    z = np.exp(2j * np.pi * f / (1 + ppm * 1e-6) / rate)
    right = np.linalg.solve(modes, (p0 + p1) @ b)
    g = ((c @ modes) / (z[:, None, None] - poles)) @ right + d
    g.flags.writeable = False
    return g


def spectrum(scenario, f, share=None):
    """
    Return the parts of S(f) that the loads and the sensors give, each (bins, c, c).

    share : (bins,) array
        What part of all bins each frequency stands for, which jitter needs; equal if left out.
    """
    channels, rate = len(scenario.craft.sensors), scenario.craft.rate_hz
    s = np.empty((len(f), channels, channels), dtype=complex)
    rms = input_rms(scenario)
    for begin in range(0, len(f), CHUNK):        # a transfer of all bins is 0.3 GB
        part = slice(begin, begin + CHUNK)
        g = transfer(scenario, f[part]) * (input_responses(scenario, f[part]) * rms)[:, None, :]
        s[part] = g @ _h(g)
    chain = sensor_chain(scenario, f)
    s = chain @ s @ _h(chain)
    if scenario.jitter_s:
        # jitter of the instant adds white noise of the slope's power, taken from the signal; a
        # scan moves as a whole, so that this noise is as alike in two channels as their slopes
        slope = (2 * np.pi * f * scenario.jitter_s)**2
        lost = np.minimum(slope, 1.0)[:, None, None] * s
        share = np.full(len(f), 1 / len(f)) if share is None else share
        s = s - lost + np.einsum('k,kij->ij', share, lost.real)
    r = np.repeat(np.diag(noise_rms(scenario)**2 + scenario.step**2 / 12)[None], len(f), axis=0)
    for channel, size, constant in scenario.drifts:
        a = np.exp(-1 / (rate * constant))
        r[:, channel, channel] += size**2 * (1 - a * a) / np.abs(
            1 - a * np.exp(-2j * np.pi * f / rate))**2
    return s, r


def sensor_chain(scenario, f):
    """Return what the sensors make of true acceleration, (bins, c, c) complex."""
    before = channel_responses(scenario, f)
    period = 1 / scenario.craft.rate_hz
    before = before * np.exp(2j * np.pi * f[:, None] * period
                             * [s.offset for s in scenario.craft.sensors])
    for channel, delay in scenario.delays:
        before[:, channel] *= np.exp(-2j * np.pi * f * delay)
    return mixing(scenario) * before[:, None, :]


def _h(a):
    return np.conj(np.swapaxes(a, -1, -2))
