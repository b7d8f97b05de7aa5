"""
Add an effect of your own, inject it, and let the diagnosis find it.

In a package of your own the class stands in a module that an entry point of the group
`ssi_ros.effects` names; nothing else is needed. Here it is simply defined. A detector, where no
spectrum shows an effect, would stand beside it: see docs/how-to/own-effect.md.
"""
from dataclasses import replace
from math import isfinite

import numpy as np

from ssi_ros.effects import Effect, effect, inject, ModalPattern, simulate_setup, Site
from ssi_ros.gap.driver import diagnose
from ssi_ros.model import displacement_row, load_spacecraft, natural_modes
from ssi_ros.quantity import quantity


@effect
class CableLoom(Effect):
    """A cable from the hub to a point of an array pulls it back, K -> K + k r r^T."""

    name = 'cable_loom'
    site = Site.STRUCTURE
    size = 'stiffness_n_m'                  # null here: no effect
    reference = 'strain energy of a spring between hub and array'
    starts = {'stiffness_n_m': (1.0,)}      # where fits begin, and what scores it
    patterns = (ModalPattern.MODE_FREQUENCIES,)     # what a recording without a model shows of it

    array: str = quantity('E1', doc='array')
    stiffness_n_m: float = quantity(0.0, unit='N/m', low=0.0, high=1e4, doc='of the cable')
    along_m: float = quantity(6.0, unit='m', low=0.0, high=1e3, doc='distance from the root')

    def apply(self, setup):
        """Return the setup with the cable in its stiffness matrix."""
        # r X is the point's displacement; without theta's part it is that relative to the hub
        row = displacement_row(setup.spacecraft, self.array, self.along_m, 0.0)
        row = np.where([d.startswith('theta') for d in setup.system.dofs], 0.0, row)
        stiffness = setup.system.stiffness + self.stiffness_n_m * np.outer(row, row)
        return replace(setup, system=replace(setup.system, stiffness=stiffness))


spacecraft = load_spacecraft('config/spacecraft.yaml')
setup = inject(spacecraft, [CableLoom(stiffness_n_m=4.0)], 300.0)
for name, system in (('nominal', inject(spacecraft).system), ('with the cable', setup.system)):
    print(f'{name}: ' + ' '.join(f'{f:.3f}' for f in natural_modes(system).frequencies_hz[:6]))
found = diagnose(spacecraft, simulate_setup(setup, seed=3),
                 effects=['cable_loom', 'stiffness_scale', 'sensor_gain'], pairs=False)
print(f'{found.outcome}: {found.reason}')
for name, value in found.candidates[0].parameters.items():
    known = f'standard deviation {value.std:.2g}' if isfinite(value.std) else 'not fitted'
    print(f'  {name} = {value.value:.4g} {value.unit}, {known}')
