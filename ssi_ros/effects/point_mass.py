"""A point of a model is heavier or lighter, as with a payload."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.effects.places import GROUND
from ssi_ros.effects.points import joined, mass_at, row_between
from ssi_ros.quantity import quantity


@effect
class PointMass(Effect):
    """
    A mass, or inertia, of `share` times that of the point, M -> M + share m sum r^T r.

    m = 1 / r M^-1 r^T is what a sudden push at the point feels; of a lumped mass that is the mass.
    Points joined by + are one node in several directions, which a mass has alike: m is that of
    the first.
    """

    name = 'point_mass'
    site = Site.STRUCTURE
    size = 'share'
    reference = 'kinetic energy of a point mass; docs/theory.md, eq. (15)'
    starts = {'share': (-0.005, 0.005)}
    needs = ('points',)
    nodes = True
    patterns = ModalPattern.MODE_FREQUENCIES, ModalPattern.CHANNEL_SHAPE

    freedom: str = quantity('', doc='point, see `ssi_ros model FILE`, or points joined by +')
    share: float = quantity(0.0, low=-0.9, high=100.0, doc='added mass over m')

    def apply(self, setup):
        """Return the setup with the mass."""
        rows = [row_between(setup, name, GROUND) for name in self.freedom.split('+')]
        mass = self.share * mass_at(setup.system, rows[0])
        for row in rows:
            setup = joined(setup, 'mass', row, mass)
        return setup
