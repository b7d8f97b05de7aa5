# Licensed under the Apache License, Version 2.0.
"""The library's effects of sensors and timing, as this generator reads their definitions."""
from dataclasses import replace

from blindgen.effects.base import (a_channel, channel_rms, declare, log_uniform, nothing,
                                   scaled_channel, sign)
import numpy as np


@declare('sensor_gain', 'sensor', 1e-6, 1.0, a_channel, scaled_channel)
def _(s, p):
    return replace(s, gains=(*s.gains, (s.craft.channels.index(p['channel']), p['scale'])))


@declare('sensor_crosstalk', 'sensor', 1e-6, 1.0,
         lambda rng, craft, t: dict(zip(('source', 'channel'),
                                        map(str, rng.permutation(craft.channels)[:2])),
                                    sign=sign(rng)),
         lambda v, m: {'source': v['source'], 'channel': v['channel'], 'gain': v['sign'] * m})
def _(s, p):
    pair = (s.craft.channels.index(p['source']), s.craft.channels.index(p['channel']), p['gain'])
    return replace(s, crosstalk=(*s.crosstalk, pair))


def _misplaced(rng, craft, t):
    v = a_channel(rng, craft)
    sensor = craft.sensors[craft.channels.index(v['channel'])]
    return {**v, 'angle': rng.uniform(0, np.pi / 2), 'side': float(np.sign(sensor.lateral_m) or 1),
            'most': 0.3 * craft.arrays[sensor.array].plate.width_m}


@declare('sensor_misplacement', 'sensor', 1e-6, 3.0, _misplaced,
         # towards the root and the middle: outward the array soon ends
         lambda v, m: {'channel': v['channel'], 'along_m': -m * v['most'] * np.cos(v['angle']),
                       'lateral_m': -v['side'] * m * v['most'] * np.sin(v['angle'])})
def _(s, p):
    return replace(s, moved=(*s.moved, (s.craft.channels.index(p['channel']), p['along_m'],
                                        p['lateral_m'])))


@declare('sensor_noise', 'sensor', 1e-4, 300.0, a_channel, scaled_channel)
def _(s, p):
    one = (s.craft.channels.index(p['channel']), p['scale'])
    return replace(s, noise_scales=(*s.noise_scales, one))


@declare('sensor_drift', 'sensor', 1e-7, 10.0,
         lambda rng, craft, t: {**a_channel(rng, craft),
                                'tau': log_uniform(rng, 30, 3000) / craft.rate_hz},
         lambda v, m: {'channel': v['channel'], 'rms_m_s2': m, 'time_constant_s': v['tau']})
def _(s, p):
    return replace(s, drifts=(*s.drifts, (s.craft.channels.index(p['channel']), p['rms_m_s2'],
                                          p['time_constant_s'])))


def _quietest(rng, craft, t):
    """Return the rms of the quietest channel [m/s^2]: a step beyond it leaves no record."""
    return {'rms': float(channel_rms(craft).min())}


@declare('quantisation', 'sensor', 1e-6, 1.0, _quietest,
         lambda v, m: {'step_m_s2': m * v['rms']}, 'rounding')
def _(s, p):
    return replace(s, step=p['step_m_s2'])


@declare('saturation', 'sensor', 0.1, 10.0,
         lambda rng, craft, t: {'rms': float(channel_rms(craft).max())},
         lambda v, m: {'limit_m_s2': v['rms'] / m}, 'limits')
def _(s, p):
    return replace(s, limit=p['limit_m_s2'])


@declare('sensor_bandwidth', 'sensor', 1e-3, 20.0,
         lambda rng, craft, t: {'channel': str(rng.choice([*craft.channels, 'all'])),
                                'rate': craft.rate_hz},
         lambda v, m: {'channel': v['channel'], 'corner_hz': v['rate'] / m})
def _(s, p):
    channel = 'all' if p['channel'] == 'all' else s.craft.channels.index(p['channel'])
    return replace(s, low_pass=(*s.low_pass, (channel, p['corner_hz'])))


@declare('channel_delay', 'sensor', 1e-5, 2.0,
         lambda rng, craft, t: {**a_channel(rng, craft), 'rate': craft.rate_hz},
         lambda v, m: {'channel': v['channel'], 'delay_s': m / v['rate']})
def _(s, p):
    return replace(s, delays=(*s.delays, (s.craft.channels.index(p['channel']), p['delay_s'])))


@declare('clock_rate', 'timing', 0.1, 3e4, nothing, lambda v, m: {'ppm': v['sign'] * m})
def _(s, p):
    return replace(s, ppm=p['ppm'])


@declare('timestamp_jitter', 'timing', 1e-5, 0.4,
         lambda rng, craft, t: {'rate': craft.rate_hz}, lambda v, m: {'rms_s': m / v['rate']})
def _(s, p):
    return replace(s, jitter_s=p['rms_s'])


@declare('dropped_samples', 'timing', 1e-7, 0.3, nothing, lambda v, m: {'fraction': m}, 'count')
def _(s, p):
    return replace(s, dropped=p['fraction'])
