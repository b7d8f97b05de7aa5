# Licensed under the Apache License, Version 2.0.
"""
What drives the spacecraft: loads held over a sample, and what the effects add to them.

Torques and modal forces are white sequences at the record's rate, held; an analogue filter acts on
them by its own frequency response up to half the rate, so that a corner far above changes nothing.
"""
import numpy as np


def input_rms(scenario):
    """Return the rms (inputs + extra,) of each held input before any filter."""
    craft = scenario.craft
    rms = np.array([*craft.torque_rms] + craft.modes * [craft.process_rms])
    rms = rms * (scenario.levels or 1.0)
    return np.append(rms, [extra[3] for extra in scenario.extra_inputs])


def input_responses(scenario, f):
    """Return the frequency response (len(f), inputs + extra) of what colours each input."""
    craft = scenario.craft
    h = np.ones((len(f), craft.inputs + len(scenario.extra_inputs)), dtype=complex)
    for corner, columns in ((craft.torque_corner_hz, slice(0, 3)),
                            (craft.process_corner_hz, slice(3, craft.inputs)),
                            (scenario.corner_hz, slice(0, craft.inputs))):
        if np.isfinite(corner):
            h[:, columns] /= (1 + 1j * f / corner)[:, None]
    for column, response in scenario.filtered_inputs:
        h[:, column] *= response.at(f)
    for k, extra in enumerate(scenario.extra_inputs):
        h[:, craft.inputs + k] = extra[4].at(f)
    return h


def held_loads(scenario, samples, lead, duration_s, rng):
    """
    Return the loads that are held over each sample, (samples, inputs + extra).

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

    """
    craft, rms = scenario.craft, input_rms(scenario)
    u = rng.standard_normal((samples, craft.inputs)) * rms[:craft.inputs]
    own = rng.spawn(1)[0]                        # so that an effect leaves the loads as they are
    if scenario.extra_inputs:
        u = np.hstack([u, own.standard_normal((samples, len(rms) - craft.inputs))
                       * rms[craft.inputs:]])
    h = input_responses(scenario, np.fft.rfftfreq(samples, 1 / craft.rate_hz))
    coloured = np.flatnonzero(np.any(h != 1, axis=0) & (rms > 0))
    if len(coloured):
        u[:, coloured] = np.fft.irfft(np.fft.rfft(u[:, coloured], axis=0) * h[:, coloured],
                                      samples, axis=0)
    time = (np.arange(samples) - lead) / craft.rate_hz
    if scenario.level_modulation:
        depth, period, phase = scenario.level_modulation
        u *= (1 + depth * np.sin(2 * np.pi * time / period + phase))[:, None]
    for column, depth, curve in scenario.modulated_inputs:
        u[:, column] *= 1 + depth * curve.at(time / duration_s)
    for rate, impulse in scenario.pulses:
        # what is in the lead must not differ from the record: the pulses never begin
        count = own.poisson(rate / 60 / craft.rate_hz, samples)
        u[:, 0] += own.choice([-1.0, 1.0], samples) * count * impulse * craft.rate_hz
    for column, points in scenario.marked:
        u[:, column] += points.draw(samples, duration_s * craft.rate_hz, own)
    return u


def smooth_torque(scenario, samples, lead, duration_s, substeps):
    """Return the continuous torque about x_b at every substep, (samples * substeps + 1,) [N m]."""
    rate = scenario.craft.rate_hz
    t = np.arange(samples * substeps + 1) / (rate * substeps) - lead / rate
    torque = np.zeros(len(t))
    for frequency, amplitude, phase in scenario.sines:
        torque += amplitude * np.sin(2 * np.pi * frequency * t + phase)
    for start, end, amplitude, phase in scenario.sweeps:
        # linear chirp over the record, at its first frequency before it
        inside = np.maximum(t, 0.0)
        turns = start * t + (end - start) * inside**2 / (2 * duration_s)
        torque += amplitude * np.sin(2 * np.pi * turns + phase)
    return torque
