# Licensed under the Apache License, Version 2.0.
"""
All that a diagnosis may not know of a record, one number each, with its spread beforehand.

Shared by the healthy recordings and the record to be diagnosed: frequency, damping, participation
and shape of each mode, inertia, gains, the colour of torque and modal forces. Of each record on
its own: the level of every input, of the noise, and the warmth.
"""
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Callable

from blindgen.cases.draw import DAMPING, FREQUENCY, GAIN, INERTIA, NOISE, SHAPE, WARMTH
import numpy as np

LEVEL = 1.0                 # spread of the logarithm of a level: as good as free
COLOUR = 3.0                # spread of (rate / corner)^2, in units of itself or of COLOUR_LEAST
COLOUR_LEAST = 0.1
# rms of an error whose size is uniform in its logarithm
FREQUENCY_RMS = float(np.sqrt((FREQUENCY[1]**2 - FREQUENCY[0]**2)
                              / (2 * np.log(FREQUENCY[1] / FREQUENCY[0]))))
DAMPING_RMS = DAMPING / np.sqrt(3)


@dataclass(frozen=True)
class Unknown:
    """A number that moves a scenario: its spread beforehand and a step for its derivative."""

    name: str
    shared: bool
    spread: float
    step: float
    moved: Callable              # (scenario, amount) -> scenario


def unknowns(scenario):
    """Return all Unknowns of a scenario's spacecraft, the shared ones first."""
    craft, data = scenario.craft, []
    for i, array in enumerate(craft.arrays):
        for k in range(array.modes):
            fine = 0.02 * array.damping[k]
            data += [Unknown(f'frequency {i} {k}', True, FREQUENCY_RMS, fine,
                             _array(i, 'frequency', k, array.modes)),
                     Unknown(f'damping {i} {k}', True, DAMPING_RMS, 0.01,
                             _array(i, 'damping', k, array.modes)),
                     Unknown(f'participation {i} {k}', True, SHAPE, 1e-3,
                             _array(i, 'participation', k, array.modes))]
    for c, sensor in enumerate(craft.sensors):
        data += [Unknown(f'shape {c} {k}', True, SHAPE, 1e-3, _shape(c, k))
                 for k in range(craft.arrays[sensor.array].modes)]
        data.append(Unknown(f'gain {c}', True, GAIN, 1e-4, _gain(c)))
    data += [Unknown(f'inertia {k}', True, INERTIA, 1e-3, _inertia(k)) for k in range(3)]
    data += [Unknown(name, True, COLOUR, 0.01, _colour(name))
             for name in ('torque_corner_hz', 'process_corner_hz')]
    driven = [k for k in range(craft.inputs) if k > 2 or craft.torque_rms[k] > 0]
    data += [Unknown(f'level {k}', False, LEVEL, 0.01, _level(k)) for k in driven]
    data += [Unknown('noise', False, NOISE, 0.01, lambda s, h: replace(
                 s, noise_level=s.noise_level * np.exp(h))),
             Unknown('warmth', False, WARMTH, 1e-4 * 0.02 + 2e-6, lambda s, h: replace(
                 s, warmth=s.warmth + h))]
    return data


def _with(values, k, factor):
    return (*values[:k], values[k] * factor, *values[k + 1:])


def _array(i, field, k, modes):
    def moved(s, h):
        arrays = list(s.craft.arrays)
        values = getattr(arrays[i], field) or modes * (1.0,)
        arrays[i] = replace(arrays[i], **{field: _with(values, k, float(np.exp(h)))})
        return replace(s, craft=replace(s.craft, arrays=tuple(arrays)))
    return moved


def _shape(c, k):
    def moved(s, h):
        sensors = list(s.craft.sensors)
        values = sensors[c].shape or s.craft.arrays[sensors[c].array].modes * (1.0,)
        sensors[c] = replace(sensors[c], shape=_with(values, k, 1 + h))
        return replace(s, craft=replace(s.craft, sensors=tuple(sensors)))
    return moved


def _gain(c):
    return lambda s, h: replace(s, gains=(*s.gains, (c, 1 + h)))


def _inertia(k):
    return lambda s, h: replace(s, craft=replace(
        s.craft, hub_inertia=_with(s.craft.hub_inertia, k, 1 + h)))


def _colour(name):
    def moved(s, h):
        q = (s.craft.rate_hz / getattr(s.craft, name))**2
        q = max(q + h * max(q, COLOUR_LEAST), 0.0)
        corner = float(s.craft.rate_hz / np.sqrt(q)) if q > 0 else np.inf
        return replace(s, craft=replace(s.craft, **{name: corner}))
    return moved


def _level(k):
    def moved(s, h):
        levels = s.levels or s.craft.inputs * (1.0,)
        return replace(s, levels=_with(levels, k, float(np.exp(h))))
    return moved


def moved(scenario, amounts):
    """Return a scenario with all its unknowns moved by amounts (p,)."""
    for unknown, amount in zip(unknowns(scenario), amounts):
        scenario = unknown.moved(scenario, float(amount))
    return scenario


@lru_cache(maxsize=8)
def spreads(scenario):
    """Return how far each unknown of a scenario may be off, (p,)."""
    return np.array([u.spread for u in unknowns(scenario)])
