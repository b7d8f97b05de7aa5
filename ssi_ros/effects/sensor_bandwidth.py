"""An accelerometer cannot follow fast motion."""
from dataclasses import replace
import math

import numpy as np

from ssi_ros.effects.base import Effect, effect, Site
from ssi_ros.effects.edits import channel_index
from ssi_ros.model.statespace import StateSpace
from ssi_ros.quantity import quantity


@effect
class SensorBandwidth(Effect):
    """One channel, or all, pass a second-order Butterworth low-pass, eq. (92)."""

    name = 'sensor_bandwidth'
    site = Site.SENSOR
    size = 'corner_hz'
    reference = 'Butterworth, Wireless Engineer 7, 1930'
    starts = {'corner_hz': (250.0, 60.0)}
    power = -2.0

    channel: str = quantity('all', doc='channel, or all')
    corner_hz: float = quantity(float('inf'), unit='Hz', low=0.1, doc='corner, -3 dB')

    def apply(self, setup):
        """Return the setup with the filter between structure and converter."""
        system, w = setup.system, 2 * math.pi * self.corner_hz
        count = len(system.channels)
        one = [channel_index(system, self.channel)] if self.channel != 'all' else range(count)
        a = np.kron(np.eye(len(one)), [[0.0, 1.0], [-w ** 2, -math.sqrt(2) * w]])
        b, c, d = np.zeros((len(a), count)), np.zeros((count, len(a))), np.eye(count)
        for k, channel in enumerate(one):
            b[2 * k + 1, channel], c[channel, 2 * k] = w ** 2, 1.0
            d[channel, channel] = 0.0
        names = tuple(f'sensor_filter{k}' for k in range(len(a)))
        filters = StateSpace(a, b, c, d, names, scale=np.tile([w, 1.0], len(one)))
        if system.conditioning is not None:
            filters = system.conditioning.then(filters)
        return replace(setup, system=replace(system, conditioning=filters))
