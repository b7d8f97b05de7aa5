"""Propellant moves in its tank."""
from dataclasses import replace
import math

import numpy as np

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.quantity import quantity


@effect
class FuelSlosh(Effect):
    """
    A spring-mass on the hub that moves along z_b, at `arm_m` along y_b, eq. (90).

    Its speed is arm theta_x' + s', so it adds a freedom s, and its mass to the hub's inertia.
    """

    name = 'fuel_slosh'
    site = Site.STRUCTURE
    size = 'mass_kg'
    reference = 'Abramson, NASA SP-106, 1966: equivalent spring-mass of a tank'
    # a template responds to a narrow resonance at most its own width away
    starts = {'mass_kg': (3.0,), 'frequency_hz': tuple(0.12 * 1.07 ** k for k in range(67)),
              'damping_ratio': (0.02,), 'arm_m': (1.0,)}
    follows = {'mass_kg': 'inertia', 'frequency_hz': 'modes'}
    needs = ('geometry',)
    patterns = (ModalPattern.MODE_FREQUENCIES, ModalPattern.MODE_DAMPINGS, ModalPattern.NEW_MODE)

    mass_kg: float = quantity(0.0, unit='kg', low=0.0, high=1e5, doc='moving mass')
    frequency_hz: float = quantity(0.5, unit='Hz', low=0.01, high=100.0, doc='on a fixed hub')
    damping_ratio: float = quantity(0.01, low=1e-4, high=0.9, doc='on a fixed hub')
    arm_m: float = quantity(0.5, unit='m', low=0.01, high=100.0, doc='position along y_b')

    def apply(self, setup):
        """Return the setup with one freedom more."""
        system, n = setup.system, len(setup.system.dofs)
        if 'slosh' in system.dofs:
            raise ValueError('fuel_slosh is given twice; the setup takes one')
        omega = 2 * math.pi * self.frequency_hz
        mass, damping, stiffness = (np.pad(m, ((0, 1), (0, 1))) for m in (
            system.mass, system.damping, system.stiffness))
        row = np.zeros(n + 1)
        row[0], row[n] = self.arm_m, 1.0
        mass = mass + self.mass_kg * np.outer(row, row)
        damping[n, n] = 2 * self.damping_ratio * omega * self.mass_kg
        stiffness[n, n] = omega ** 2 * self.mass_kg
        return replace(setup, system=replace(
            system, mass=mass, damping=damping, stiffness=stiffness,
            input=np.pad(system.input, ((0, 1), (0, 0))),
            sensor=np.pad(system.sensor, ((0, 0), (0, 1))), dofs=system.dofs + ('slosh',)))
