"""What holds for every effect that a model of matrices, modes or a state space can have."""
from dataclasses import replace
from pathlib import Path
import runpy

import numpy as np
import pytest
from scipy.linalg import eigh

from ssi_ros.effects import (
    applicable, effect_class, inject, left_out, parse_effect, places, simulate_setup)
from ssi_ros.effects.equivalent_hinges import equivalent_hinges
from ssi_ros.effects.places import nodes
from ssi_ros.effects.points import amplitude_between
from ssi_ros.effects.statistical_linearisation import linearise
from ssi_ros.model import assemble, load_spacecraft, natural_modes, simulate, state_space_model

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples'
SECONDS = 60.0


def as_state_space(model):
    """Return the same model by its state space."""
    plant = assemble(model).plant
    return state_space_model(plant.a, plant.b, plant.c, plant.d, discrete=False,
                             rate_hz=model.rate_hz, drives=model.drives, sensors=model.sensors)


BUILDING = runpy.run_path(EXAMPLES / 'shear_building.py')['shear_building']()
BRIDGE = runpy.run_path(EXAMPLES / 'footbridge.py')['footbridge']()
MODELS = {'matrices': BUILDING, 'modes': BRIDGE, 'state space': as_state_space(BUILDING)}
CASES = [(form, name) for form, model in MODELS.items() for name in applicable(model)]


def sized(model, name):
    """Return the effect at the last place and first start that the model has."""
    cls = effect_class(name)
    place = list(places(cls, model))[-1]
    return cls(**place, **{k: v[0] for k, v in cls.starts_on(model, place).items()})


@pytest.mark.parametrize('form, name', CASES)
def test_null_is_identity_and_the_effect_is_not(form, name):
    """At its default the record is the nominal one, bit for bit; sized, it is another, finite."""
    model = MODELS[form]
    nominal = simulate(assemble(model), SECONDS, 3).values
    cls, effect = effect_class(name), sized(model, name)
    words = {f.name: getattr(effect, f.name) for f in cls.words()}
    same = simulate_setup(inject(model, [cls(**words)], SECONDS), 3)
    np.testing.assert_array_equal(same.values, nominal)
    other = simulate_setup(inject(model, [effect], SECONDS), 3)
    assert other.values.shape == nominal.shape and other.rate_hz == model.rate_hz
    assert not np.array_equal(other.values, nominal)
    assert np.all(np.nanstd(other.values, axis=0) < 10 * nominal.std(axis=0))
    assert np.isnan(other.values).any() == (name == 'dropped_samples')
    assert parse_effect(effect.text()).text() == effect.text()


def test_one_array_has_no_asymmetry():
    """It would be another stiffness of all arrays, and tied with that for ever."""
    craft = load_spacecraft()
    one = replace(craft, arrays=craft.arrays[:1], sensors=tuple(
        s for s in craft.sensors if s.array == craft.arrays[0].name))
    assert set(applicable(craft)) - set(applicable(one)) == {'array_asymmetry'}


def test_laws_of_hinges_stay_in_their_range():
    """A law whose equivalent is a linear hinge, but whose own stiffness cannot be, is no law."""
    craft = load_spacecraft()

    def laws(stiffness):
        linear = effect_class('hinge_compliance')(array='E1', stiffness_n_m_rad=stiffness)
        return equivalent_hinges(linear, applicable(craft), lambda e: inject(craft, [e], SECONDS))
    assert all(laws(1e6))
    stiff = [e for law in laws(8e8) for e in law]
    assert stiff and {e.name for e in stiff} == {'hinge_friction', 'cubic_stiffness'}


def test_a_spacecraft_keeps_its_effects():
    """What belongs to points and modes is no candidate there, and geometry none on matrices."""
    craft = applicable(load_spacecraft())
    assert len(craft) == 30 and craft == applicable(None)
    assert {'added_mass', 'hub_inertia', 'fuel_slosh', 'sensor_misplacement'} <= set(craft)
    own = set(applicable(BUILDING)) - set(craft)
    assert own == {'mode_frequency', 'mode_damping', 'connection_stiffness', 'connection_damping',
                   'connection_friction', 'connection_play', 'point_mass', 'random_force'}
    assert set(applicable(MODELS['state space'])) - set(craft) == {
        'mode_frequency', 'mode_damping'}
    (sentence,) = left_out(BUILDING)
    assert 'no geometry, so that 11 effects were left out: added_mass' in sentence
    assert left_out(load_spacecraft()) == ()


@pytest.mark.parametrize('model, text, words', [
    (BUILDING, 'hub_inertia:scale=1.1', 'hub_inertia needs arrays.*does not have; leave it out'),
    (MODELS['state space'], 'point_mass:freedom=a,share=1', 'needs points that springs can join'),
    (load_spacecraft(), 'mode_frequency:scale=1.1', 'needs a model of matrices'),
    (BUILDING, 'point_mass:freedom=floor_9,share=1', 'did you mean floor_'),
    (BUILDING, 'connection_stiffness:freedom=floor_1,to=floor_1,share=1', 'both ends are floor_1'),
    (BUILDING, 'mode_frequency:mode=6,scale=1.1', 'has the modes 1 to 5'),
    (BUILDING, 'mode_frequency:mode=x,scale=1.1', 'has the modes 1 to 5')])
def test_what_cannot_be_is_said(model, text, words):
    """One sentence: what is needed, or which places there are."""
    with pytest.raises(ValueError, match=words):
        inject(model, [parse_effect(text)])


def modes_with(text, model=BUILDING):
    """Return the modes of a model with an effect."""
    return natural_modes(inject(model, [parse_effect(text)]).system)


@pytest.mark.parametrize('form', MODELS)
def test_one_mode_moves_alone(form):
    """Frequency by 1 % or damping by 20 % of the second mode, of any form; all else stays."""
    model = MODELS[form]
    nominal = natural_modes(assemble(model))
    faster = modes_with('mode_frequency:mode=2,scale=1.01', model)
    damped = modes_with('mode_damping:mode=2,scale=1.2', model)
    second = np.arange(5) == 1
    np.testing.assert_allclose(faster.frequencies_hz / nominal.frequencies_hz,
                               np.where(second, 1.01, 1.0), rtol=1e-6)
    np.testing.assert_allclose(faster.damping_ratios, nominal.damping_ratios, rtol=1e-5)
    np.testing.assert_allclose(damped.damping_ratios / nominal.damping_ratios,
                               np.where(second, 1.2, 1.0), rtol=1e-5)
    np.testing.assert_allclose(damped.frequencies_hz, nominal.frequencies_hz, rtol=1e-6)


def test_springs_and_masses_are_those_of_the_matrices():
    """In a chain the stiffness between two floors is the storey's; a mass that of the floor."""
    stiffness = BUILDING.stiffness.copy()
    stiffness[1:3, 1:3] -= 0.1 * 5.523e6 * np.array([[1, -1], [-1, 1]])
    squares = eigh(stiffness, BUILDING.mass, eigvals_only=True)
    found = modes_with('connection_stiffness:freedom=floor_2,to=floor_3,share=-0.1')
    np.testing.assert_allclose((2 * np.pi * found.frequencies_hz) ** 2, squares, rtol=1e-3)
    mass = BUILDING.mass.copy()
    mass[4, 4] *= 1.2
    squares = eigh(BUILDING.stiffness, mass, eigvals_only=True)
    found = modes_with('point_mass:freedom=floor_5,share=0.2')
    np.testing.assert_allclose((2 * np.pi * found.frequencies_hz) ** 2, squares, rtol=1e-3)


def test_friction_that_sticks_is_a_spring():
    """A slider that nothing moves is its presliding spring; the step of 5 ms errs by 1 %."""
    words = 'freedom=floor_2,to=floor_3'
    stuck, spring, nominal = (
        simulate_setup(inject(BUILDING, [parse_effect(t)] if t else [], 200.0), 5).values
        for t in (f'connection_friction:{words},force=1e12,stiffness_percent=10',
                  f'connection_stiffness:{words},share=0.1', ''))
    assert np.std(stuck - spring) < 0.01 * np.std(nominal - spring)


@pytest.mark.parametrize('name', ['connection_friction', 'connection_play'])
def test_the_expected_spectrum_is_that_of_records(name):
    """The equivalent linear system explains most of what the law changes in the variances."""
    amplitude, stiffness = amplitude_between(BUILDING, 'floor_2', 'floor_3')
    words = {'connection_friction': f'force={0.03 * stiffness * amplitude},stiffness_percent=20',
             'connection_play': f'gap={0.3 * amplitude}'}[name]
    effect = parse_effect(f'{name}:freedom=floor_2,to=floor_3,{words}')
    setup = inject(BUILDING, [effect], 4000.0)
    linear, nominal = natural_modes(linearise(setup).system), natural_modes(assemble(BUILDING))
    values = simulate_setup(setup, 5).values[:, 1]
    # the second mode by the centre of its power, a frequency that needs no model
    spectrum = np.abs(np.fft.rfft(values)) ** 2
    f = np.fft.rfftfreq(len(values), 1 / BUILDING.rate_hz)
    band = np.abs(f - nominal.frequencies_hz[1]) < 0.15
    centre = np.sum(f[band] * spectrum[band]) / np.sum(spectrum[band])
    plain = simulate_setup(inject(BUILDING, [], 4000.0), 5).values[:, 1]
    spectrum = np.abs(np.fft.rfft(plain)) ** 2
    before = np.sum(f[band] * spectrum[band]) / np.sum(spectrum[band])
    predicted = linear.frequencies_hz[1] - nominal.frequencies_hz[1]
    # play softens, presliding stiffens; a band that cuts the skirts shows a part of the shift
    assert np.sign(predicted) == (1 if name == 'connection_friction' else -1)
    assert 0.4 < (centre - before) / predicted < 1.3


def test_friction_takes_energy():
    """Free decay is faster with a slider, and what is simulated stays passive."""
    amplitude, stiffness = amplitude_between(BUILDING, 'floor_1', 'ground')
    for share in (0.01, 0.05):
        text = (f'connection_friction:freedom=floor_1,force={share * amplitude * stiffness},'
                'stiffness_percent=10')
        system = linearise(inject(BUILDING, [parse_effect(text)], 100.0)).system
        ratios = natural_modes(system).damping_ratios
        assert ratios[0] > 1.02 * 0.02 and np.all(ratios > 0.995 * 0.02)


def test_play_at_the_ground_needs_a_spring():
    """Friction on a floor that nothing holds is refused, as its position drifts away."""
    from dataclasses import replace
    stiffness = BUILDING.stiffness.copy()
    stiffness[0], stiffness[:, 0] = 0.0, 0.0
    stiffness[1, 1] = 5.523e6
    free = replace(BUILDING, stiffness=stiffness, damping=1e3 * np.eye(5),
                   output=BUILDING.output[:3], sensors=BUILDING.sensors[:3])
    with pytest.raises(ValueError, match='no spring holds floor_1 and ground'):
        inject(free, [parse_effect('connection_friction:freedom=floor_1,force=1')])


def test_a_mass_at_a_node_acts_in_all_its_directions():
    """Points whose names differ by a last x, y or z are one node, and each one alone too."""
    assert nodes(['n1x', 'n1y', 'n2x', 'x', 'y', 'tip_z', 'floor_2']) == ['n1x+n1y']
    setup = inject(BUILDING, [])
    first, second = BUILDING.freedoms[:2]
    mass = effect_class('point_mass')(freedom=f'{first}+{second}', share=0.1)
    added = np.diag(mass.apply(setup).system.mass - setup.system.mass)
    assert added[:2] == pytest.approx(0.1 * setup.system.mass[0, 0]) and not added[2:].any()
