"""A wheel stores momentum that the model does not have."""
from dataclasses import replace

import numpy as np

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.edits import add_part
from ssi_ros.model.disturbances import Nutation
from ssi_ros.model.statespace import NUTATES
from ssi_ros.model.structure import assemble
from ssi_ros.quantity import quantity

ROUNDS = 6              # of finding a momentum by its nutation
NEAR = 1e-3             # relative, of its frequency


@effect
class GyroscopicCoupling(Effect):
    """Momentum along z_b, which couples theta_x and theta_y: the torque -theta' x h."""

    name = 'gyroscopic_coupling'
    site = Site.STRUCTURE
    size = 'momentum_n_m_s'
    reference = 'paper, eq. (3a), with stored momentum; docs/theory.md, section 3'
    starts = {'momentum_n_m_s': (-15.0, 15.0), 'impulse_n_m_s': (0.03, 0.3, 3.0)}
    follows = {'momentum_n_m_s': 'momentum', 'impulse_n_m_s': 'torque'}
    patterns = (ModalPattern.NEW_MODE, ModalPattern.MODE_FREQUENCIES)

    momentum_n_m_s: float = quantity(0.0, unit='N m s', low=-1e5, high=1e5, doc='along z_b')
    impulse_n_m_s: float = quantity(
        0.0, unit='N m s', low=0.0, high=1e5,
        doc='of a torque about x_b, that has left the nutation of the first sample')

    @property
    def first_order(self):
        """One: the frequency of the nutation, a line, is proportional to the momentum."""
        return 1.0

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the momentum added."""
        x, y, z = spacecraft.momentum_n_m_s
        return replace(spacecraft, momentum_n_m_s=(x, y, z + self.momentum_n_m_s))

    @classmethod
    def of_line(cls, spacecraft, frequency_hz):
        """Return the effects whose nutation is at a frequency; none where no momentum is."""
        x, y, _ = np.diag(spacecraft.hub.inertia_kg_m2)
        momentum = 2 * np.pi * frequency_hz * np.sqrt(x * y)    # of the hub alone
        for _ in range(ROUNDS):
            found = cls.within(momentum_n_m_s=momentum).spacecraft(spacecraft)
            poles = assemble(found).state_space.diagonal[0]
            poles = poles[poles.imag > 0]
            slow = poles[np.argmin(-poles.real / np.abs(poles))]
            at_hz = slow.imag / (2 * np.pi)
            momentum *= frequency_hz / at_hz
        near = abs(at_hz / frequency_hz - 1) < NEAR and -slow.real < NUTATES * abs(slow)
        return tuple(cls.within(momentum_n_m_s=s * momentum, impulse_n_m_s=cls.starts_on(
            spacecraft, {})['impulse_n_m_s'][0]) for s in (-1, 1) if near)

    def apply(self, setup):
        """Return the setup with the nutation that goes on from before, eq. (23c)."""
        if not self.impulse_n_m_s:
            return setup
        return add_part(setup, Nutation(setup.system.inputs[0], self.impulse_n_m_s))
