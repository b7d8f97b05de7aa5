"""The spreads are derivatives, and they are as large as the scatter."""
from dataclasses import replace

import numpy as np
import pytest
from simple_structure import accelerations, PAIR_HZ, PAIR_SHAPES
from ssi_ros.identify import Identification, identify
from ssi_ros.identify.lags import Ring
from ssi_ros.identify.realise import factorise, poles_of
from ssi_ros.identify.spread import block_spectra, changes, functionals
from ssi_ros.records import Samples


def test_functionals_are_the_derivatives(rng):
    """They predict what a small change of the lags does to a pole and to its shape."""
    rows = 12
    ring = Ring(1, 2 * rows - 1, 4)
    ring.push(accelerations(PAIR_HZ[:2], PAIR_SHAPES[:2], 120.0, rng))
    base = ring.covariances(120.0)
    factors = factorise(base, rows, 20, 'upc')
    poles, = poles_of(factors, [4], 100.0)
    change = 1e-6 * rng.standard_normal(base.values.shape)
    change[0] = 0.0
    block = replace(base, blocks=change.reshape(1, -1))
    told = changes(*functionals(factors, poles, np.arange(2), rows), block_spectra(block, rows))
    moved, = poles_of(factorise(replace(base, values=base.values + change), rows, 20, 'upc'),
                      [4], 100.0)
    before, after = poles.raw_shapes(), moved.raw_shapes()
    for k, mu in enumerate(poles.mu):
        # the shift residual of a finite record, of the order of the noise, is left out
        real = moved.mu[k] - mu
        assert abs(real - told[k, 0, 0]) < 0.15 * abs(real)
        # a shape has no scale: compare the ratios to its first component
        real = (after[k] / after[k, 0] - before[k] / before[k, 0])[1:]
        ratio = before[k] / before[k, 0]
        first_order = ((told[k, 1:, 0] - ratio * told[k, 1, 0]) / before[k, 0])[1:]
        assert np.linalg.norm(real - first_order) < 0.15 * np.linalg.norm(real)


@pytest.mark.parametrize('frequency_hz', [0.7, 15.828])
def test_spread_is_as_large_as_the_scatter(frequency_hz):
    """
    Predicted over empirical spread of 24 records; 24 seeds leave 15 % on a ratio.

    At 0.7 Hz a block of 6 s is shorter than the 23 s over which the mode's energy is remembered.
    """
    found = []
    for seed in range(24):
        values = accelerations([frequency_hz], PAIR_SHAPES[2:3], 120.0,
                               np.random.default_rng(seed), noise=1e-4)
        settings = Identification(window_s=120.0, hop_s=6.0)
        mode = min(identify(Samples(values, 100.0, tuple('abcd')), settings)[-1].modes,
                   key=lambda m: abs(m.frequency_hz - frequency_hz))
        found.append((mode.frequency_hz, mode.damping_ratio, mode.frequency_std_hz,
                      mode.damping_ratio_std))
    found = np.array(found)
    ratio = np.sqrt((found[:, 2:] ** 2).mean(axis=0)) / found[:, :2].std(axis=0, ddof=1)
    assert (ratio > 0.65).all() and (ratio < 1.5).all(), ratio


def test_spread_of_a_close_pair_of_shapes():
    """
    Predicted over empirical spread of the components of two shapes that mix.

    They are 4 half-widths apart, so that each leaks into the other.
    """
    found, shapes = [], np.array([[1.0, 0.6, 0.5, 0.3], [0.4, -0.6, 1.0, -0.5]])
    for seed in range(24):
        values = accelerations([15.0, 15.3], shapes, 120.0, np.random.default_rng(seed))
        settings = Identification(window_s=120.0, hop_s=6.0)
        modes = identify(Samples(values, 100.0, tuple('abcd')), settings)[-1].modes
        nearest = [min(modes, key=lambda m: abs(m.frequency_hz - f)) for f in (15.0, 15.3)]
        found.append([(m.shape, m.shape_std) for m in nearest])
    found = np.array(found)                                  # (seed, mode, shape or spread, l)
    seen = np.sqrt((np.abs(found[:, :, 0] - found[:, :, 0].mean(axis=0)) ** 2).mean(axis=0))
    told = np.sqrt((found[:, :, 1].real ** 2).mean(axis=0))
    largest = np.abs(shapes) == 1.0
    # the largest component is 1 by definition, so it has no spread
    np.testing.assert_allclose(told[largest], 0.0, atol=1e-12)
    ratio = told[~largest] / seen[~largest]
    # 24 seeds leave 11 % on the spread of a complex number
    assert (ratio > 0.65).all() and (ratio < 1.5).all() and 0.8 < np.median(ratio) < 1.25, ratio
