"""A small modal simulator for the tests, independent of `ssi_ros.model`."""
import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter


def accelerations(frequencies_hz, shapes, duration_s, rng, damping=0.005, rate_hz=100.0,
                  noise=0.002):
    """Simulate modes that are driven by independent white forces; shape (n, l)."""
    n = int(duration_s * rate_hz)
    warm = int(30.0 * rate_hz)
    values = np.zeros((n, shapes.shape[1]))
    for f, shape in zip(frequencies_hz, shapes):
        w = 2.0 * np.pi * f
        a = np.array([[0.0, 1.0], [-w * w, -2.0 * damping * w]])
        step = expm(np.block([[a, np.array([[0.0], [1.0]])], [np.zeros((1, 3))]]) / rate_hz)
        a, b = step[:2, :2], step[:2, 2]
        c = np.array([-w * w, -2.0 * damping * w])
        p, q = -np.trace(a), np.linalg.det(a)
        top = [1.0, c @ b + p, c @ a @ b + p * (c @ b) + q]
        force = rng.standard_normal(n + warm) * 0.01
        values += np.outer(lfilter(top, [1.0, p, q], force)[warm:], shape)
    return values + noise * rng.standard_normal(values.shape)


PAIR_HZ = np.array([6.345, 6.445, 15.828, 15.844])
PAIR_SHAPES = np.array([[1.0, 0.9, 1.0, 0.9], [1.0, 0.9, -1.0, -0.9],
                        [1.0, -0.9, 1.0, -0.9], [1.0, -0.9, -1.0, 0.9]])
