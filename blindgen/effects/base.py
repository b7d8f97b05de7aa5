# Licensed under the Apache License, Version 2.0.
"""
What an effect is.

An effect draws what is free (channel, array, sign, frequencies) for a spacecraft, turns one size
m > 0 into its parameters, and applies them to a scenario. m is small for a weak effect; its range
bounds what a case may use. `predict` says how sizes/predict.py counts its detectability.
"""
from dataclasses import dataclass
from functools import lru_cache
from typing import Callable

from blindgen.physics.excitation import input_responses, input_rms
from blindgen.physics.propagate import modes_of
from blindgen.physics.scenario import Scenario
from blindgen.physics.spectrum import deflections, spectrum
import numpy as np

EFFECTS = {}


@dataclass(frozen=True)
class Effect:
    """One effect: its name and site, how it is drawn, sized and applied."""

    name: str
    site: str
    low: float
    high: float
    draw: Callable               # (rng, craft, duration_s) -> variant
    size: Callable               # (variant, m) -> parameters
    apply: Callable              # (scenario, parameters) -> scenario
    predict: str = 'spectrum'
    library: bool = True
    fits: Callable = lambda craft: True


def declare(name, site, low, high, draw, size, predict='spectrum', **more):
    """Register the decorated function, which applies the parameters to a scenario."""
    def keep(apply):
        EFFECTS[name] = Effect(name, site, low, high, draw, size, apply, predict, **more)
        return apply
    return keep


def sign(rng):
    """Return -1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


def log_uniform(rng, low, high):
    """Return a number between two bounds, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def an_array(rng, craft, duration_s=0.0):
    """Draw an array and a sign."""
    return {'array': str(rng.choice(craft.names)), 'sign': sign(rng)}


def a_channel(rng, craft, duration_s=0.0):
    """Draw a channel and a sign."""
    return {'channel': str(rng.choice(craft.channels)), 'sign': sign(rng)}


def nothing(rng, craft, duration_s=0.0):
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


@lru_cache(maxsize=64)
def mode_range(craft):
    """Return the lowest and the highest natural frequency [Hz] of a spacecraft."""
    hz = modes_of(Scenario(craft=craft))[0]
    return float(hz[0]), float(hz[-1])


@lru_cache(maxsize=64)
def motion_rms(craft, array, where):
    """
    Return the rms of a motion under the nominal loads: of the moment at a root, or of flexing.

    where : 'root' [N m], or ((along, lateral), derivative) of a point of the array: [m], [m/s]
    """
    stiff = 1e7                                  # so stiff that the moment is the clamp's
    site = 'hinge' if where == 'root' else where[0]
    scenario = Scenario(craft=craft, hinge=((array, stiff),) if where == 'root' else (),
                        local=(('none', array, {'at': site, 'values': ()}),))
    f = np.linspace(0, 0.5, 6001)[1:] * craft.rate_hz
    motion = deflections(scenario, f) * (input_responses(scenario, f)
                                         * input_rms(scenario))[:, None, :]
    if where != 'root' and where[1]:
        motion = motion * (2j * np.pi * f)[:, None, None]
    rms = np.sqrt(np.mean(np.sum(np.abs(motion)**2, axis=(1, 2))))
    return float(rms * (stiff if where == 'root' else 1.0))


@lru_cache(maxsize=64)
def channel_rms(craft):
    """Return the rms of each channel under the nominal loads and noise, (c,) [m/s^2]."""
    f = np.linspace(0, 0.5, 6001)[1:] * craft.rate_hz
    power = np.einsum('kii->ki', sum(spectrum(Scenario(craft=craft), f))).real
    return np.sqrt(power.mean(axis=0))
