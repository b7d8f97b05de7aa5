"""A drift of stiffness at few instants: spectra at all others follow from these."""
from dataclasses import replace

import numpy as np
import pytest
from ssi_ros.effects import inject, parse_effect
from ssi_ros.effects.drifting import drifting
from ssi_ros.effects.edits import scale_stiffness
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.expected_periodogram import steady
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.hermitian import inverse_root, white_vectors
from ssi_ros.model import load_spacecraft
from ssi_ros.weighted_sums import each_of, interpolated, WeightedSum

SECONDS = 600.0
TIMES_S = 60.0 * np.arange(10) + 30.0


def drifting_setup(change):
    """Return the setup of the default spacecraft whose stiffness drifts."""
    return inject(load_spacecraft(), (parse_effect(f'stiffness_drift:change={change}'),), SECONDS)


def test_few_nodes_give_the_spectra_of_all_times():
    """A drift of 0.2 %, a fifth of a half-power bandwidth: six nodes or fewer, to 1e-4."""
    setup = drifting_setup(0.002)
    frame = make_frame(60_000, 100.0, DiagnosisSettings())
    nodes, weights = drifting(setup, TIMES_S)
    assert 1 < len(nodes) <= 6
    found = each_of(interpolated(weights, [steady(n, frame, None).at_nominal for n in nodes]))
    for time_s, spectrum in zip(TIMES_S, found):
        arrays = [a.name for a in setup.spacecraft.arrays]
        there = replace(setup, drift=0.0, system=scale_stiffness(
            setup.system, arrays, 1.0 + setup.drift * time_s / SECONDS))
        exact = steady(there, frame, None).at_nominal
        assert np.abs(white_vectors(inverse_root(exact), spectrum[None] - exact)).max() < 1e-4


@pytest.mark.parametrize('change', [0.05, -0.2])
def test_a_large_drift_is_computed_at_every_time(change):
    """Resonances move by many bandwidths: nothing is interpolated."""
    nodes, weights = drifting(drifting_setup(change), TIMES_S)
    assert len(nodes) == len(TIMES_S)
    assert np.array_equal(weights, np.eye(len(TIMES_S)))


def test_parts_of_a_level_that_varies_keep_their_own():
    """Spectra that differ between the parts are interpolated part by part."""
    nodes, weights = drifting(drifting_setup(0.002), TIMES_S)
    parts = np.arange(len(TIMES_S), dtype=complex)[:, None]
    assert interpolated(weights, [parts] * len(nodes)) == pytest.approx(parts)
    each = np.stack([parts[:, 0].real, np.ones(len(TIMES_S))], axis=1)
    varying = WeightedSum(np.array([[1j], [2.0]]), each)
    assert interpolated(weights, [varying] * len(nodes)).each == pytest.approx(varying.each)
