# Licensed under the Apache License, Version 2.0.
"""
What drives the spacecraft: white loads held over a sample, and what the effects add to them.

The torque and the process noise are white sequences at 100 Hz, held; an analogue filter acts on
them by its own frequency response up to 50 Hz, so that a corner far above changes nothing.
"""
from blindgen.scenario import PROCESS_RMS, RATE_HZ, TORQUE_RMS
import numpy as np


def held_loads(scenario, samples, lead, duration_s, rng):
    """
    Return the loads that are held over each sample.

    Parameters
    ----------
    scenario : Scenario
        What drives the spacecraft.
    samples : int
        How many, lead and tail included.
    lead : int
        Samples before the record begins; its time is zero at sample `lead`.
    duration_s : float
        Length of the record [s].
    rng : numpy.random.Generator
        Of the loads.

    Returns
    -------
    (samples, 22) array
        Torque about x_b, about y_b [N m] and 20 modal forces.

    """
    rms = np.array([TORQUE_RMS, scenario.second_torque] + 20 * [PROCESS_RMS])
    u = rng.standard_normal((samples, 22)) * rms
    if np.isfinite(scenario.corner_hz):
        f = np.fft.rfftfreq(samples, 1 / RATE_HZ)
        u = np.fft.irfft(np.fft.rfft(u, axis=0) / (1 + 1j * f / scenario.corner_hz)[:, None],
                         samples, axis=0)
    time = (np.arange(samples) - lead) / RATE_HZ
    if scenario.swing:
        depth, period, phase = scenario.swing
        u *= (1 + depth * np.sin(2 * np.pi * time / period + phase))[:, None]
    u *= scenario.level
    for rate, impulse in scenario.pulses:
        # What is in the lead must not differ from the record: the pulses never begin.
        count = rng.poisson(rate / 60 / RATE_HZ, samples)
        sign = rng.choice([-1.0, 1.0], samples)
        u[:, 0] += sign * count * impulse * RATE_HZ
    if scenario.telegraph:
        torque, switches = scenario.telegraph
        flips = rng.random(samples) < switches / RATE_HZ
        u[:, 0] += torque * np.where(np.cumsum(flips) % 2, 1.0, -1.0)
    return u


def smooth_torque(scenario, samples, lead, duration_s, substeps):
    """Return the continuous torque about x_b at every substep, (samples * substeps + 1,) [N m]."""
    t = np.arange(samples * substeps + 1) / (RATE_HZ * substeps) - lead / RATE_HZ
    torque = np.zeros(len(t))
    for frequency, amplitude, phase in scenario.sines:
        torque += amplitude * np.sin(2 * np.pi * frequency * t + phase)
    for start, end, amplitude, phase in scenario.sweeps:
        # linear chirp over the record, at its first frequency before it
        inside = np.maximum(t, 0.0)
        turns = start * t + (end - start) * inside**2 / (2 * duration_s)
        torque += amplitude * np.sin(2 * np.pi * turns + phase)
    return torque
