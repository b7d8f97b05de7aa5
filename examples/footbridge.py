"""
Write a footbridge as a model of modes: `python examples/footbridge.py bridge.npz`.

A simply supported span of 36 m and 1200 kg/m (Blevins, Formulas for Natural Frequency and Mode
Shape, table 8-1): bending at n^2 1.9 Hz, torsion at n 4.6 Hz. Pedestrians push at three places.
Accelerometers on both edges, a geophone and a strain gauge.
"""
import sys

import numpy as np

from ssi_ros.model import Channel, Input, modal_model, save_model

SPAN_M, MASS_KG_M, HALF_WIDTH_M, GYRATION_M = 36.0, 1200.0, 1.5, 0.9
BENDING_HZ, TORSION_HZ, FIBRE_M = 1.9, 4.6, 0.4     # FIBRE_M: gauge below the neutral axis
MODES = (('bending', 1), ('torsion', 1), ('bending', 2), ('torsion', 2), ('bending', 3))


def displacement(kind, n, at_m, across_m):
    """Return what a mode of mass 1 moves a point of the deck up by."""
    wave = np.sin(n * np.pi * at_m / SPAN_M) / np.sqrt(MASS_KG_M * SPAN_M / 2)
    return wave if kind == 'bending' else wave * across_m / GYRATION_M


def strain(kind, n, at_m):
    """Return the longitudinal strain of a mode at the gauge, which torsion does not reach."""
    curvature = (n * np.pi / SPAN_M) ** 2 * displacement(kind, n, at_m, 0.0)
    return FIBRE_M * curvature if kind == 'bending' else 0.0


def footbridge():
    """Return the LinearModel."""
    places = {'north_mid': (18.0, HALF_WIDTH_M), 'south_mid': (18.0, -HALF_WIDTH_M),
              'north_quarter': (9.0, HALF_WIDTH_M), 'geophone': (12.0, -HALF_WIDTH_M)}
    steps = {'steps_a': (7.0, 1.0), 'steps_b': (16.0, -0.5), 'steps_c': (29.0, 0.3)}
    shapes = [[displacement(*m, *p) for m in MODES] for p in places.values()]
    shapes.append([strain(*m, 14.0) for m in MODES])
    kinds = ('acceleration',) * 3 + ('velocity', 'strain')
    noise = (5e-4,) * 3 + (1e-5, 2e-9)
    return modal_model(
        [n ** 2 * BENDING_HZ if kind == 'bending' else n * TORSION_HZ for kind, n in MODES],
        0.008, shapes, np.array([[displacement(*m, *p) for p in steps.values()] for m in MODES]),
        drives=tuple(Input(name, 100.0, corner_hz=12.0, group='steps') for name in steps),
        sensors=tuple(map(Channel, (*places, 'strain_14'), kinds, noise)), rate_hz=80.0)


if __name__ == '__main__':
    save_model(footbridge(), sys.argv[1])
