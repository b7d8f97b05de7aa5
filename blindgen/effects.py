# Licensed under the Apache License, Version 2.0.
"""
The thirty effects of the library, as this generator understands their definitions.

An effect draws what is free (channel, array, sign, frequencies), turns one size m > 0 into its
parameters, and applies them to a scenario. m is small for a weak effect; its range bounds what a
case may use. `predict` says how detect.py tells its detectability.
"""
from dataclasses import dataclass, replace
from typing import Callable

from blindgen.scenario import ARRAYS, CHANNELS, SENSOR_LATERAL_M
import numpy as np

EFFECTS = {}
ROOT_MOMENT_RMS = 0.21      # [N m] at a root under the nominal loads; a test computes it


@dataclass(frozen=True)
class Effect:
    """One effect: its name and site, how it is drawn, sized and applied."""

    name: str
    site: str
    low: float
    high: float
    draw: Callable
    size: Callable
    apply: Callable
    predict: str = 'spectrum'
    library: bool = True


def declare(name, site, low, high, draw, size, predict='spectrum', library=True):
    """Register the decorated function, which applies the parameters to a scenario."""
    def keep(apply):
        EFFECTS[name] = Effect(name, site, low, high, draw, size, apply, predict, library)
        return apply
    return keep


def sign(rng):
    """Return -1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


def log_uniform(rng, low, high):
    """Return a number between two bounds, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def with_item(values, index, value):
    """Return a tuple with one item replaced."""
    return (*values[:index], value, *values[index + 1:])


def an_array(rng):
    """Draw an array and a sign."""
    return {'array': str(rng.choice(ARRAYS)), 'sign': sign(rng)}


def a_channel(rng):
    """Draw a channel and a sign."""
    return {'channel': str(rng.choice(CHANNELS)), 'sign': sign(rng)}


def nothing(rng):
    """Draw a sign alone."""
    return {'sign': sign(rng)}


def scaled(v, m):
    """Return the parameter `scale`: m above or below one, never negative."""
    return {'scale': 1 + m if v['sign'] > 0 else 1 / (1 + m)}


def scaled_array(v, m):
    """Return `array` and `scale`."""
    return {'array': v['array'], **scaled(v, m)}


def scaled_channel(v, m):
    """Return `channel` and `scale`."""
    return {'channel': v['channel'], **scaled(v, m)}


# Excitation -----------------------------------------------------------------------------------
@declare('excitation_colour', 'excitation', 1e-4, 1.0, nothing, lambda v, m: {'corner_hz': 1 / m})
def _(s, p):
    return replace(s, corner_hz=p['corner_hz'])


@declare('harmonic_disturbance', 'excitation', 1e-6, 1.0,
         lambda rng: {'f': log_uniform(rng, 0.3, 40), 'phase': rng.uniform(0, 2 * np.pi)},
         lambda v, m: {'frequency_hz': v['f'], 'torque_n_m': m, 'phase_rad': v['phase']},
         'mean')
def _(s, p):
    return replace(s, sines=(*s.sines, (p['frequency_hz'], p['torque_n_m'], p['phase_rad'])))


@declare('wheel_speed_sweep', 'excitation', 1e-6, 1.0,
         lambda rng: {'f': rng.permutation([log_uniform(rng, 1, 8), log_uniform(rng, 10, 40)]),
                      'phase': rng.uniform(0, 2 * np.pi)},
         lambda v, m: {'start_hz': float(v['f'][0]), 'end_hz': float(v['f'][1]), 'torque_n_m': m,
                       'phase_rad': v['phase']}, 'mean')
def _(s, p):
    return replace(s, sweeps=(*s.sweeps, (p['start_hz'], p['end_hz'], p['torque_n_m'],
                                          p['phase_rad'])))


@declare('impulsive_events', 'excitation', 1e-6, 10.0,
         lambda rng: {'rate': log_uniform(rng, 1, 20)},
         lambda v, m: {'rate_per_min': v['rate'], 'impulse_n_m_s': m}, 'mean')
def _(s, p):
    return replace(s, pulses=(*s.pulses, (p['rate_per_min'], p['impulse_n_m_s'])))


@declare('nonstationary_excitation', 'excitation', 1e-4, 0.9,
         lambda rng: {'period': log_uniform(rng, 20, 300), 'phase': rng.uniform(0, 2 * np.pi)},
         lambda v, m: {'depth': m, 'period_s': v['period'], 'phase_rad': v['phase']}, 'swing')
def _(s, p):
    return replace(s, swing=(p['depth'], p['period_s'], p['phase_rad']))


# Structure ------------------------------------------------------------------------------------
@declare('stiffness_scale', 'structure', 1e-6, 1.0, nothing, scaled)
def _(s, p):
    return replace(s, plate_scale=tuple(v * p['scale'] for v in s.plate_scale))


@declare('array_asymmetry', 'structure', 1e-6, 1.0, an_array, scaled_array)
def _(s, p):
    i = ARRAYS.index(p['array'])
    return replace(s, plate_scale=with_item(s.plate_scale, i, s.plate_scale[i] * p['scale']))


@declare('damping_scale', 'structure', 1e-4, 10.0, nothing, scaled)
def _(s, p):
    return replace(s, damping_scale=s.damping_scale * p['scale'])


@declare('hub_inertia', 'structure', 1e-4, 4.0, nothing, scaled)
def _(s, p):
    return replace(s, hub_scale=s.hub_scale * p['scale'])


@declare('added_mass', 'structure', 1e-5, 10.0,
         lambda rng: {**an_array(rng), 'along': rng.uniform(3, 8), 'lateral': rng.uniform(-1, 1)},
         lambda v, m: {'array': v['array'], 'mass_kg': m, 'along_m': v['along'],
                       'lateral_m': v['lateral']})
def _(s, p):
    mass = (ARRAYS.index(p['array']), p['mass_kg'], p['along_m'], p['lateral_m'])
    return replace(s, masses=(*s.masses, mass))


def _hinged(s, array, stiffness, *local):
    """Put a hinge at the root of an array, with local forces (law, values) in it."""
    i = ARRAYS.index(array)
    if np.isfinite(s.hinge[i]):
        raise ValueError(f'array {array} has a hinge already; put the second effect elsewhere')
    forces = tuple((kind, i, {'at': 'hinge', 'values': values}) for kind, values in local)
    return replace(s, hinge=with_item(s.hinge, i, stiffness), local=s.local + forces)


def hinge_parameters(v, m, share):
    """Return `array` and `stiffness_n_m_rad`, of the total compliance m [rad/(N m)] a share."""
    return {'array': v['array'], 'stiffness_n_m_rad': 1 / (share * m)}


@declare('hinge_compliance', 'structure', 1e-10, 1e-3, an_array,
         lambda v, m: hinge_parameters(v, m, 1.0))
def _(s, p):
    return _hinged(s, p['array'], p['stiffness_n_m_rad'])


@declare('hinge_freeplay', 'structure', 1e-9, 1e-3, an_array,
         lambda v, m: {**hinge_parameters(v, m, 0.4), 'gap_rad': 0.6 * m * ROOT_MOMENT_RMS},
         'simulated')
def _(s, p):
    return _hinged(s, p['array'], p['stiffness_n_m_rad'],
                   ('freeplay', (p['stiffness_n_m_rad'], p['gap_rad'])))


@declare('hinge_friction', 'structure', 1e-9, 1e-3,
         lambda rng: {**an_array(rng), 'ratio': rng.uniform(0.3, 1.2)},
         lambda v, m: {**hinge_parameters(v, m, 1.0), 'torque_n_m': v['ratio'] * ROOT_MOMENT_RMS},
         'simulated')
def _(s, p):
    return _hinged(s, p['array'], p['stiffness_n_m_rad'], ('friction', (p['torque_n_m'],)))


@declare('cubic_stiffness', 'structure', 1e-9, 1e-3,
         lambda rng: {**an_array(rng), 'ratio': log_uniform(rng, 0.3, 3)},
         lambda v, m: {**hinge_parameters(v, m, 1.0),
                       'k3_n_m_rad3': v['ratio'] / (m * (m * ROOT_MOMENT_RMS)**2)}, 'simulated')
def _(s, p):
    return _hinged(s, p['array'], p['stiffness_n_m_rad'], ('cubic', (p['k3_n_m_rad3'],)))


@declare('stiffness_drift', 'structure', 1e-6, 0.8, nothing,
         lambda v, m: {'change': scaled(v, m)['scale'] - 1}, 'drift')
def _(s, p):
    return replace(s, drift=p['change'])


@declare('fuel_slosh', 'structure', 1e-4, 200.0,
         lambda rng: {'f': log_uniform(rng, 0.3, 8), 'z': log_uniform(rng, 0.005, 0.05),
                      'arm': rng.uniform(0.4, 1.0)},
         lambda v, m: {'mass_kg': m, 'frequency_hz': v['f'], 'damping_ratio': v['z'],
                       'arm_m': v['arm']})
def _(s, p):
    return replace(s, slosh=(*s.slosh, (p['mass_kg'], p['frequency_hz'], p['damping_ratio'],
                                        p['arm_m'])))


@declare('attitude_controller', 'structure', 1e-5, 0.3,
         lambda rng: {'z': rng.uniform(0.5, 1.0)},
         lambda v, m: {'bandwidth_hz': m, 'damping_ratio': v['z']})
def _(s, p):
    return replace(s, controller=(p['bandwidth_hz'], p['damping_ratio']))


@declare('gyroscopic_coupling', 'structure', 1e-2, 1e4, nothing,
         lambda v, m: {'momentum_n_m_s': v['sign'] * m})
def _(s, p):
    return replace(s, momentum=p['momentum_n_m_s'])


# Sensors --------------------------------------------------------------------------------------
@declare('sensor_gain', 'sensor', 1e-6, 1.0, a_channel, scaled_channel)
def _(s, p):
    i = CHANNELS.index(p['channel'])
    return replace(s, gains=with_item(s.gains, i, s.gains[i] * p['scale']))


@declare('sensor_crosstalk', 'sensor', 1e-6, 1.0,
         lambda rng: dict(zip(('source', 'channel'), map(str, rng.permutation(CHANNELS)[:2])),
                          sign=sign(rng)),
         lambda v, m: {'source': v['source'], 'channel': v['channel'], 'gain': v['sign'] * m})
def _(s, p):
    pair = (CHANNELS.index(p['source']), CHANNELS.index(p['channel']), p['gain'])
    return replace(s, crosstalk=(*s.crosstalk, pair))


def _inward(v, m):
    """Return a move towards the root and the middle: outward the array soon ends."""
    side = np.sign(SENSOR_LATERAL_M[CHANNELS.index(v['channel'])])
    return {'channel': v['channel'], 'along_m': -m * np.cos(v['angle']),
            'lateral_m': -side * m * np.sin(v['angle'])}


@declare('sensor_misplacement', 'sensor', 1e-6, 1.8,
         lambda rng: {**a_channel(rng), 'angle': rng.uniform(0, np.pi / 2)}, _inward)
def _(s, p):
    return replace(s, moved=(*s.moved, (CHANNELS.index(p['channel']), p['along_m'],
                                        p['lateral_m'])))


@declare('sensor_noise', 'sensor', 1e-4, 100.0, a_channel, scaled_channel)
def _(s, p):
    i = CHANNELS.index(p['channel'])
    return replace(s, noise_scales=with_item(s.noise_scales, i, s.noise_scales[i] * p['scale']))


@declare('sensor_drift', 'sensor', 1e-6, 1.0,
         lambda rng: {**a_channel(rng), 'tau': log_uniform(rng, 0.3, 30)},
         lambda v, m: {'channel': v['channel'], 'rms_m_s2': m, 'time_constant_s': v['tau']})
def _(s, p):
    return replace(s, drifts=(*s.drifts, (CHANNELS.index(p['channel']), p['rms_m_s2'],
                                          p['time_constant_s'])))


@declare('quantisation', 'sensor', 1e-6, 0.1, nothing, lambda v, m: {'step_m_s2': m}, 'rounding')
def _(s, p):
    return replace(s, step=p['step_m_s2'])


@declare('saturation', 'sensor', 1.0, 200.0, nothing, lambda v, m: {'limit_m_s2': 1 / m},
         'rails')
def _(s, p):
    return replace(s, limit=p['limit_m_s2'])


@declare('sensor_bandwidth', 'sensor', 1e-4, 0.5,
         lambda rng: {'channel': str(rng.choice([*CHANNELS, 'all']))},
         lambda v, m: {'channel': v['channel'], 'corner_hz': 1 / m})
def _(s, p):
    channel = 'all' if p['channel'] == 'all' else CHANNELS.index(p['channel'])
    return replace(s, low_pass=(*s.low_pass, (channel, p['corner_hz'])))


@declare('channel_delay', 'sensor', 1e-7, 0.02, a_channel,
         lambda v, m: {'channel': v['channel'], 'delay_s': m})
def _(s, p):
    return replace(s, delays=(*s.delays, (CHANNELS.index(p['channel']), p['delay_s'])))


# Timing ---------------------------------------------------------------------------------------
@declare('clock_rate', 'timing', 0.1, 2e4, nothing, lambda v, m: {'ppm': v['sign'] * m})
def _(s, p):
    return replace(s, ppm=p['ppm'])


@declare('timestamp_jitter', 'timing', 1e-6, 4e-3, nothing, lambda v, m: {'rms_s': m})
def _(s, p):
    return replace(s, jitter_s=p['rms_s'])


@declare('dropped_samples', 'timing', 1e-6, 0.3, nothing, lambda v, m: {'fraction': m}, 'count')
def _(s, p):
    return replace(s, dropped=p['fraction'])
