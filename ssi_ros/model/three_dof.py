"""
The paper's three masses in a row, section 5.1, and its three excitations.

m = 1 kg and k = 10000 N/m throughout, force on mass 3, displacement of mass 1 measured. The
paper's damping matrix is not public: 0.5 % of every mode is ours.
"""
import numpy as np
from scipy.linalg import eigh

from ssi_ros.model.disturbances import Sine
from ssi_ros.model.excitation import White
from ssi_ros.model.sensors import Noise
from ssi_ros.model.system import System

LINE_HZ = 12.0
EXCITATIONS = ('white', 'white_and_sine', 'sine')


def three_dof(damping_ratio=0.005, mass_kg=1.0, stiffness_n_m=1e4, rate_hz=100.0,
              noise_rms_m=1e-6):
    """
    Build the 3-DOF chain, eq. (37) of docs/theory.md.

    Parameters
    ----------
    damping_ratio : float
        Of every mode [1].
    mass_kg, stiffness_n_m : float
        Of every mass [kg] and every spring [N/m].
    rate_hz : float
        Sampling rate [Hz].
    noise_rms_m : float
        White noise of the displacement sensor [m], ours.

    Returns
    -------
    System
        With the white excitation of 1 N rms at 100 Hz.

    """
    mass = mass_kg * np.eye(3)
    stiffness = stiffness_n_m * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    squares, shapes = eigh(stiffness, mass)
    half = mass @ shapes
    damping = (half * (2 * damping_ratio * np.sqrt(squares))) @ half.T
    return System(
        mass=mass, damping=damping, stiffness=stiffness, input=np.array([[0.0], [0], [1]]),
        sensor=np.array([[1.0, 0, 0]]), dofs=('x1', 'x2', 'x3'), inputs=('force_3',),
        channels=('x1',), excitation=excitation_of('white'),
        chain=(Noise((noise_rms_m,)),), rate_hz=rate_hz,
        measured='displacement')


def excitation_of(case):
    """
    Return the parts of one of the paper's three cases.

    'white'; 'white_and_sine', its stationary non-white excitation; 'sine', a pure sine, which
    shows the modes only by the transient of a start at rest.
    """
    white, sine = White('force', ('force_3',), (1.0,)), Sine('force_3', 1.0, LINE_HZ)
    cases = dict(zip(EXCITATIONS, ((white,), (white, sine), (sine,))))
    if case not in cases:
        raise ValueError(f'case={case!r} is not known; it must be one of {", ".join(EXCITATIONS)}')
    return cases[case]
