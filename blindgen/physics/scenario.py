# Licensed under the Apache License, Version 2.0.
"""
One frozen record says everything that a spacecraft, its loads, its sensors and its clock do.

The defaults are the published spacecraft in nominal state; an effect is a `dataclasses.replace`.
"""
from dataclasses import dataclass
from math import inf

from blindgen.physics.spacecraft import PUBLISHED, Spacecraft


@dataclass(frozen=True)
class Scenario:
    """What one record is made of, SI units; channels and arrays are counted from 0."""

    craft: Spacecraft = PUBLISHED
    # structure
    plate_scale: tuple = ()              # (array, factor on its D)
    damping_scale: float = 1.0
    hub_scale: float = 1.0
    masses: tuple = ()                   # (array, mass_kg, along_m, lateral_m)
    hinge: tuple = ()                    # (array, root bending stiffness [N m/rad])
    slosh: tuple = ()                    # (mass_kg, frequency_hz, damping_ratio, arm_m)
    oscillators: tuple = ()              # (mass_kg, frequency_hz, ratio, array, along, lateral)
    controller: tuple = ()               # (bandwidth_hz, damping_ratio)
    momentum: float = 0.0                # stored along z_b [N m s]
    drift: float = 0.0                   # change of D from the first to the last sample
    modulated: tuple = ()                # (matrix, direction, depth, curve): see assemble.py
    local: tuple = ()                    # (kind, array, parameters): see march.py
    # excitation
    corner_hz: float = inf
    sines: tuple = ()                    # (frequency_hz, torque_n_m, phase_rad)
    sweeps: tuple = ()                   # (start_hz, end_hz, torque_n_m, phase_rad)
    pulses: tuple = ()                   # (rate_per_min, impulse_n_m_s)
    level_modulation: tuple = ()         # (depth, period_s, phase_rad)
    modulated_inputs: tuple = ()         # (input, depth, curve)
    filtered_inputs: tuple = ()          # (input, Response)
    extra_inputs: tuple = ()             # (array, along_m, lateral_m, rms_n, Response)
    marked: tuple = ()                   # (input, Points): a marked point process
    # sensors
    gains: tuple = ()                    # (channel, factor)
    crosstalk: tuple = ()                # (source, channel, gain)
    moved: tuple = ()                    # (channel, along_m, lateral_m)
    noise_scales: tuple = ()             # (channel, factor)
    drifts: tuple = ()                   # (channel, rms_m_s2, time_constant_s)
    low_pass: tuple = ()                 # (channel or 'all', corner_hz)
    delays: tuple = ()                   # (channel, delay_s)
    filtered: tuple = ()                 # (channel, Response)
    curved: tuple = ()                   # (channel, size, coefficients, scale_m_s2)
    modulated_gains: tuple = ()          # (channel, depth, curve)
    spoilt: tuple = ()                   # (Spoiling,): samples that are corrupted
    step: float = 0.0
    limit: float = inf
    # timing
    ppm: float = 0.0
    jitter_s: float = 0.0
    dropped: float = 0.0
    gaps: tuple = ()                     # (first, last) share of the record that is missing
    # nuisances, of every record
    levels: tuple = ()                   # factor of each input: three torques, the modal forces
    noise_level: float = 1.0
    warmth: float = 0.0                  # change of D of all arrays with the mean temperature
    warming: float = 0.0                 # and over the record, linear, its mean taken off
