# Licensed under the Apache License, Version 2.0.
"""The library's effects of excitation and structure, as this generator reads their definitions."""
from dataclasses import replace

from blindgen.effects.base import (an_array, declare, log_uniform, mode_range, motion_rms, nothing,
                                   scaled, scaled_array)
import numpy as np


# Excitation -----------------------------------------------------------------------------------
@declare('excitation_colour', 'excitation', 1e-6, 10.0, nothing,
         lambda v, m: {'corner_hz': 1 / m})
def _(s, p):
    return replace(s, corner_hz=p['corner_hz'])


@declare('harmonic_disturbance', 'excitation', 1e-8, 1e2,
         lambda rng, craft, t: {'f': log_uniform(rng, *_driven(craft)),
                                'phase': rng.uniform(0, 2 * np.pi)},
         lambda v, m: {'frequency_hz': v['f'], 'torque_n_m': m, 'phase_rad': v['phase']},
         'mean')
def _(s, p):
    return replace(s, sines=(*s.sines, (p['frequency_hz'], p['torque_n_m'], p['phase_rad'])))


def _driven(craft):
    """Return the band of disturbances: from under the lowest to over the highest mode."""
    low, high = mode_range(craft)
    return 0.8 * low, min(1.2 * high, 0.42 * craft.rate_hz)


def _sweep(rng, craft, t):
    low, high = _driven(craft)
    middle = np.sqrt(low * high)
    ends = [log_uniform(rng, low, 0.9 * middle), log_uniform(rng, 1.1 * middle, high)]
    return {'f': [float(f) for f in rng.permutation(ends)], 'phase': rng.uniform(0, 2 * np.pi)}


@declare('wheel_speed_sweep', 'excitation', 1e-8, 1e2, _sweep,
         lambda v, m: {'start_hz': v['f'][0], 'end_hz': v['f'][1], 'torque_n_m': m,
                       'phase_rad': v['phase']}, 'mean')
def _(s, p):
    return replace(s, sweeps=(*s.sweeps, (p['start_hz'], p['end_hz'], p['torque_n_m'],
                                          p['phase_rad'])))


@declare('impulsive_events', 'excitation', 1e-8, 1e2,
         lambda rng, craft, t: {'rate': log_uniform(rng, 10, 200) * 60 / t},
         lambda v, m: {'rate_per_min': v['rate'], 'impulse_n_m_s': m}, 'mean')
def _(s, p):
    return replace(s, pulses=(*s.pulses, (p['rate_per_min'], p['impulse_n_m_s'])))


@declare('nonstationary_excitation', 'excitation', 1e-4, 0.9,
         lambda rng, craft, t: {'period': log_uniform(rng, t / 25, t / 2),
                                'phase': rng.uniform(0, 2 * np.pi)},
         lambda v, m: {'depth': m, 'period_s': v['period'], 'phase_rad': v['phase']}, 'level')
def _(s, p):
    return replace(s, level_modulation=(p['depth'], p['period_s'], p['phase_rad']))


# Structure ------------------------------------------------------------------------------------
@declare('stiffness_scale', 'structure', 1e-6, 1.0, nothing, scaled)
def _(s, p):
    both = tuple((i, p['scale']) for i in range(len(s.craft.arrays)))
    return replace(s, plate_scale=s.plate_scale + both)


@declare('array_asymmetry', 'structure', 1e-6, 1.0, an_array, scaled_array,
         fits=lambda craft: len(craft.arrays) > 1)
def _(s, p):
    one = (s.craft.names.index(p['array']), p['scale'])
    return replace(s, plate_scale=(*s.plate_scale, one))


@declare('damping_scale', 'structure', 1e-4, 10.0, nothing, scaled)
def _(s, p):
    return replace(s, damping_scale=s.damping_scale * p['scale'])


@declare('hub_inertia', 'structure', 1e-4, 8.0, nothing, scaled)
def _(s, p):
    return replace(s, hub_scale=s.hub_scale * p['scale'])


def _anywhere(rng, craft, t):
    v = an_array(rng, craft)
    plate = craft.arrays[craft.names.index(v['array'])].plate
    return {**v, 'along': rng.uniform(0.4, 1.0) * plate.length_m,
            'lateral': rng.uniform(-0.5, 0.5) * plate.width_m}


@declare('added_mass', 'structure', 1e-6, 30.0, _anywhere,
         lambda v, m: {'array': v['array'], 'mass_kg': m, 'along_m': v['along'],
                       'lateral_m': v['lateral']})
def _(s, p):
    mass = (s.craft.names.index(p['array']), p['mass_kg'], p['along_m'], p['lateral_m'])
    return replace(s, masses=(*s.masses, mass))


def _hinged(s, array, stiffness, *local):
    """Put a hinge at the root of an array, with local forces (law, values) in it."""
    i = s.craft.names.index(array)
    if i in dict(s.hinge):
        raise ValueError(f'array {array} has a hinge already; put the second effect elsewhere')
    forces = tuple((kind, i, {'at': 'hinge', 'values': values}) for kind, values in local)
    return replace(s, hinge=(*s.hinge, (i, stiffness)), local=s.local + forces)


def _hinge(more=lambda rng: {}):
    """Return a draw of a hinge: array, rms moment at its root, and what the law needs."""
    def draw(rng, craft, t):
        v = an_array(rng, craft)
        moment = motion_rms(craft, craft.names.index(v['array']), 'root')
        return {**v, 'moment': moment, **more(rng)}
    return draw


def hinge_parameters(v, m, share):
    """Return `array` and `stiffness_n_m_rad`, of the total compliance m [rad/(N m)] a share."""
    return {'array': v['array'], 'stiffness_n_m_rad': 1 / (share * m)}


@declare('hinge_compliance', 'structure', 1e-12, 1e-2, an_array,
         lambda v, m: hinge_parameters(v, m, 1.0))
def _(s, p):
    return _hinged(s, p['array'], p['stiffness_n_m_rad'])


@declare('hinge_freeplay', 'structure', 1e-11, 1e-2, _hinge(),
         lambda v, m: {**hinge_parameters(v, m, 0.4), 'gap_rad': 0.6 * m * v['moment']},
         'simulated')
def _(s, p):
    return _hinged(s, p['array'], p['stiffness_n_m_rad'],
                   ('freeplay', (p['stiffness_n_m_rad'], p['gap_rad'])))


@declare('hinge_friction', 'structure', 1e-11, 1e-2,
         _hinge(lambda rng: {'ratio': rng.uniform(0.3, 1.2)}),
         lambda v, m: {**hinge_parameters(v, m, 1.0), 'torque_n_m': v['ratio'] * v['moment']},
         'simulated')
def _(s, p):
    return _hinged(s, p['array'], p['stiffness_n_m_rad'], ('friction', (p['torque_n_m'],)))


@declare('cubic_stiffness', 'structure', 1e-11, 1e-2,
         _hinge(lambda rng: {'ratio': log_uniform(rng, 0.3, 3)}),
         lambda v, m: {**hinge_parameters(v, m, 1.0),
                       'k3_n_m_rad3': v['ratio'] / (m * (m * v['moment'])**2)}, 'simulated')
def _(s, p):
    return _hinged(s, p['array'], p['stiffness_n_m_rad'], ('cubic', (p['k3_n_m_rad3'],)))


@declare('stiffness_drift', 'structure', 1e-6, 0.8, nothing,
         lambda v, m: {'change': scaled(v, m)['scale'] - 1}, 'drift')
def _(s, p):
    return replace(s, drift=p['change'])


def _between(rng, lowest, highest):
    """Draw a slosh frequency about the lower modes, also where all lie close together."""
    return log_uniform(rng, 0.8 * lowest, max(0.3 * highest, lowest))


@declare('fuel_slosh', 'structure', 1e-4, 500.0,
         lambda rng, craft, t: {'f': _between(rng, *mode_range(craft)),
                                'z': log_uniform(rng, 0.005, 0.05), 'arm': rng.uniform(0.4, 1.0)},
         lambda v, m: {'mass_kg': m, 'frequency_hz': v['f'], 'damping_ratio': v['z'],
                       'arm_m': v['arm']})
def _(s, p):
    return replace(s, slosh=(*s.slosh, (p['mass_kg'], p['frequency_hz'], p['damping_ratio'],
                                        p['arm_m'])))


@declare('attitude_controller', 'structure', 1e-5, 1.0,
         lambda rng, craft, t: {'z': rng.uniform(0.5, 1.0), 'f': mode_range(craft)[0]},
         lambda v, m: {'bandwidth_hz': m * v['f'], 'damping_ratio': v['z']})
def _(s, p):
    return replace(s, controller=(p['bandwidth_hz'], p['damping_ratio']))


@declare('gyroscopic_coupling', 'structure', 1e-3, 1e5, nothing,
         lambda v, m: {'momentum_n_m_s': v['sign'] * m})
def _(s, p):
    return replace(s, momentum=p['momentum_n_m_s'])
