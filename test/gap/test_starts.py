"""Starting values: what stands between them is seen, places follow the spacecraft."""
from dataclasses import replace
import math
from types import SimpleNamespace

from gap_records import record
import numpy as np
import pytest
from ssi_ros.effects import effect_class, inject, parse_effect, places, simulate_setup
from ssi_ros.effects.equivalent_hinges import beside_linear, extensions
from ssi_ros.effects.scales import scales_of
from ssi_ros.effects.second_degree import SecondDegree
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.inference.model_fit import fit
from ssi_ros.gap.inference.score_test import make_templates, promise, score
from ssi_ros.gap.nominal.starting_points import (
    at_size, in_other_basins, likely, promising, starting_points)
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT
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


@pytest.mark.parametrize('noise, tried', [(1.5, []), (600.0, ['timestamp_jitter'])])
def test_what_a_level_of_the_noise_has_taken_up_is_tried(noise, tried):
    """Jitter of 38 deviations raised it to 600 times, around which no score speaks for jitter."""
    effects = tuple(map(parse_effect, ('timestamp_jitter:rms_s=2e-4', 'hub_inertia:scale=1.1')))
    silent = SimpleNamespace(effects=effects, gains=lambda: np.zeros(2))
    found = likely((silent, silent), SimpleNamespace(levels=np.array([1.0, noise])),
                   DiagnosisSettings())
    assert [e.name for e in found] == tried


def test_a_mass_is_tried_where_what_it_leaves_would_have_more():
    """At its size, at the places of its own array alone, each once; a gain has no other place."""
    starts = [parse_effect(f'added_mass:array={a},mass_kg={m},along_m={at}')
              for a, m, at in (('E1', 0.01, 7.2), ('E2', 0.01, 4.0), ('E1', 0.1, 7.2),
                               ('E1', 0.01, 2.0), ('E1', 0.01, 3.0), ('E1', 0.01, 4.0),
                               ('E1', 0.01, 5.0), ('E1', 0.01, 6.0))]
    scores = SimpleNamespace(effects=tuple(starts), gains=lambda: np.array(
        [9.0, 20.0, 15.0, 1.0, 8.0, 7.0, 6.0, 0.5]))
    found = in_other_basins(parse_effect('added_mass:array=E1,mass_kg=0.5,along_m=0.9'), scores)
    assert {(e.array, e.mass_kg) for e in found} == {('E1', 0.5)}
    assert [e.along_m for e in found] == [7.2, 3.0, 4.0, 5.0, 2.0]      # 7.2 counts once
    assert in_other_basins(parse_effect('sensor_gain:channel=e1_a,scale=1.1'), scores) == []


@pytest.mark.slow
def test_a_mass_in_a_wrong_basin_is_found_where_it_is():
    """Half of it near the root explained 1,562 nats, and was named; it explains 1,780."""
    craft = replace(load_spacecraft(), uncertainty=EXACT)
    samples = simulate_setup(
        inject(craft, (parse_effect('added_mass:mass_kg=1.0,along_m=7'),), 600.0), 2197)
    found = diagnose(craft, samples, effects=('added_mass', 'cubic_stiffness'), pairs=False)
    assert found.outcome == 'EXPLAINED'
    along = found.candidates[0].parameters['added_mass.along_m']
    assert abs(along.value - 7) < 0.05


def test_no_law_begins_at_a_hinge_that_is_as_good_as_none():
    """A linear hinge may be stiffer than any law of one; it ended a diagnosis."""
    linear = parse_effect('hinge_compliance:array=E1,stiffness_n_m_rad=1.2e9')
    laws = 'hinge_freeplay', 'hinge_friction', 'cubic_stiffness'
    assert extensions(linear, laws) == []
    assert len(extensions(replace(linear, stiffness_n_m_rad=9e8), laws)) == 3


def test_laws_begin_at_the_linear_hinge_of_their_array():
    """Those of the other array, and all other effects, begin where they are."""
    linear, law, other, gain = map(parse_effect, (
        'hinge_compliance:array=E1,stiffness_n_m_rad=3e6',
        'hinge_friction:array=E1,torque_n_m=0.02,stiffness_n_m_rad=1e5',
        'hinge_friction:array=E2,torque_n_m=0.02,stiffness_n_m_rad=1e5',
        'sensor_gain:channel=e1_a,scale=1.1'))
    there = Candidate((replace(linear, stiffness_n_m_rad=2e5),))
    found = beside_linear([law, linear, other, gain], lambda e: SimpleNamespace(candidate=there))
    assert found == [linear, gain, replace(law, torque_n_m=0.01, stiffness_n_m_rad=2e5), other]
    assert beside_linear([law, linear], lambda e: None) == [linear, law]


def test_a_start_between_the_ends_of_a_fit_is_passed():
    """In every number, of the same effect at the same place."""
    begin, end, between, beyond, elsewhere = (Candidate((parse_effect(t),)) for t in (
        'added_mass:array=E1,mass_kg=0.1,along_m=2,lateral_m=0',
        'added_mass:array=E1,mass_kg=0.4,along_m=5,lateral_m=0.2',
        'added_mass:array=E1,mass_kg=0.2,along_m=4,lateral_m=0.1',
        'added_mass:array=E1,mass_kg=0.2,along_m=6,lateral_m=0.1',
        'added_mass:array=E2,mass_kg=0.2,along_m=4,lateral_m=0.1'))
    assert between.is_passed(begin, end) and between.is_passed(end, begin)
    assert not beyond.is_passed(begin, end) and not elsewhere.is_passed(begin, end)
    assert not Candidate().is_passed(Candidate(), Candidate())


@pytest.mark.parametrize('name', ['sensor_gain', 'sensor_crosstalk'])
def test_changes_of_second_degree_follow_from_two(name):
    """What is made of two starts is what the model says, and the best start sees any size."""
    simulator = record(300.0)[1]
    cls = effect_class(name)
    place = next(iter(places(cls, simulator.spacecraft)))
    starts = [e for e in starting_points([cls], simulator.spacecraft)
              if all(getattr(e, k) == v for k, v in place.items())]
    null, others = simulator.expected(Candidate()), SecondDegree()
    for i, effect in enumerate(starts):
        alone = simulator.expected(Candidate((effect,))).at_nominal - null.at_nominal
        change = others.change(effect)
        assert (change is None) == (i < 2)
        if change is not None:
            assert np.abs(change - alone).max() < 1e-4 * np.abs(alone).max()
        others.keep(effect, alone)
    for size in (0.3, 1.0, 3.0, 5.0):
        sized = at_size(starts[0], size)
        _, cosine = promise(make_templates(simulator, [sized, *starts]), null, simulator.frame,
                            no_uncertainty(simulator.frame, 4))
        assert np.max(cosine[0, 1:]) > 0.9


@pytest.mark.parametrize('text', [
    'sensor_bandwidth:corner_hz=40', 'sensor_bandwidth:channel=e1_b,corner_hz=400',
    'excitation_colour:corner_hz=80', 'timestamp_jitter:rms_s=0.0005'])
def test_a_score_is_read_as_a_size_near_the_true_one(text):
    """Of one channel a low-pass is a lag, of all a loss: a power of -1 and one of -4."""
    effect = parse_effect(text)
    craft = replace(load_spacecraft(), uncertainty=EXACT)
    simulator = record(600.0)[1]
    evidence = simulator.evidence(simulate_setup(inject(craft, [effect], 600.0), 5))
    templates = make_templates(simulator, starting_points([type(effect)], craft))
    null, free = fit(simulator, evidence), no_uncertainty(simulator.frame, 4)
    (begin,) = promising(score(templates, null, evidence, free), 1)
    ratio = getattr(begin, effect.size) / getattr(effect, effect.size)
    assert begin.kind() == effect.kind() and 0.6 < ratio < 1.6


def small_craft():
    """Return a spacecraft of 5 kg m^2 with arrays of 2 m: its modes are from 4 to 35 Hz."""
    craft = load_spacecraft()
    sizes = (1.6, 900.0), (2.1, 2500.0)
    arrays = tuple(replace(a, root_m=0.2, modes=3, damping_ratio=0.01, plate=replace(
        a.plate, length_m=length, width_m=0.5, stiffness_n_m=stiffness))
        for a, (length, stiffness) in zip(craft.arrays, sizes))
    hub = replace(craft.hub, inertia_kg_m2=((5.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 5.0)))
    return replace(craft, hub=hub, arrays=arrays, uncertainty=EXACT, sensors=tuple(
        replace(s, along_m=1.5, lateral_m=math.copysign(0.2, s.lateral_m))
        for s in craft.sensors))


def test_starts_follow_the_spacecraft():
    """Those of the packaged one are as they are declared; all others lie in their ranges."""
    packaged = load_spacecraft()
    assert set(scales_of(packaged, {}).values()) == {1.0}
    cls = effect_class('fuel_slosh')
    assert cls.starts_on(packaged, {}) == cls.starts
    starts = starting_points([cls], small_craft())
    assert max(e.mass_kg for e in starts) == pytest.approx(3.0 * 5.0 / 600.0)
    # the lowest mode of the longer array is 11.5 times as high
    assert min(e.frequency_hz for e in starts) == pytest.approx(0.12 * 11.47, rel=0.01)
    assert 90.0 < max(e.frequency_hz for e in starts) < 100.0


@pytest.mark.slow
def test_slosh_of_a_small_spacecraft_is_found():
    """At a mass of the packaged one its resonance would be a third higher."""
    slosh = 'fuel_slosh:mass_kg=0.2,frequency_hz=9.15,damping_ratio=0.0085,arm_m=0.5'
    craft = small_craft()
    samples = simulate_setup(inject(craft, [parse_effect(slosh)], 240.0), 5)
    found = diagnose(craft, samples, pairs=False)
    assert found.outcome == 'EXPLAINED' and found.candidates[0].effects == ('fuel_slosh',)
    at_hz = found.candidates[0].parameters['fuel_slosh.frequency_hz']
    assert at_hz.value == pytest.approx(9.15, abs=3 * at_hz.std)


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
