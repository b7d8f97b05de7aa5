"""The records on which the packages are compared, and how close an answer is to the truth."""
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

RATE_HZ = 100.0
GATE = 0.02             # a pole within 2 % of a true frequency and MAC above `ALIKE` is it
ALIKE = 0.3             # two sound shapes of four channels that are not alike have less


@dataclass(frozen=True)
class Truth:
    """What a record was made of: frequencies [Hz], damping ratios [1] and shapes, (p, l)."""

    frequency_hz: np.ndarray
    damping_ratio: np.ndarray
    shapes: np.ndarray


def modal_record(truth, duration_s, seed, noise=0.05, common=0.0):
    """
    Simulate modes under white forces; accelerations, shape (n, 4).

    Every mode is stepped exactly for a force that is held over a sample. The noise is `noise`
    times the rms of a channel, as in the comparison from which the peers' times are known. All
    forces have `common` as their correlation: only then are the covariances of a close pair not
    symmetric, and transposed lags seen.
    """
    rng = np.random.default_rng(seed)
    n, dt = int(duration_s * RATE_HZ), 1.0 / RATE_HZ
    warm = int(3.0 / (truth.damping_ratio * 2.0 * np.pi * truth.frequency_hz).min() * RATE_HZ)
    values = np.zeros((n, truth.shapes.shape[1]))
    shared = rng.standard_normal(n + warm)
    for f, xi, shape in zip(truth.frequency_hz, truth.damping_ratio, truth.shapes):
        w = 2.0 * np.pi * f
        mu = np.exp((-xi * w + 1j * w * np.sqrt(1.0 - xi ** 2)) * dt)
        p, q = -2.0 * mu.real, abs(mu) ** 2
        # acceleration of an oscillator, step response e^{-xi w t} (cos - xi / sqrt(1 - xi^2) sin):
        # numerator from its first two values, the response to a held unit force
        turned = np.exp(-xi * w * dt) * (np.cos(w * np.sqrt(1.0 - xi ** 2) * dt)
                                         - xi / np.sqrt(1.0 - xi ** 2)
                                         * np.sin(w * np.sqrt(1.0 - xi ** 2) * dt))
        top = [1.0, turned + p - 1.0, -(turned + p)]
        # an equal acceleration from every mode
        force = np.sqrt(xi / w) * (np.sqrt(common) * shared + np.sqrt(1.0 - common)
                                   * rng.standard_normal(n + warm))
        values += np.outer(lfilter(top, [1.0, p, q], force)[warm:], shape)
    return values + noise * values.std(axis=0) * rng.standard_normal(values.shape)


def ten_modes():
    """Return ten modes between 1.8 and 42 Hz, 1 % damped, with unlike shapes."""
    rng = np.random.default_rng(20160627)
    f = np.array([1.8, 3.1, 5.2, 8.4, 11.9, 16.3, 21.7, 27.5, 34.2, 41.8])
    return Truth(f, np.full(10, 0.01), rng.standard_normal((10, 4)))


def twin_arrays():
    """Return two close pairs of twin arrays: 0.1 % and 1.5 % apart, unlike in shape only."""
    f = np.array([6.345, 6.445, 15.828, 15.844])
    shapes = np.array([[1.0, 0.9, 1.0, 0.9], [1.0, 0.9, -1.0, -0.9],
                       [1.0, -0.9, 1.0, -0.9], [1.0, -0.9, -1.0, 0.9]])
    return Truth(f, np.full(4, 0.005), shapes)


def spacecraft():
    """Return the truth of the spacecraft, and the function (duration_s, seed) -> record."""
    from ssi_ros.model import assemble, load_spacecraft, natural_modes, simulate
    system = assemble(load_spacecraft())
    modes = natural_modes(system)
    pick = (modes.frequencies_hz > 0.1) & (modes.frequencies_hz < 32.0)
    truth = Truth(modes.frequencies_hz[pick], modes.damping_ratios[pick], modes.shapes.T[pick])
    return truth, lambda duration_s, seed: simulate(system, duration_s, seed).values


def mac(a, b):
    """Return |a^H b|^2 / (a^H a)(b^H b) of every shape of `a` with every one of `b`."""
    cross = np.abs(a.conj() @ b.T) ** 2
    return cross / np.outer((np.abs(a) ** 2).sum(axis=1), (np.abs(b) ** 2).sum(axis=1))


def match(truth, f, shapes):
    """
    Return for every true mode the index of its pole, -1 where there is none.

    Of the poles within `GATE` the nearest one counts; one that serves another mode better is not
    used twice. Shapes only keep the two modes of a close pair apart: the MAC must exceed `ALIKE`.
    """
    found = np.full(len(truth.frequency_hz), -1)
    if not len(f):
        return found
    step = np.abs(f - truth.frequency_hz[:, None]) / truth.frequency_hz[:, None]
    likeness = mac(truth.shapes.astype(complex), shapes)
    cost = np.where((step < GATE) & (likeness > ALIKE), step + 0.01 * (1.0 - likeness), np.inf)
    while np.isfinite(cost).any():
        a, b = np.unravel_index(cost.argmin(), cost.shape)
        found[a] = b
        cost[a], cost[:, b] = np.inf, np.inf
    return found
