"""The coupled model: frequencies, laws of mechanics, limits."""
from dataclasses import replace

import numpy as np

from ssi_ros.model import assemble, natural_modes, Spacecraft
from ssi_ros.model.plate import plate_modes
from ssi_ros.model.simulator import propagate
from ssi_ros.model.spacecraft import Hub, Plate
from validation.report import table, write

REFERENCE_HZ = (0.361, 0.693, 2.260, 2.437, 2.918, 2.982, 6.345, 6.445, 9.009, 9.033, 12.484,
                12.557, 15.828, 15.844, 20.707, 20.767, 23.768, 23.782, 30.978, 31.030)


def main():
    """Write the report."""
    craft = Spacecraft()
    system = assemble(craft)
    modes = natural_modes(system)
    fine = replace(craft, arrays=tuple(
        replace(a, plate=Plate(elements_along=32, elements_across=8)) for a in craft.arrays))
    best = natural_modes(assemble(fine)).frequencies_hz
    kind = ['equal' if (s[0] / s[2]).real > 0 else 'opposite' for s in modes.shapes.T]
    lines = ['First 20 modes; the reference is a separate plate FEM (16 x 4 elements), rounded to '
             '0.001 Hz; "fine" is ours on 32 x 8 elements.', '',
             *table(['mode', 'arrays move', 'ours [Hz]', 'reference [Hz]', 'difference %',
                     'fine [Hz]', 'damping %'],
                    [[i + 1, kind[i], f'{f:.4f}', r, f'{100 * (f / r - 1):+.3f}', f'{b:.4f}',
                      f'{100 * xi:.3f}'] for i, (f, r, b, xi) in enumerate(
                          zip(modes.frequencies_hz, REFERENCE_HZ, best, modes.damping_ratios))])]
    lines += ['Laws:', '', *table(['check', 'found'], [
        ['energy over 10^5 steps of 0.01 s, no damping, no torque: largest relative change',
         f'{energy_drift():.1e}'],
        ['frequencies with a hub of 10^9 times the inertia against the cantilever, largest '
         'relative difference', f'{rigid_limit():.1e}'],
        ['symmetry: largest difference of the shapes of the two arrays in a mode',
         f'{np.max(np.abs(np.abs(modes.shapes[0]) - np.abs(modes.shapes[2]))):.1e}']])]
    write('spacecraft', 'Coupled spacecraft', lines)


def energy_drift():
    """Return the largest relative change of eq. (4) over 10^5 steps of a free vibration."""
    craft = Spacecraft()
    craft = replace(craft, arrays=tuple(replace(a, damping_ratio=0.0) for a in craft.arrays))
    system = assemble(craft)
    space = system.plant
    sampled = space.discrete(100.0)
    z = sampled.inverse @ np.random.default_rng(1).standard_normal(len(space.states))
    n = len(space.states) // 2
    h, j = system.mass[:3, 3:], system.mass[:3, :3]
    # With no momentum of the whole, J theta' = -H eta', so the hub's share is negative.
    mass = np.eye(n) - h.T @ np.linalg.solve(j, h)
    energies = []
    for _ in range(101):
        x = ((sampled.vectors * sampled.weight) @ z).real
        energies.append(x[n:] @ mass @ x[n:] + x[:n] @ system.stiffness[3:, 3:] @ x[:n])
        _, z = propagate(sampled, np.zeros((1000, len(system.inputs))), z)
    return np.max(np.abs(np.array(energies) / energies[0] - 1))


def rigid_limit():
    """Return the largest relative difference from the cantilever with a huge hub."""
    huge = tuple(map(tuple, (1e9 * np.array(Hub().inertia_kg_m2)).tolist()))
    found = natural_modes(assemble(Spacecraft(hub=Hub(huge)))).frequencies_hz
    return np.max(np.abs(found / np.repeat(plate_modes(Plate(), 10).frequencies_hz, 2) - 1))


if __name__ == '__main__':
    main()
