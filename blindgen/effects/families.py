# Licensed under the Apache License, Version 2.0.
"""
Families of effects that no template can hold: each case draws its own function.

A static curve in a channel, a modulation of a matrix, an input or a channel, a filter, an
oscillator anywhere, an input from anywhere, a point process, corrupted samples, a nonlinear joint.
All that a draw fixed is in its parameters, so that a label repeats the case.
"""
from dataclasses import asdict, replace

from blindgen.effects.base import declare, log_uniform, mode_range, motion_rms
from blindgen.physics.functions import (Curve, draw_curve, draw_points, draw_response, draw_static,
                                        Points, Response, static)
from blindgen.physics.march import REACH
from blindgen.physics.scenario import Scenario
from blindgen.physics.sensors import Spoiling
from blindgen.physics.spectrum import spectrum
import numpy as np


def family(name, site, low, high, draw):
    """Declare a family; its size is the parameter `size`."""
    return declare(name, site, low, high, draw, lambda v, m: {**v, 'size': m}, 'statistics',
                   library=False)


def _made(kind, values):
    """Return a drawn function from its parameters, lists being tuples again."""
    return kind(**{key: _tuples(v) for key, v in values.items()})


def _tuples(value):
    return tuple(_tuples(v) for v in value) if isinstance(value, (list, tuple)) else value


def _channel_rms(craft):
    """Return the nominal rms of each channel (c,) [m/s^2]."""
    s, r = spectrum(Scenario(craft=craft), np.linspace(0, 0.5, 4001)[1:] * craft.rate_hz)
    return np.sqrt(np.einsum('kii->i', (s + r).real) / len(s))


@family('static_curve', 'sensor', 1e-6, 0.5,
        lambda rng, craft, t: (lambda c: {
            'channel': craft.channels[c], 'coefficients': draw_static(rng),
            'scale_m_s2': float(_channel_rms(craft)[c])})(int(rng.integers(len(craft.sensors)))))
def _(s, p):
    curve = (s.craft.channels.index(p['channel']), p['size'] * p['scale_m_s2'],
             tuple(p['coefficients']), p['scale_m_s2'])
    return replace(s, curved=(*s.curved, curve))


def _modulation(rng, craft, t):
    what = str(rng.choice(['M', 'C', 'K', 'input', 'channel']))
    v = {'what': what, 'curve': asdict(draw_curve(rng))}
    if what == 'channel':
        return {**v, 'which': int(rng.integers(len(craft.sensors)))}
    if what == 'input':
        driven = [k for k in range(3) if craft.torque_rms[k] > 0] + [*range(3, craft.inputs)]
        return {**v, 'which': int(rng.choice(driven))}
    direction = rng.standard_normal(craft.modes) * (rng.random(craft.modes) < 0.4)
    direction[int(rng.integers(craft.modes))] += 1.0
    return {**v, 'direction': (direction / np.linalg.norm(direction)).tolist()}


@family('modulation', 'structure', 1e-6, 0.3, _modulation)
def _(s, p):
    curve = _made(Curve, p['curve'])
    if p['what'] == 'channel':
        return replace(s, modulated_gains=(*s.modulated_gains, (p['which'], p['size'], curve)))
    if p['what'] == 'input':
        return replace(s, modulated_inputs=(*s.modulated_inputs, (p['which'], p['size'], curve)))
    one = (p['what'], tuple(p['direction']), p['size'], curve)
    return replace(s, modulated=(*s.modulated, one))


@family('random_filter', 'sensor', 1e-6, 0.5, lambda rng, craft, t: {
    'channel': str(rng.choice(craft.channels)),
    'response': asdict(draw_response(rng, mode_range(craft)[0], 0.4 * craft.rate_hz))})
def _(s, p):
    response = replace(_made(Response, p['response']), depth=p['size'])
    return replace(s, filtered=(*s.filtered, (s.craft.channels.index(p['channel']), response)))


def _place(rng, craft):
    array = int(rng.integers(len(craft.arrays)))
    plate = craft.arrays[array].plate
    return {'array': array, 'along_m': float(rng.uniform(0.05, 1.0) * plate.length_m),
            'lateral_m': float(rng.uniform(-0.5, 0.5) * plate.width_m)}


@family('extra_oscillator', 'structure', 1e-6, 50.0, lambda rng, craft, t: {
    **_place(rng, craft), 'frequency_hz': log_uniform(rng, *mode_range(craft)),
    'damping_ratio': log_uniform(rng, 0.003, 0.2)})
def _(s, p):
    one = (p['size'], p['frequency_hz'], p['damping_ratio'], p['array'], p['along_m'],
           p['lateral_m'])
    return replace(s, oscillators=(*s.oscillators, one))


@family('extra_input', 'excitation', 1e-8, 10.0, lambda rng, craft, t: {
    **_place(rng, craft), 'response': asdict(draw_response(
        rng, mode_range(craft)[0], 0.4 * craft.rate_hz, whole=True))})
def _(s, p):
    one = (p['array'], p['along_m'], p['lateral_m'], p['size'], _made(Response, p['response']))
    return replace(s, extra_inputs=(*s.extra_inputs, one))


@family('point_process', 'excitation', 1e-6, 100.0, lambda rng, craft, t: {
    'input': int(rng.choice([0, *range(3, craft.inputs)])), 'points': asdict(draw_points(rng))})
def _(s, p):
    rms = (s.craft.torque_rms + (s.craft.process_rms,) * s.craft.modes)[p['input']]
    points = replace(_made(Points, p['points']), size=p['size'] * rms)
    return replace(s, marked=(*s.marked, (p['input'], points)))


def _corruption(rng, craft, t):
    count = int(rng.integers(1, len(craft.sensors) + 1))
    shares = rng.dirichlet([0.4, 0.4, 0.4])
    return {'channels': sorted(int(c) for c in rng.permutation(len(craft.sensors))[:count]),
            'length': log_uniform(rng, 1, 30), 'hold': float(shares[0]),
            'own': float(rng.uniform(-1, 0.5) * shares[1]), 'other': float(shares[2]),
            'source': int(rng.integers(len(craft.sensors)))}


@family('sample_corruption', 'sensor', 0.5, 3e3, _corruption)
def _(s, p):
    values = {k: _tuples(v) for k, v in p.items() if k != 'size'}
    return replace(s, spoilt=(*s.spoilt, Spoiling(runs=p['size'], **values)))


def _joint(rng, craft, t):
    place = _place(rng, craft)
    at = (place['along_m'], place['lateral_m'])
    return {**place, 'deflection_m': motion_rms(craft, place['array'], (at, False)),
            'rate_m_s': motion_rms(craft, place['array'], (at, True)),
            'spring': draw_static(rng), 'damper': draw_static(rng),
            'share': float(rng.uniform(0, 1))}


@family('nonlinear_joint', 'structure', 1e-6, 1e4, _joint)
def _(s, p):
    z = np.linspace(-REACH, REACH, 257)
    tables = np.stack([p['size'] * share * p['deflection_m'] * static(p[name], z)
                       for name, share in (('spring', p['share']), ('damper', 1 - p['share']))])
    one = ('surface', p['array'], {'at': (p['along_m'], p['lateral_m']), 'tables': tables,
                                   'values': (p['deflection_m'], p['rate_m_s'])})
    return replace(s, local=(*s.local, one))
