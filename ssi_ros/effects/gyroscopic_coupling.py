"""A wheel stores momentum that the model does not have."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.quantity import quantity


@effect
class GyroscopicCoupling(Effect):
    """Momentum along z_b, which couples theta_x and theta_y: the torque -theta' x h."""

    name = 'gyroscopic_coupling'
    site = Site.STRUCTURE
    size = 'momentum_n_m_s'
    reference = 'paper, eq. (3a), with stored momentum; docs/theory.md, section 3'
    starts = {'momentum_n_m_s': (-15.0, 15.0)}
    follows = {'momentum_n_m_s': 'momentum'}
    patterns = (ModalPattern.NEW_MODE, ModalPattern.MODE_FREQUENCIES)

    momentum_n_m_s: float = quantity(0.0, unit='N m s', low=-1e5, high=1e5, doc='along z_b')

    def spacecraft(self, spacecraft):
        """Return the spacecraft with the momentum added."""
        x, y, z = spacecraft.momentum_n_m_s
        return replace(spacecraft, momentum_n_m_s=(x, y, z + self.momentum_n_m_s))
