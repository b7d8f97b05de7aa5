"""A spring between two points that the model does not have, or one that is softer."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.places import GROUND
from ssi_ros.effects.points import joined, row_between, stiffness_between
from ssi_ros.quantity import quantity


@effect
class ConnectionStiffness(Effect):
    """
    A spring of `share` times the stiffness between two points, K -> K + share k r^T r.

    k = 1 / r K^-1 r^T is what a slow pull between them feels; in a chain that is the spring
    between them, so that -0.1 takes a tenth of it away.
    """

    name = 'connection_stiffness'
    site = Site.STRUCTURE
    size = 'share'
    reference = 'Przemieniecki, Theory of Matrix Structural Analysis, 1968 (spring element)'
    starts = {'share': (-0.002, 0.002)}
    needs = ('points',)
    patterns = ModalPattern.MODE_FREQUENCIES, ModalPattern.CHANNEL_SHAPE

    freedom: str = quantity('', doc='point, see `ssi_ros model FILE`')
    to: str = quantity(GROUND, doc='the other point, or ground')
    share: float = quantity(0.0, low=-0.99, high=100.0, doc='added stiffness over k')

    def apply(self, setup):
        """Return the setup with the spring."""
        row = row_between(setup, self.freedom, self.to)
        return joined(setup, 'stiffness', row, self.share * stiffness_between(setup.system, row))
