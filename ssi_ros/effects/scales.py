"""
How large quantities are on a spacecraft, over the packaged one that starts are of.

A mass of slosh of 3 kg is little beside a hub of 600 kg m^2, and turns one of 5 kg m^2 round: its
resonance is then far from where a small one would have it, and no fit begins near.
"""
from functools import lru_cache
import math

# of the packaged spacecraft: config/spacecraft.yaml
INERTIA, TORQUE, RATE_HZ = 600.0, 0.1, 100.0
LENGTH, WIDTH, THICKNESS, DENSITY, STIFFNESS = 8.0, 2.0, 0.025, 88.0, 4000.0


def scales_of(spacecraft, place):
    """
    Return how large quantities are over those of the packaged spacecraft, by name.

    Parameters
    ----------
    spacecraft : Spacecraft
        A model with arrays.
    place : dict
        Words of an effect: the array named, or that of the channel, is the one whose length,
        width, mass and hinge count; if none is, that of the slowest modes.

    Returns
    -------
    dict of str to float
        `length`, `width`, `mass` and `hinge` (stiffness of a hinge) of an array, `angle` and
        `moment` in such a hinge, `cubic` (stiffness over the square of the angle); `modes` (the
        lowest frequency), `inertia` (of the hub about x_b), `momentum` (that turns the hub as
        fast as a mode), `torque` (of the excitation), `rate`, `sample` (its period).

    """
    every = {a.name: _of_plate(a.plate) for a in spacecraft.arrays}
    slowest = min(every, key=lambda name: every[name]['modes'])
    of_sensors = {s.name: s.array for s in spacecraft.sensors}
    own = every[place.get('array') or of_sensors.get(place.get('channel'), slowest)]
    inertia = spacecraft.hub.inertia_kg_m2[0][0] / INERTIA
    torque = max(spacecraft.excitation.torque_rms_n_m) / TORQUE
    modes, rate = every[slowest]['modes'], spacecraft.rate_hz / RATE_HZ
    # what turns the hub is the moment in a hinge, by the inertia of the array
    moment = own['mass'] * own['length'] ** 2 * torque / inertia if torque else own['hinge']
    return {**own, 'moment': moment, 'angle': moment / own['hinge'], 'modes': modes,
            'inertia': inertia, 'momentum': inertia * modes, 'torque': torque or 1.0,
            'rate': rate, 'sample': 1 / rate,
            'cubic': own['hinge'] / (moment / own['hinge']) ** 2}


@lru_cache(maxsize=16)
def _of_plate(plate):
    """Return the scales of a plate on a clamp."""
    length, width = plate.length_m / LENGTH, plate.width_m / WIDTH
    area = plate.thickness_m * plate.density_kg_m3 / (THICKNESS * DENSITY)
    stiffness = plate.stiffness_n_m / STIFFNESS
    return {'length': length, 'width': width, 'mass': area * length * width,
            'hinge': stiffness * width / length,
            'modes': math.sqrt(stiffness / area) / length ** 2}
