"""Numbers of a hinge that sticks, which its equivalent linear hinge gets wrong."""
from gap_records import evidence_of, record
import numpy as np
import pytest
from ssi_ros.bootstrap.indirect_inference import indirect_estimate
from ssi_ros.effects import parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.updating.model_uncertainty import no_uncertainty

SECONDS = 120.0
FRICTION = parse_effect('hinge_friction:array=E1,torque_n_m=0.2,stiffness_n_m_rad=2e5')


def fitted(effect):
    """Return the model side and the fit of a record with an effect."""
    samples, simulator = record(SECONDS, [effect], 7)
    return simulator, fit(simulator, evidence_of(simulator, samples), Candidate((effect,)))


@pytest.mark.slow
def test_friction_is_corrected_by_what_its_fit_errs_on_its_own_records():
    """A hinge that sticks half of the time: its stiffness was two fifths too large."""
    simulator, found = fitted(FRICTION)
    (before,) = found.candidate.effects
    made = indirect_estimate(simulator, found, no_uncertainty(simulator.frame, 4), 8)
    (after,) = made.candidate.effects
    errors = [abs(np.log(e.stiffness_n_m_rad / FRICTION.stiffness_n_m_rad))
              for e in (before, after)]
    assert errors[1] < min(0.2, 0.6 * errors[0]) and made.spread > 1
    assert abs(after.torque_n_m / FRICTION.torque_n_m - 1) < 0.2


def test_a_linear_effect_is_its_fit():
    """Nothing is simulated for an exact spectrum."""
    simulator, found = fitted(parse_effect('hub_inertia:scale=1.1'))
    made = indirect_estimate(simulator, found, no_uncertainty(simulator.frame, 4), 8)
    assert made.candidate is found.candidate and made.levels is found.levels


@pytest.mark.parametrize('channel', ['e1_a', 'e2_a'])
def test_a_correction_stays_where_a_sensor_can_be(channel):
    """Beside a hinge, a sensor 0.01 mm from the edge of its array is not moved off it."""
    moved = parse_effect(f'sensor_misplacement:channel={channel},lateral_m=0.09999')
    samples, simulator = record(60.0, [FRICTION, moved], 9)
    found = fit(simulator, evidence_of(simulator, samples), Candidate((FRICTION, moved)))
    made = indirect_estimate(simulator, found, no_uncertainty(simulator.frame, 4), 8)
    assert made.candidate.effects[1].lateral_m <= 0.1
