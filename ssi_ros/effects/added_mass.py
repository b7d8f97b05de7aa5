"""Something sits on an array that the model does not have."""
from dataclasses import replace

from ssi_ros.effects.base import Effect, effect, ModalPattern, Site
from ssi_ros.model.structure import add_point_mass, displacement_row
from ssi_ros.quantity import quantity


@effect
class AddedMass(Effect):
    """A point mass on an array, M -> M + m r r^T with r the displacement row of the point."""

    name = 'added_mass'
    site = Site.STRUCTURE
    size = 'mass_kg'
    reference = 'kinetic energy of a point mass; docs/theory.md, eq. (15)'
    # between nodes and bellies of the modes; every valley of the likelihood has one, eq. (104)
    starts = {'mass_kg': (0.01,), 'along_m': (
        0.8, 1.4, 2.0, 2.7, 3.3, 4.0, 4.6, 5.3, 6.0, 6.6, 7.2, 7.7), 'lateral_m': (-0.6, 0.0, 0.6)}
    follows = {'mass_kg': 'mass', 'along_m': 'length', 'lateral_m': 'width'}
    patterns = ModalPattern.MODE_FREQUENCIES, ModalPattern.CHANNEL_SHAPE

    array: str = quantity('E1', doc='array')
    mass_kg: float = quantity(0.0, unit='kg', low=0.0, high=1e3, doc='mass')
    along_m: float = quantity(7.0, unit='m', low=0.0, high=1e3, doc='distance from the root')
    lateral_m: float = quantity(0.0, unit='m', low=-1e3, high=1e3, doc='position along x_b')

    def apply(self, setup):
        """Return the setup with the mass on the array."""
        row = displacement_row(setup.spacecraft, self.array, self.along_m, self.lateral_m)
        full = [*row, *[0.0] * (len(setup.system.dofs) - len(row))]
        return replace(setup, system=add_point_mass(setup.system, full, self.mass_kg))
