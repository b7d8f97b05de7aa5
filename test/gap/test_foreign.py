"""Models of other people, diagnosed: quiet without an effect, right with one."""
from dataclasses import replace
from pathlib import Path
import runpy
import sys

import numpy as np
import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.effects.points import undriven
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.model import Channel, Input, load_model, load_spacecraft, modal_model
from ssi_ros.model.model_file import save_system
from ssi_ros.model.structure import assemble
from ssi_ros.planning.identifiability import identifiability

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples'
BUILDING = runpy.run_path(EXAMPLES / 'shear_building.py')['shear_building']()
BRIDGE = runpy.run_path(EXAMPLES / 'footbridge.py')['footbridge']()
# small sets, so that each test is a matter of seconds; the validation takes the whole library
SOME = ('connection_stiffness', 'point_mass', 'mode_damping', 'sensor_gain', 'clock_rate')


def answer(model, texts, seconds, seed, effects=SOME):
    """Return the diagnosis of a record with effects, louder than the model by 2 dB."""
    real = model.at_levels([1.6] * (len({d.level_name for d in model.drives})) + [1.0])
    setup = inject(real, [parse_effect(t) for t in texts], seconds)
    return diagnose(model, simulate_setup(setup, seed), effects=effects, pairs=False)


@pytest.mark.parametrize('model, seconds', [(BUILDING, 1800.0), (BRIDGE, 600.0)])
def test_without_an_effect_it_is_quiet(model, seconds):
    """Another level is no gap; the sentence on what needs geometry is there."""
    found = answer(model, [], seconds, 11)
    assert found.outcome == 'WITHIN_FLOOR'
    assert any('no geometry' in s for s in found.to_json()['signs'])


@pytest.mark.parametrize('model, seconds, text', [
    (BUILDING, 1800.0, 'connection_stiffness:freedom=floor_2,to=floor_3,share=-0.06'),
    (BUILDING, 1800.0, 'sensor_gain:channel=gnss,scale=1.03'),
    (BUILDING, 1800.0, 'point_mass:freedom=floor_4,share=0.08'),
    (BRIDGE, 600.0, 'point_mass:freedom=north_mid,share=0.01'),
    pytest.param(BRIDGE, 600.0, 'mode_damping:mode=2,scale=1.6', marks=pytest.mark.slow),
    pytest.param(BRIDGE, 600.0, 'sensor_gain:channel=strain_14,scale=0.97',
                 marks=pytest.mark.slow)])
def test_an_effect_is_named_with_its_place_and_size(model, seconds, text):
    """The right effect at the right place, and its size within four standard deviations."""
    found, effect = answer(model, [text], seconds, 12), parse_effect(text)
    assert found.outcome in ('EXPLAINED', 'TIED')
    best = found.candidates[0]
    assert best.effects == (effect.name,)
    (built,) = best.built
    assert all(getattr(built, f.name) == getattr(effect, f.name) for f in effect.words())
    value = best.parameters[f'{effect.name}.{effect.size}']
    assert abs(value.value - getattr(effect, effect.size)) < 4 * value.std


def test_a_spacecraft_given_by_matrices_is_expected_alike(tmp_path):
    """Its expected periodograms are those of the spacecraft, level by level."""
    craft = load_spacecraft()
    save_system(assemble(craft), tmp_path / 'craft.npz')
    frame = make_frame(12_000, 100.0, DiagnosisSettings())
    one, two = (Simulator(m, frame, 120.0).expected(Candidate())
                for m in (craft, load_model(tmp_path / 'craft.npz')[0]))
    assert one.names == two.names
    for a, b in zip(one.shares, two.shares):
        # two ways to the same eigenvalues
        np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-8 * np.abs(a).max())


def test_one_channel_is_enough():
    """A model with one mode, one input and one channel is promised and diagnosed."""
    model = modal_model([2.0], 0.01, [[1.0]], [[1.0]], rate_hz=25.0,
                        drives=(Input('push', 3.0),), sensors=(Channel('top', 'velocity', 1e-3),))
    assert {v.effect.name for v in identifiability(model, 900.0)} >= {
        'mode_frequency', 'mode_damping', 'sensor_noise', 'clock_rate'}
    found = answer(model, ['mode_frequency:mode=1,scale=1.02'], 900.0, 3,
                   ('mode_frequency', 'mode_damping', 'sensor_noise'))
    assert found.candidates[0].effects == ('mode_frequency',)


def test_slow_models_are_cut_into_long_segments():
    """Twelve time constants of the slowest mode, 191 s for the building; a fast one stays."""
    settings = DiagnosisSettings()
    slowest = 0.02 * 2 * np.pi * 0.49987
    found = BUILDING.cut(settings)
    # to the next length without a large prime factor
    assert 12 / slowest <= found.segment_s < 12.1 / slowest
    assert found.segment_s * BUILDING.rate_hz == 3840
    fast = modal_model([20.0], 0.01, [[1.0]], [[1.0]], rate_hz=100.0, drives=(Input('u', 1.0),),
                       sensors=(Channel('y'),))
    assert fast.cut(settings) is settings


@pytest.fixture(scope='module')
def robot():
    """Return the example of the arm; MuJoCo is no dependency of the package."""
    pytest.importorskip('mujoco')
    sys.path.insert(0, str(EXAMPLES))
    try:
        import robot_arm
        return robot_arm
    finally:
        sys.path.remove(str(EXAMPLES))


def test_mujoco_is_linearised_alike_by_both(robot):
    """Finite differences and mass matrix give one transfer function, to their step of 2 us."""
    f = np.linspace(0.5, 60.0, 200)
    one, two = (assemble(m).transfer(f, 200.0) for m in (robot.state_space(), robot.matrices()))
    size = np.abs(two).max(axis=(0, 2), keepdims=True)
    assert np.max(np.abs(one - two) / size) < 1e-3


@pytest.mark.parametrize('form, changes, right', [
    ('state_space', {}, ()), ('matrices', {}, ()),
    ('state_space', {'gains': (1.0, 1.0, 1.0, 1.03)}, ('sensor_gain', 'tip_acc')),
    ('matrices', {'elbow_stiffness': 0.94}, ('connection_stiffness', 'elbow')),
    ('matrices', {'payload_mass': 1.15}, ('point_mass', 'tip_acc'))])
def test_records_of_mujoco_are_diagnosed(robot, form, changes, right):
    """Its own integrator, random torques, one thing changed: quiet, or named with its place."""
    samples, _ = robot.record(120.0, 5, **changes)
    found = diagnose(getattr(robot, form)(), samples, pairs=False, effects=(
        'sensor_gain', 'clock_rate', 'mode_damping') if form == 'state_space' else SOME)
    if not right:
        assert found.outcome == 'WITHIN_FLOOR'
        return
    name, place = right
    assert found.candidates[0].effects == (name,)
    assert place in found.candidates[0].built[0].text()


def test_a_force_where_the_model_has_none_is_named_with_its_place():
    """A machine on one floor of a building that the wind alone should move."""
    assert 'floor_3' in undriven(BUILDING)
    found = answer(BUILDING, ['random_force:freedom=floor_3,share=0.7'], 1800.0, 13,
                   (*SOME, 'random_force'))
    assert found.outcome == 'EXPLAINED' and found.where.site['excitation'] > 0.95
    (effect,) = found.candidates[0].built
    # over the strongest input of the model, which is quieter than the record by 2 dB
    assert effect.freedom == 'floor_3' and effect.share == pytest.approx(0.7 * 1.6 ** 0.5, rel=0.1)


def test_a_channel_that_follows_a_curve_is_no_gain():
    """A sensor whose gain falls by 3 % at three times the rms of its motion."""
    samples = simulate_setup(inject(BUILDING, (), 600.0), 5)
    values = samples.values.copy()
    values[:, 1] *= 1 - 0.03 * (values[:, 1] / values[:, 1].std()) ** 2 / 9
    found = diagnose(BUILDING, replace(samples, values=values), effects=SOME, pairs=False)
    assert found.outcome == 'UNEXPLAINED' and found.where.site['sensor'] > 0.9
    assert f'Channel {samples.channels[1]} follows a curve, no straight line:' in found.reason
