"""Starting values: what stands between them is seen, places follow the spacecraft."""
from dataclasses import replace

from gap_records import record
import numpy as np
import pytest
from ssi_ros.effects import effect_class, parse_effect
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.inference.score_test import make_templates, promise
from ssi_ros.gap.nominal.starting_points import at_size, starting_points
from ssi_ros.model import load_spacecraft
from ssi_ros.updating.model_uncertainty import no_uncertainty


@pytest.mark.parametrize('text', [
    'fuel_slosh:mass_kg=4,frequency_hz=0.66,damping_ratio=0.012,arm_m=0.5',
    'attitude_controller:bandwidth_hz=0.2,damping_ratio=0.15',
    'added_mass:array=E2,mass_kg=0.02,along_m=3.6,lateral_m=-0.2',
    'sensor_misplacement:channel=e1_b,lateral_m=0.003'])
def test_the_best_template_sees_most_of_an_effect(text):
    """The cosine (105) of numbers between the starts."""
    effect, simulator = parse_effect(text), record(600.0)[1]
    starts = starting_points([type(effect)], simulator.spacecraft)
    templates = make_templates(simulator, [effect, *starts])
    _, cosine = promise(templates, simulator.expected(Candidate()), simulator.frame,
                        no_uncertainty(simulator.frame, 4))
    assert np.max(cosine[0, 1:]) > 0.75


def test_places_of_a_mass_stretch_with_the_array():
    """On a plate of twice the size every start is on the plate, up to its tip."""
    craft = load_spacecraft()
    long = replace(craft.arrays[0].plate, length_m=16.0, width_m=4.0)
    craft = replace(craft, arrays=(replace(craft.arrays[0], plate=long), craft.arrays[1]))
    starts = starting_points([effect_class('added_mass')], craft)
    along = {a: max(e.along_m for e in starts if e.array == a) for a in ('E1', 'E2')}
    assert along['E1'] == pytest.approx(15.4) and along['E2'] == pytest.approx(7.7)
    assert max(abs(e.lateral_m) for e in starts if e.array == 'E1') == pytest.approx(1.2)


def test_both_coordinates_of_a_shift_grow_with_its_size():
    """And one that is zero stays zero."""
    shift = parse_effect('sensor_misplacement:channel=e1_a,lateral_m=0.02')
    assert not shift.is_null
    half = at_size(shift, -0.5)
    assert half.lateral_m == pytest.approx(-0.01) and half.along_m == 0.0
    none = effect_class('sensor_misplacement')()
    assert none.is_null and none not in starting_points([type(none)], load_spacecraft())
