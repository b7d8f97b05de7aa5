# Licensed under the Apache License, Version 2.0.
"""How much a hinge is moved: what the sizes of its play, friction and cubic stiffness rest on."""
from blindgen.cases.draw import draw_case, SCOPES
from blindgen.cases.make import hash_of_scope, scope_of
from blindgen.cases.plan import drafts
from blindgen.effects import library, sensing  # noqa: F401  (they declare the effects)
from blindgen.effects.base import channel_rms, EFFECTS, motion_rms
from blindgen.physics.excitation import input_responses, input_rms
from blindgen.physics.record import simulate
from blindgen.physics.scenario import Scenario
from blindgen.physics.sensors import instants, Spoiling
from blindgen.physics.spectrum import response
from blindgen.sizes.information import Record
import numpy as np
import pytest


@pytest.mark.parametrize('seed', [4488908146213515823, 499257957423930987, 1298152404049734146])
def test_the_moment_at_a_root_is_that_of_the_loads(seed):
    """It is no more than the torque and the modal forces can give, on any spacecraft."""
    craft = draw_case(seed, SCOPES['small']).nominal
    for array in range(len(craft.names)):
        moment = motion_rms(craft, array, 'root')
        assert 1e-3 < moment / input_rms(Scenario(craft=craft)).max() < 3.0


@pytest.mark.parametrize('seed', [4132487152343210909, 1944861944123609832])
def test_no_input_is_seen_better_than_its_own_power_allows(seed):
    """S holds the response to an input times its power, at the instants of every sensor."""
    craft = draw_case(seed, SCOPES['small']).nominal
    record = Record(Scenario(craft=craft), 60.0)
    f = record.grid[0]
    seen = (record.root @ response(record.scenario, f))[:, :, 0]
    own = input_rms(record.scenario)[0] * np.abs(input_responses(record.scenario, f)[:, 0])
    assert np.all(np.sum(np.abs(seen)**2, axis=1) * own**2 < 1 + 1e-6)


@pytest.mark.parametrize('name', sorted(SCOPES))
def test_a_scope_is_known_by_its_hash_and_says_how_large_effects_are(name):
    """A commitment names its scope by a hash; targets are between the two sizes of the scope."""
    scope = SCOPES[name]
    assert scope_of({'scope_sha256': hash_of_scope(scope)}) == scope
    plan = drafts(60, 1, scope)
    targets = [t for _, effects, _ in plan for _, t in effects]
    assert scope.sizes[0] <= min(targets) < 2 * scope.sizes[0]
    assert scope.sizes[1] / 2 < max(targets) <= scope.sizes[1]
    assert (name == 'pairs') == (sum(kind == 'pair' for kind, *_ in plan) > 30)


def test_rounding_and_limits_leave_a_record():
    """At most a step of the rms of the quietest channel, a limit of a tenth of the loudest."""
    craft = draw_case(1944861944123609832, SCOPES['small']).nominal
    values, _ = simulate(Scenario(craft=craft), 60.0, 3)
    rms = channel_rms(craft)
    assert values.std(axis=0) == pytest.approx(rms, rel=0.3)
    rng = np.random.default_rng(0)
    step, limit = (EFFECTS[name].size(EFFECTS[name].draw(rng, craft, 60.0), EFFECTS[name].high)
                   for name in ('quantisation', 'saturation'))
    assert step['step_m_s2'] == pytest.approx(rms.min())
    assert limit['limit_m_s2'] == pytest.approx(rms.max() / 10)


def test_a_wrong_clock_stretches_the_scan_as_well():
    """A channel later in the scan is later by the same share of a longer period."""
    craft = draw_case(1944861944123609832, SCOPES['small']).nominal
    offsets = np.array([s.offset for s in craft.sensors])
    assert offsets.max() > 0.1
    when = instants(Scenario(craft=craft, ppm=1e4), 50, np.random.default_rng(0))
    assert when == pytest.approx(1.01 * (np.arange(50)[:, None] + offsets))


@pytest.mark.parametrize('seed', range(5))
def test_a_record_of_corrupted_samples_has_some(seed):
    """Two of the ninth campaign had none, of 0.9 and 1.5 runs in the mean."""
    y = np.ones((50, 2))
    Spoiling((0,), 1e-3, 3.0, 0.0, -1.0, 0.0, 1).act(y, np.random.default_rng(seed))
    assert (y[:, 0] == -1.0).any() and (y[:, 1] == 1.0).all()
