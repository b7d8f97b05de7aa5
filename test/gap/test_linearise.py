"""Equivalent linear hinges: the search for them may begin anywhere near."""
from dataclasses import replace

import numpy as np
import pytest

from ssi_ros.effects import inject, parse_effect, statistical_linearisation as module
from ssi_ros.effects.statistical_linearisation import linearise
from ssi_ros.model import load_spacecraft


@pytest.mark.parametrize('text', [
    'hinge_friction:array=E2,torque_n_m=0.05,stiffness_n_m_rad=2e5',
    'hinge_freeplay:array=E1,gap_rad=3e-6,stiffness_n_m_rad=1e5'])
def test_a_search_that_begins_near_ends_where_any_other_does(text, monkeypatch):
    """What a fit hands on from one trial to the next saves steps and changes nothing else."""
    effect, spacecraft = parse_effect(text), load_spacecraft()
    near = linearise(inject(spacecraft, [effect], 60.0)).near
    moved = replace(effect, stiffness_n_m_rad=1.001 * effect.stiffness_n_m_rad)
    setup = inject(spacecraft, [moved], 60.0)
    steps = []
    follow = module._Hinge.follow
    monkeypatch.setattr(module._Hinge, 'follow',
                        lambda self, *of: steps.append(1) or follow(self, *of))
    there = linearise(setup)
    cold, steps[:] = len(steps), []
    again = linearise(replace(setup, near=near))
    assert len(steps) < cold
    at, far = there.near[0], near[0]
    # ten times as near as the change that a difference quotient is taken of
    assert np.abs(again.near[0] - at).max() < 0.1 * np.abs(far - at).max()


def test_parseval_gives_the_motion_its_variance():
    """The series of the lines of an angle has the variance that the state has."""
    setup = inject(load_spacecraft(), [parse_effect(
        'hinge_freeplay:array=E1,gap_rad=3e-6,stiffness_n_m_rad=1e5')], 60.0)
    system, hinge = setup.system, module._Hinge(setup.system, setup.laws[0])
    covariance = sum(p.covariance(100.0, system.inputs) for p in system.excitation)
    sampled = system.plant.discrete(100.0)
    lines, _ = hinge.motion(sampled, covariance, system, 1)
    row = np.array([dict(zip(system.dofs, hinge.modes)).get(s, 0.0) for s in system.plant.states])
    # exact but for rounding
    assert module.irfft(lines, module.LENGTH).std() == pytest.approx(
        np.sqrt(row @ sampled.state_covariance(covariance) @ row), rel=1e-9)
