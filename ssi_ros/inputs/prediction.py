"""What recorded inputs make of the channels, in time: from rest, and what rings on from before."""
from dataclasses import dataclass, replace

import numpy as np

from ssi_ros.effects.simulate import MARGIN, simulate_setup
from ssi_ros.inputs.expected import sampled_of
from ssi_ros.model.excitation import columns, source, total_covariance, White
from ssi_ros.model.sensors import Mix
from ssi_ros.model.spectrum import gains_of

SETTLED = 8.0           # time constants after which a mode has forgotten how it began
CHUNK = 4000            # rows that enter the normal equations at once
FASTEST_ROWS = 3.0      # time constant of a mode, below which its start does not count


@dataclass(frozen=True, eq=False)
class Played:
    """Recorded values of inputs, held over a row; `before` rows come in front of the first."""

    inputs: tuple
    values: np.ndarray      # (n, m)
    before: int = 0

    name = 'played'

    def begin(self, rate_hz, inputs, generator):
        """Return the forces as a function of first sample and count; none outside the record."""
        where = columns(self.inputs, inputs)

        def forces(first, count):
            out, at = np.zeros((count, len(inputs))), first + np.arange(count) - self.before
            there = (at >= 0) & (at < len(self.values))
            out[np.ix_(there, where)] = self.values[at[there]]
            return out
        return forces

    def covariance(self, rate_hz, inputs):
        """Return the covariance of what is random in it: none, shape (m, m)."""
        return np.zeros((len(inputs), len(inputs)))


def rows_before(setup):
    """Return how many rows are simulated before the first one of a record of a setup."""
    moves = bool(setup.delays_s or setup.corners_hz) or setup.jitter_rms_s > 0.0
    return MARGIN if moves else 0


def played(setup, recorded):
    """Return the setup with the recorded inputs acting beside its own excitation."""
    part = Played(recorded.names, recorded.values, rows_before(setup))
    return replace(setup, system=replace(
        setup.system, excitation=setup.system.excitation + (part,)))


def response(setup, recorded):
    """Return what the inputs make of the channels of a setup, from rest and without noise."""
    setup, _ = recorded.linear(setup)
    system = setup.system
    chain = tuple(s for s in system.chain if isinstance(s, Mix))
    bare = replace(setup, jitter_rms_s=0.0,
                   system=replace(system, excitation=(), chain=chain))
    return simulate_setup(played(bare, recorded), 0, at_rest=True).values


def ringing(setup, recorded, rest):
    """
    Return what a motion from before the record rings on in it, (n, l), most probably.

    `rest`, (n, l), are the channels less the response from rest, NaN where one is missing. The
    state at the first row is estimated by least squares with the prior that inputs of this level
    give it; what is not recorded moves the structure as well, and keeps its share.
    """
    setup, _ = recorded.linear(setup)
    system, sampled = setup.system, sampled_of(setup)
    own, others = _variances(system, sampled, recorded)
    decay = -np.log(np.maximum(np.abs(sampled.poles), 1e-300))
    live = (own > 0.0) & (decay < 1 / FASTEST_ROWS)
    count = min(len(rest), int(SETTLED / decay[live].min())) if live.any() else 0
    out = np.zeros(rest.shape)
    if count < len(sampled.poles):
        return out
    poles, shapes = sampled.poles[live], (gains_of(system) @ sampled.c * sampled.weight)[:, live]
    noise = np.nanvar(np.diff(rest, axis=0), axis=0) / 2 + 1e-300
    n = len(poles)
    inside, pull = np.diag(np.tile(1 / own[live], 2)), np.zeros(2 * n)
    blocks = [slice(b, min(b + CHUNK, count)) for b in range(0, count, CHUNK)]
    for block in blocks:
        turned = poles ** np.arange(block.start, block.stop)[:, None]
        for channel, variance in enumerate(noise):
            basis = _basis(turned * shapes[channel])
            there = np.isfinite(rest[block, channel])
            inside += basis[there].T @ basis[there] / variance
            pull += basis[there].T @ rest[block, channel][there] / variance
    share = np.tile((own[live] / (own + others)[live]), 2)
    state = share * np.linalg.solve(inside, pull)
    for block in blocks:
        turned = poles ** np.arange(block.start, block.stop)[:, None]
        for channel in range(rest.shape[1]):
            out[block, channel] = _basis(turned * shapes[channel]) @ state
    return out


def _basis(turned):
    """Return the real part of complex columns (n, p) as real ones of both parts of a state."""
    return np.hstack([turned.real, -turned.imag])


def _variances(system, sampled, recorded):
    """Return the variance that the inputs, and all else, give every modal state, (p,) each."""
    settles = 1 - np.abs(sampled.poles) ** 2
    power = np.zeros((len(system.inputs),) * 2)
    where = [system.inputs.index(n) for n in recorded.names]
    power[where, where] = np.mean(recorded.values ** 2, axis=0)
    random = tuple(p for p in system.excitation if isinstance(source(p), White))
    return tuple(
        np.einsum('pi,ij,pj->p', sampled.b, q, sampled.b.conj()).real / settles
        if settles.all() else np.zeros(len(settles))
        for q in (power, total_covariance(random, system.rate_hz, system.inputs)))
