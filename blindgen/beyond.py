# Licensed under the Apache License, Version 2.0.
"""Ten effects that no library has: a diagnosis should answer that it does not know them."""
from dataclasses import replace

from blindgen.effects import (a_channel, an_array, declare, log_uniform, nothing, ROOT_MOMENT_RMS,
                              with_item)
from blindgen.scenario import ARRAYS, CHANNELS
import numpy as np

FLEX_RMS_M = 1.0e-5        # [m] rms flexing 1 m from a root; a test computes it


def beyond(name, site, low, high, draw, size, predict='simulated'):
    """Declare an effect outside the library."""
    return declare(name, site, low, high, draw, size, predict, library=False)


def _local(s, kind, array, where, values, **more):
    """Add a local force to an array."""
    force = (kind, ARRAYS.index(array), {'at': where, 'values': values, **more})
    return replace(s, local=(*s.local, force))


@beyond('bouc_wen_hinge', 'structure', 1e-9, 1e-3,
        lambda rng: {**an_array(rng), 'ratio': rng.uniform(0.5, 2)},
        lambda v, m: {'array': v['array'], 'stiffness_n_m_rad': 1 / m, 'share': 0.5,
                      'yield_rad': v['ratio'] * m * ROOT_MOMENT_RMS})
def _(s, p):
    i = ARRAYS.index(p['array'])
    s = replace(s, hinge=with_item(s.hinge, i, p['stiffness_n_m_rad']))
    return _local(s, 'bouc_wen', p['array'], 'hinge',
                  (p['share'] * p['stiffness_n_m_rad'], p['yield_rad']))


@beyond('quadratic_damping', 'structure', 1.0, 1e6, an_array,
        lambda v, m: {'array': v['array'], 'coefficient_n_s2_m2': m})
def _(s, p):
    return _local(s, 'quadratic', p['array'], 8.0, (p['coefficient_n_s2_m2'],))


@beyond('second_torque_axis', 'excitation', 1e-4, 10.0, nothing,
        lambda v, m: {'torque_n_m': m}, 'spectrum')
def _(s, p):
    return replace(s, second_torque=p['torque_n_m'])


@beyond('telegraph_torque', 'excitation', 1e-5, 10.0,
        lambda rng: {'rate': log_uniform(rng, 0.5, 5)},
        lambda v, m: {'torque_n_m': m, 'switches_per_s': v['rate']}, 'spectrum')
def _(s, p):
    return replace(s, telegraph=(p['torque_n_m'], p['switches_per_s']))


@beyond('parametric_pumping', 'structure', 1e-4, 0.6,
        lambda rng: {**an_array(rng), 'f': rng.uniform(0.82, 0.95)},
        lambda v, m: {'array': v['array'], 'depth': m, 'frequency_hz': v['f']})
def _(s, p):
    k = p['depth'] * (2 * np.pi * 0.361)**2
    return _local(s, 'pumped', p['array'], 'mode', (k, 2 * np.pi * p['frequency_hz']), mode=0)


@beyond('one_sided_contact', 'structure', 0.01, 3e4,
        lambda rng: {**an_array(rng), 'ratio': rng.uniform(0.0, 1.0)},
        lambda v, m: {'array': v['array'], 'stiffness_n_m': m, 'gap_m': v['ratio'] * FLEX_RMS_M})
def _(s, p):
    return _local(s, 'contact', p['array'], 1.0, (p['stiffness_n_m'], p['gap_m']))


@beyond('gain_wander', 'sensor', 1e-5, 0.5,
        lambda rng: {**a_channel(rng), 'tau': log_uniform(rng, 60, 200)},
        lambda v, m: {'channel': v['channel'], 'rms': m, 'time_constant_s': v['tau']}, 'wander')
def _(s, p):
    return replace(s, gain_wander=(*s.gain_wander, (CHANNELS.index(p['channel']), p['rms'],
                                                    p['time_constant_s'])))


@beyond('electromagnetic_spikes', 'sensor', 1e-6, 10.0,
        lambda rng: {'rate': log_uniform(rng, 2, 30)},
        lambda v, m: {'rate_per_min': v['rate'], 'size_m_s2': m}, 'mean')
def _(s, p):
    return replace(s, spikes=(*s.spikes, (p['rate_per_min'], p['size_m_s2'])))


@beyond('cable_hysteresis', 'structure', 0.01, 3e4,
        lambda rng: {**an_array(rng), 'ratio': rng.uniform(0.3, 1.0)},
        lambda v, m: {'array': v['array'], 'stiffness_n_m': m,
                      'force_n': v['ratio'] * m * FLEX_RMS_M})
def _(s, p):
    return _local(s, 'slider', p['array'], 1.0, (p['stiffness_n_m'], p['force_n']))


@beyond('rotating_geometry', 'structure', 1e-3, 1.5, nothing,
        lambda v, m: {'rotation_rad': v['sign'] * m}, 'spectrum')
def _(s, p):
    return replace(s, rotation_rad=p['rotation_rad'])
