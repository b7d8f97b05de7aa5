"""A damper between two points that the model does not have, or one that is weaker."""
import math

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.places import GROUND
from ssi_ros.effects.points import joined, mass_at, row_between, stiffness_between
from ssi_ros.quantity import quantity


@effect
class ConnectionDamping(Effect):
    """
    A damper of 2 ratio sqrt(k m) between two points, D -> D + 2 ratio sqrt(k m) r^T r.

    k = 1 / r K^-1 r^T and m = 1 / r M^-1 r^T: with one freedom `ratio` is its damping ratio.
    """

    name = 'connection_damping'
    site = Site.STRUCTURE
    size = 'ratio'
    reference = 'Przemieniecki, Theory of Matrix Structural Analysis, 1968 (viscous damper)'
    starts = {'ratio': (-5e-4, 5e-4)}
    needs = ('points',)
    patterns = (ModalPattern.MODE_DAMPINGS,)

    freedom: str = quantity('', doc='point, see `ssi_ros model FILE`')
    to: str = quantity(GROUND, doc='the other point, or ground')
    ratio: float = quantity(0.0, low=-1.0, high=10.0, doc='added damping over 2 sqrt(k m)')

    def apply(self, setup):
        """Return the setup with the damper."""
        row = row_between(setup, self.freedom, self.to)
        size = 2 * math.sqrt(stiffness_between(setup.system, row) * mass_at(setup.system, row))
        return joined(setup, 'damping', row, self.ratio * size)
