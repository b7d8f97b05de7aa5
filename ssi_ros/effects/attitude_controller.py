"""A controller holds the attitude that the model leaves free."""
from dataclasses import replace
import math

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.quantity import quantity


@effect
class AttitudeController(Effect):
    """
    PD torque on theta_x and theta_y, eq. (91).

    Its gains are J w^2 and 2 xi w J, with J the whole inertia of the undeformed body about the
    axis and w = 2 pi bandwidth_hz.
    """

    name = 'attitude_controller'
    site = Site.STRUCTURE
    size = 'bandwidth_hz'
    reference = 'Wie, Space Vehicle Dynamics and Control, 2008, chapter 7'
    starts = {'bandwidth_hz': (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.8),
              'damping_ratio': (0.2, 0.7)}
    follows = {'bandwidth_hz': 'modes'}
    needs = ('geometry',)
    patterns = (ModalPattern.MODE_DAMPINGS, ModalPattern.NEW_MODE)

    bandwidth_hz: float = quantity(0.0, unit='Hz', low=0.0, high=50.0,
                                   doc='natural frequency of the rigid attitude')
    damping_ratio: float = quantity(0.7, low=0.01, high=5.0, doc='of the rigid attitude')

    def apply(self, setup):
        """Return the setup with the loop closed."""
        system, w = setup.system, 2 * math.pi * self.bandwidth_hz
        stiffness, damping = system.stiffness.copy(), system.damping.copy()
        for i in (0, 1):
            inertia = system.mass[i, i]
            stiffness[i, i] += inertia * w ** 2
            damping[i, i] += 2 * self.damping_ratio * w * inertia
        return replace(setup, system=replace(system, stiffness=stiffness, damping=damping))
