"""
Write a shear building as a model of matrices: `python examples/shear_building.py building.npz`.

Five floors of 45.4 t on springs of 5.52 MN/m (Chopra, Dynamics of Structures, section 12.8:
periods 2.00, 0.685, 0.435, 0.338 and 0.297 s), damping ratio 2 %, wind on every floor,
accelerometers on the floors 1, 3 and 5, and a GNSS receiver on the roof: displacement.
"""
import sys

import numpy as np
from scipy.linalg import eigh

from ssi_ros.model import Channel, Input, LinearModel, save_model

FLOORS, MASS_KG, STIFFNESS_N_M, DAMPING_RATIO = 5, 45_359.0, 5.523e6, 0.02
WIND_N = 300.0          # rms on every floor, held over a sample


def shear_building():
    """Return the LinearModel."""
    mass = MASS_KG * np.eye(FLOORS)
    stiffness = STIFFNESS_N_M * (2 * np.eye(FLOORS) - np.eye(FLOORS, k=1) - np.eye(FLOORS, k=-1))
    stiffness[-1, -1] = STIFFNESS_N_M       # nothing above the roof
    squares, shapes = eigh(stiffness, mass)
    half = mass @ shapes
    output = np.zeros((4, FLOORS))
    output[[0, 1, 2, 3], [0, 2, 4, 4]] = 1.0
    return LinearModel(
        mass, (half * (2 * DAMPING_RATIO * np.sqrt(squares))) @ half.T, stiffness,
        input=np.eye(FLOORS), output=output,
        freedoms=tuple(f'floor_{i + 1}' for i in range(FLOORS)),
        drives=tuple(Input(f'wind_{i + 1}', WIND_N, group='wind') for i in range(FLOORS)),
        sensors=(Channel('acc_1', 'acceleration', 1e-4), Channel('acc_3', 'acceleration', 1e-4),
                 Channel('acc_5', 'acceleration', 1e-4), Channel('gnss', 'displacement', 1e-4)),
        rate_hz=20.0)


if __name__ == '__main__':
    save_model(shear_building(), sys.argv[1])
