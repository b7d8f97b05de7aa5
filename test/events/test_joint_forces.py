"""Nonlinear forces between points of a model, in records that are integrated apart from it."""
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

from examples.shear_building import shear_building
import numpy as np
import pytest
from ssi_ros.gap.comparison import Detection
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.selection.conclusion import is_inside
from ssi_ros.open_set.force_between import beside_simulated
from validation.gap_joint_forces import linear, nonlinear, shown, storey

LAWS = {
    'hardening spring': lambda x, v: 0.03 * x ** 3,
    'softening spring': lambda x, v: -0.015 * x ** 3,
    'uneven spring': lambda x, v: 0.2 * np.maximum(x, 0.0),
    'rising damping': lambda x, v: 0.2 * v * np.abs(v),
    'falling damping': lambda x, v: 0.2 * np.tanh(5 * v)}


@lru_cache(maxsize=None)
def record(family, seconds=600.0):
    """Return a record of the building with a law in its third storey."""
    model = shear_building()
    return nonlinear(model, seconds, np.random.default_rng(1), storey(model, LAWS[family]))


@pytest.mark.parametrize('family', LAWS)
def test_a_law_is_found_with_its_kind_and_place(family):
    """No effect has to be fitted for that."""
    best = min(shown(shear_building(), record(family)), key=lambda d: d.p_value)
    assert best.p_value < 1e-6 and best.basis == family and best.site == 'structure'
    assert 'between floor_2 and floor_3' in best.text


@pytest.mark.parametrize('depths', [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5)])
def test_linear_motion_has_none(depths):
    """Also where the level of all forces, or of one of them, varies."""
    for seed in range(5):
        assert all(d.p_value > 1e-3 for d in shown(
            shear_building(), linear(shear_building(), 300.0, seed, depths)))


def test_a_law_that_no_effect_has_is_unexplained():
    """Damping that rises is neither friction nor a damper, and the joint is named."""
    found = diagnose(shear_building(), record('rising damping'))
    assert found.outcome == 'UNEXPLAINED'
    assert 'damping between floor_2 and floor_3' in found.reason
    assert found.where.site['structure'] > 0.9


def test_what_a_fit_makes_is_no_more_than_that():
    """Records that the fit simulates show as much, show less, or show what is not there."""
    shown_as_well = {'rising damping': [1e-20, 1e-24, 1e-18]}
    assert beside_simulated({'rising damping': 1e-21}, shown_as_well, 3) > 0.1
    assert beside_simulated({'rising damping': 1e-90}, shown_as_well, 3) < 1e-5
    assert beside_simulated({}, shown_as_well, 3) < 1e-5
    assert beside_simulated({'rising damping': 1e-21}, {}, 3) < 1e-12
    assert beside_simulated({}, {}, 3) == 1.0


def test_a_force_of_a_small_chance_leaves_friction_explained():
    """One p-value of a hundredth among those of many tests is nothing."""
    force = Detection('', {}, 7e-3, 'A force.', basis='falling damping')
    ranked = SimpleNamespace(by_law=72.0, inside=True)
    for p_value, inside in ((0.25, True), (1e-9, False)):
        assert is_inside(ranked, SimpleNamespace(
            p_value=p_value, anomalies=(replace(force, p_value=min(7e-3, p_value)),))) == inside
