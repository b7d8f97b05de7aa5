"""
Simulate a linear system exactly: excitation -> propagation -> sensor chain.

Inputs are held over a sample, so the recurrence of eq. (21) is exact whatever the rate. Each
modal coordinate is a first-order recurrence of its own, which `scipy.signal.lfilter` runs.
"""
from dataclasses import replace

import numpy as np

from ssi_ros.model.excitation import (
    begin_all, colour_of, generator, has_colour, total_covariance)
from ssi_ros.model.machines import is_machine, Machine
from ssi_ros.model.system import natural_modes
from ssi_ros.records import Samples

ROUNDING = 1e-17    # of the largest variance: what is below is not excited
BLOCK_S = 20.0      # of `simulate`: long enough for the vector units, short enough for the cache


def simulate(system, duration_s, seed, *, excitation=None, at_rest=False, rate_hz=None,
             start_ns=0, progress=None):
    """
    Simulate a record.

    Parameters
    ----------
    system : System
        What to simulate, with its excitation, sensor chain and rate.
    duration_s : float
        Length of the record [s], at least one sample.
    seed : int
        The same seed gives the same numbers, bit for bit.
    excitation : tuple, optional
        Parts that act in place of the system's own.
    at_rest : bool
        Start at rest in place of the stationary state.
    rate_hz : float, optional
        Sampling rate in place of the system's own [Hz].
    start_ns : int
        Stamp of the first sample [ns].
    progress : callable, optional
        Called with the share done, 0 to 1, block after block.

    Returns
    -------
    Samples

    Raises
    ------
    ValueError
        If the duration is shorter than a sample, or the rate aliases a mode.

    """
    rate_hz = system.rate_hz if rate_hz is None else rate_hz
    count = int(round(duration_s * rate_hz)) if np.isfinite(duration_s) else 0
    if count < 1:
        raise ValueError(f'duration_s={duration_s:g} must be a finite time of at least one sample '
                         f'({1 / rate_hz:g} s)')
    blocks = stream(system, seed, min(BLOCK_S, count / rate_hz), excitation=excitation,
                    at_rest=at_rest, rate_hz=rate_hz, start_ns=start_ns)
    values = np.empty((count, len(system.channels)))
    done = 0
    for block in blocks:
        rows = block.values[:count - done]
        values[done:done + len(rows)] = rows
        done += len(rows)
        if progress is not None:
            progress(done / count)
        if done == count:
            break
    return Samples(values, rate_hz, system.channels, start_ns)


def stream(system, seed, block_s=1.0, *, excitation=None, at_rest=False, rate_hz=None,
           start_ns=0):
    """
    Simulate without end, block after block; the numbers are those of `simulate`.

    Parameters
    ----------
    system, seed, excitation, at_rest, rate_hz, start_ns
        As in `simulate`.
    block_s : float
        Length of a block [s], rounded to whole samples.

    Yields
    ------
    Samples

    """
    rate_hz = system.rate_hz if rate_hz is None else rate_hz
    check_rate(system, rate_hz)
    count = int(round(block_s * rate_hz))
    if count < 1:
        raise ValueError(f'block_s={block_s:g} must be at least one sample ({1 / rate_hz:g} s)')
    parts = system.excitation if excitation is None else tuple(excitation)
    return _blocks(system, system.state_space.discrete(rate_hz), parts, seed, count, at_rest,
                   start_ns)


def ensemble(system, duration_s, seeds, **options):
    """Simulate one record a seed; what they share is computed once. Yields `Samples`."""
    for seed in seeds:
        yield simulate(system, duration_s, seed, **options)


def check_rate(system, rate_hz):
    """Check that no mode lies above half of the rate, ValueError with its alias if one does."""
    modes = natural_modes(system)
    live = modes.frequencies_hz[modes.damping_ratios < 0.2]
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise ValueError(f'rate_hz={rate_hz:g} must be a positive number [Hz]')
    above = live[live >= rate_hz / 2]
    # errors of a mode that no recording shows may be anything: at the rate of the recordings it
    # is simulated at its alias, as it was fitted
    if len(above) and not (system.fitted and rate_hz == system.rate_hz):
        worst = above[-1]
        alias = abs(worst - rate_hz * round(worst / rate_hz))
        raise ValueError(
            f'rate_hz={rate_hz:g} is too low: {len(above)} modes lie above half of it, and the '
            f'one at {worst:.3f} Hz would appear at {alias:.3f} Hz; raise rate_hz above '
            f'{2 * worst:.1f} or keep fewer modes')


def _blocks(system, sampled, parts, seed, count, at_rest, start_ns):
    rate_hz, first = sampled.rate_hz, 0
    machines = [Machine(p, system.state_space, system.inputs, rate_hz)
                for p in parts if is_machine(p)]
    parts = [p for p in parts if not is_machine(p)]
    forces = begin_all(parts, rate_hz, system.inputs, seed)
    stages = [s.begin(rate_hz, generator(seed, s.name)) for s in system.chain]
    z = np.zeros(len(sampled.poles), complex)
    if not at_rest:
        z = sum((m.state for m in machines),
                stationary_start(sampled, parts, system.inputs, seed))
    while True:
        values, z = propagate(sampled, forces(first, count), z,
                              [m.at(first, count) for m in machines])
        for stage in stages:
            values = stage(values)
        yield Samples(values, rate_hz, system.channels,
                      start_ns + round(first * 1e9 / rate_hz))
        first += count


def stationary_start(sampled, parts, inputs, seed):
    """
    Draw the modal state of a system that has been excited for ever, eq. (23).

    Random parts give a Gaussian state of the stationary covariance; a sine gives its steady
    response, a nutation goes on; what happens at set times has not happened yet.
    """
    covariance = sampled.state_covariance(total_covariance(
        [p for p in parts if not has_colour(p)], sampled.rate_hz, inputs))
    at_hz = np.abs(np.angle(sampled.poles)) * sampled.rate_hz / (2 * np.pi)
    for part in filter(has_colour, parts):
        # each mode is excited as much less as the colours have power at its frequency
        less = replace(sampled, b=sampled.b * np.sqrt(colour_of(part, at_hz))[:, None])
        covariance += less.state_covariance(part.covariance(sampled.rate_hz, inputs))
    power = np.diag(covariance)
    # a mode that nothing excites has only rounding in its row: it starts at rest
    size = np.sqrt(np.where(power > ROUNDING * power.max(initial=0.0), power, 0.0))
    scale = np.where(size > 0.0, size, np.inf)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    draw = generator(seed, 'initial_state').standard_normal(len(values))
    # the symmetric root: eigenvectors have no sign of their own, so any other root would give
    # another start with another linear algebra library
    root = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    z = sampled.inverse @ (size * (root @ draw))
    for part in parts:
        if hasattr(part, 'phasor'):
            z = z + _steady(sampled, *part.phasor(inputs))
        if hasattr(part, 'state'):
            z = z + part.state(sampled, inputs)
    return z


def _steady(sampled, amplitudes, omega):
    """Return the state at t = 0 of the steady response to Im(amplitudes exp(j omega t))."""
    turn = np.exp(1j * omega / sampled.rate_hz)
    ahead = (sampled.b @ amplitudes) / (turn - sampled.poles)
    back = (sampled.b @ amplitudes.conj()) / (turn.conj() - sampled.poles)
    return (ahead - back) / 2j


def propagate(sampled, forces, z, machines=()):
    """
    Run the recurrence z(k+1) = poles z(k) + b u(k) over a block, eq. (21).

    Parameters
    ----------
    sampled : Sampled
        The system.
    forces : ndarray, shape (n, m)
        Inputs u.
    z : ndarray, shape (states,), complex
        Modal state at the first sample.
    machines : sequence of (ndarray, ndarray)
        What others add to the modal states (states, n) and to the channels (n, l), `Machine.at`.

    Returns
    -------
    values : ndarray, shape (n, l)
        Outputs y.
    z : ndarray, shape (states,), complex
        Modal state at the sample after the last.

    """
    # takes half a second, and few commands simulate
    from scipy.signal import lfilter
    # Inputs that nothing drives cost nothing.
    live = forces.any(axis=0)
    driven = forces[:, live]
    drive = np.empty((len(z), len(forces)), complex)
    drive.real = sampled.b.real[:, live] @ driven.T
    drive.imag = sampled.b.imag[:, live] @ driven.T
    for of_states, _ in machines:
        drive += of_states
    states = np.empty((len(z), len(forces) + 1), complex)
    states[:, 0] = z
    for i, pole in enumerate(sampled.poles):
        states[i, 1:], _ = lfilter([1.0], [1.0, -pole], drive[i], zi=[pole * z[i]])
    c = sampled.c * sampled.weight
    values = (c.real @ states.real[:, :-1] - c.imag @ states.imag[:, :-1]).T
    values += driven @ sampled.d[:, live].T
    return sum((direct for _, direct in machines), values), states[:, -1]
