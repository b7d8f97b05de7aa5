"""A frame with a sensor on every floor: its modes are no more than channels, all are separable."""
import numpy as np
from reference_records import diagnose_reference
from scipy.signal import cont2discrete, lfilter
from ssi_ros.records import Samples

RATE_HZ, SECONDS, SETTLING = 100.0, 200.0, 1000
STIFFNESS = 60.0, 60.0, 60.0        # of storeys on a free base, (2 pi rad/s)^2 of unit masses
DAMPING = 0.012


def record(seed, stiffness=STIFFNESS, added=0.0):
    """Return accelerations of four floors of which the lowest is shaken, one mass being more."""
    rng = np.random.default_rng(seed)
    force = rng.standard_normal(int(SECONDS * RATE_HZ) + SETTLING)
    ends = np.diff(np.eye(4), axis=0)
    masses = np.array([1.0, 1.0 + added, 1.0, 1.0])
    root = np.sqrt(np.outer(masses, masses))
    squares, modes = np.linalg.eigh(ends.T @ np.diag(stiffness) @ ends / root)
    modes = modes / np.sqrt(masses)[:, None]
    values = 0.0
    for square, mode in zip(squares[1:], modes.T[1:]):
        omega = 2 * np.pi * np.sqrt(square)
        b, a, _ = cont2discrete(([1.0, 0, 0], [1.0, 2 * DAMPING * omega, omega ** 2]), 1 / RATE_HZ)
        values = values + np.outer(lfilter(np.ravel(b), a, mode[0] * force)[SETTLING:], mode)
    values = values + 0.05 * rng.standard_normal(values.shape) * values.std()
    return Samples(values, RATE_HZ, ('base', 'one', 'two', 'three'))


def test_a_softer_storey_is_a_change_of_the_structure():
    """A fifth of one of three storeys: two modes move by 5 %, and the shapes of both turn."""
    found = diagnose_reference(record(1), record(2, (60.0, 47.0, 60.0)))
    assert found.outcome in ('EXPLAINED', 'TIED')
    assert 'stiffness_scale' in found.verdict['class']
    assert found.where.site['structure'] > 0.7


def test_a_mass_is_not_the_fault_of_a_sensor():
    """Modes moved: of what leaves something, nothing that moves none is the nearest."""
    found = diagnose_reference(record(3), record(4, added=0.2))
    assert found.where.site['structure'] > 0.9
    assert found.candidates[0].effects[0] in ('stiffness_scale', 'added_mass')
