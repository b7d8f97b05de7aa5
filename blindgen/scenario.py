# Licensed under the Apache License, Version 2.0.
"""
One frozen record says everything that a spacecraft, its loads, its sensors and its clock do.

The default of every field is the nominal spacecraft; an effect is a `dataclasses.replace`.
Channels are numbered 0-3 (e1_a, e1_b, e2_a, e2_b), arrays 0-1 (E1, E2).
"""
from dataclasses import dataclass
from math import inf

CHANNELS = ('e1_a', 'e1_b', 'e2_a', 'e2_b')
ARRAYS = ('E1', 'E2')
RATE_HZ = 100.0
SENSOR_ALONG_M = (7.9, 7.9, 7.9, 7.9)
SENSOR_LATERAL_M = (0.9, -0.9, 0.9, -0.9)
SENSOR_ARRAY = (0, 0, 1, 1)
TORQUE_RMS = 0.1          # [N m] about x_b, white, held over a sample
PROCESS_RMS = 0.005       # generalised force on every nominal modal coordinate, white, held
NOISE_RMS = 3e-4          # [m/s^2] of each channel


@dataclass(frozen=True)
class Scenario:
    """What one record is made of, SI units; the defaults are the nominal spacecraft."""

    # structure
    own_mesh: bool = False               # frequencies of our mesh, not of the ground test
    plate_scale: tuple = (1.0, 1.0)      # D of each array over nominal
    damping_scale: float = 1.0
    hub_scale: float = 1.0
    masses: tuple = ()                   # (array, mass_kg, along_m, lateral_m)
    hinge: tuple = (inf, inf)            # root bending stiffness of each array [N m/rad]
    slosh: tuple = ()                    # (mass_kg, frequency_hz, damping_ratio, arm_m)
    controller: tuple = ()               # (bandwidth_hz, damping_ratio)
    momentum: float = 0.0                # stored along z_b [N m s]
    drift: float = 0.0                   # change of D from the first to the last sample
    rotation_rad: float = 0.0            # arrays turn about y_b from 0 to this over the record
    local: tuple = ()                    # (kind, array, parameters): see march.py
    # excitation
    corner_hz: float = inf
    sines: tuple = ()                    # (frequency_hz, torque_n_m, phase_rad)
    sweeps: tuple = ()                   # (start_hz, end_hz, torque_n_m, phase_rad)
    pulses: tuple = ()                   # (rate_per_min, impulse_n_m_s)
    swing: tuple = ()                    # (depth, period_s, phase_rad)
    second_torque: float = 0.0           # [N m] rms about y_b
    telegraph: tuple = ()                # (torque_n_m, switches_per_s)
    # sensors
    gains: tuple = (1.0, 1.0, 1.0, 1.0)
    crosstalk: tuple = ()                # (source, channel, gain)
    moved: tuple = ()                    # (channel, along_m, lateral_m)
    noise_scales: tuple = (1.0, 1.0, 1.0, 1.0)
    drifts: tuple = ()                   # (channel, rms_m_s2, time_constant_s)
    low_pass: tuple = ()                 # (channel or 'all', corner_hz)
    delays: tuple = ()                   # (channel, delay_s)
    gain_wander: tuple = ()              # (channel, rms, time_constant_s)
    spikes: tuple = ()                   # (rate_per_min, size_m_s2)
    step: float = 0.0
    limit: float = inf
    # timing
    ppm: float = 0.0
    jitter_s: float = 0.0
    dropped: float = 0.0
    # nuisances, on every record
    level: float = 1.0
    noise_level: float = 1.0
