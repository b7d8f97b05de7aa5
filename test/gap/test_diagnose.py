"""Recovery: inject an effect, it is named; inject none, it is quiet; refuse what does not fit."""
from dataclasses import replace
import json

import numpy as np
import pytest

from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT
from ssi_ros.records import Samples

SECONDS = 150.0
FEW = ('array_asymmetry', 'hub_inertia', 'sensor_gain', 'sensor_crosstalk', 'channel_delay',
       'saturation', 'quantisation', 'dropped_samples', 'sensor_noise', 'impulsive_events')
SETTINGS = DiagnosisSettings(finalists=2)


@pytest.fixture(scope='module')
def spacecraft():
    return replace(load_spacecraft(), uncertainty=EXACT)


def record(spacecraft, *texts, seed=21, duration_s=SECONDS):
    return simulate_setup(inject(spacecraft, [parse_effect(t) for t in texts], duration_s), seed)


@pytest.mark.parametrize('text, site', [
    ('array_asymmetry:array=E2,scale=0.98', 'structure'),
    ('sensor_gain:channel=e2_b,scale=1.04', 'sensor'),
    ('channel_delay:channel=e1_b,delay_s=0.002', 'sensor'),
    pytest.param('saturation:limit_m_s2=0.08', 'sensor', marks=pytest.mark.slow),
    ('quantisation:step_m_s2=0.002', 'sensor'),
    pytest.param('dropped_samples:fraction=0.03', 'timing', marks=pytest.mark.slow)])
def test_the_effect_is_named_with_its_size(text, site, spacecraft):
    """One effect of a good size: first of the list, at its site, value within its spread."""
    effect = parse_effect(text)
    found = diagnose(spacecraft, record(spacecraft, text), SETTINGS, effects=FEW, pairs=False)
    top = found.candidates[0]
    assert top.effects == (effect.name,)
    assert max(found.where.site, key=found.where.site.get) == site
    value = top.parameters[f'{effect.name}.{effect.size}']
    true = getattr(effect, effect.size)
    if np.isfinite(value.std):
        assert abs(value.value - true) < 4 * value.std        # 4 sd of its own spread
    else:
        # 15 %: steps and rails are read off the values exactly, losses to a few per cent
        assert value.value == pytest.approx(true, rel=0.15)
    if np.isfinite(top.closed):
        rivals = [c.closed for c in found.candidates[1:] if c.built]
        # no wrong effect closes clearly more
        assert top.closed > max(rivals, default=0.0) - 0.1


def test_right_model_is_quiet(spacecraft):
    """Without an effect the outcome is WITHIN_FLOOR and nothing is blamed."""
    found = diagnose(spacecraft, record(spacecraft), SETTINGS, effects=FEW)
    assert found.outcome == 'WITHIN_FLOOR'
    assert found.verdict['effects'] == ()
    first, *others = found.candidates
    assert first.effects == ('none',)
    # what is too small to be seen stays possible, each effect less than none at all
    assert {e for c in others for e in c.effects} == {*FEW, 'unknown'}
    assert all(0.0 < c.probability < first.probability < 1.0 for c in others)
    assert sum(c.probability for c in found.candidates) == pytest.approx(1.0)


def test_json_has_the_fixed_schema(spacecraft):
    """Others read it: keys, and probabilities that sum to 1."""
    found = diagnose(spacecraft, record(spacecraft, 'hub_inertia:scale=1.3'), SETTINGS,
                     effects=FEW, pairs=False)
    plain = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert plain['schema'] == 'ssi_ros/diagnosis/1'
    assert set(plain) >= {'outcome', 'reason', 'gap', 'where', 'candidates', 'verdict',
                          'separate_by'}
    assert set(plain['where']) == {'site', 'sensors', 'bands', 'modes', 'times', 'amplitudes'}
    assert set(plain['candidates'][0]) == {
        'effects', 'probability', 'class', 'parameters', 'gap_after', 'closed', 'closed_low90',
        'closed_high90', 'inside_floor'}
    # 1e-9: a softmax, so only round-off
    assert sum(c['probability'] for c in plain['candidates']) == pytest.approx(1.0, abs=1e-9)
    assert plain['controls'][0]['effects'] == ['none']
    names = [c['effects'] for c in plain['candidates']]
    assert ['unknown'] in names and ['none'] in names
    for kind in ('sensors', 'bands', 'times', 'amplitudes'):
        assert sum(e['share'] for e in plain['where'][kind]) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.slow
def test_an_effect_that_is_not_in_the_list_is_not_blamed_on_another(spacecraft):
    """A softer array, with only sensor effects allowed: unexplained, and the nearest is named."""
    found = diagnose(spacecraft, record(spacecraft, 'array_asymmetry:array=E2,scale=0.95'),
                     SETTINGS, effects=('sensor_gain', 'sensor_noise'), pairs=False)
    assert found.outcome == 'UNEXPLAINED'
    # what no effect makes comes first, with the array that is softer
    assert 'of E2 alone' in found.reason and 'the nearest, sensor_' in found.reason
    unknown = [c for c in found.candidates if c.effects == ('unknown',)][0]
    assert unknown.probability > 0.88      # (113f)


def test_present_effect_closes_the_loop(spacecraft):
    """With the effect in the simulator the same record is within the floor."""
    text = 'sensor_gain:channel=e2_b,scale=1.04'
    corrected = ModelNominal(spacecraft, (parse_effect(text),))
    found = diagnose(corrected, record(spacecraft, text), SETTINGS, effects=FEW)
    assert found.outcome == 'WITHIN_FLOOR'


def test_short_record_says_how_long_it_must_be(spacecraft):
    """Too few samples: an outcome with the length needed, no verdict."""
    found = diagnose(spacecraft, record(spacecraft, duration_s=2.0))
    assert found.outcome == 'TOO_LITTLE_DATA'
    assert 's are needed' in found.reason


def test_a_record_of_dead_channels_is_an_answer(spacecraft):
    """There is nothing to compare, and each channel is named."""
    good = record(spacecraft, duration_s=60.0)
    found = diagnose(spacecraft, Samples(-0.0 * good.values, 100.0, good.channels))
    assert found.outcome == 'TOO_LITTLE_DATA'
    assert 'e2_a is dead: it shows 0 all' in found.reason and 'e1_b is dead' in found.reason


def test_refusals(spacecraft):
    """Wrong channels, wrong rate, an unknown effect: each with its reason."""
    good = record(spacecraft, duration_s=60.0)
    with pytest.raises(ValueError, match='none is in both'):
        diagnose(spacecraft, Samples(good.values, 100.0, tuple('abcd')))
    with pytest.raises(ValueError, match='sampled at 50 Hz'):
        diagnose(spacecraft, Samples(good.values, 50.0, good.channels))
    with pytest.raises(ValueError, match='did you mean sensor_gain'):
        diagnose(spacecraft, good, effects=['sensor_gian'])


@pytest.mark.parametrize('change, outcome, words', [
    (lambda v: v + 5.0, 'WITHIN_FLOOR', 'what the model expects'),
    (lambda v: v * 1e6, 'UNEXPLAINED', 'dB off the model'),
    (lambda v: v / 9.81, 'UNEXPLAINED', 'in g and not in m/s^2'),
    (lambda v: np.random.default_rng(0).standard_normal(v.shape), 'UNEXPLAINED', 'hides it')])
def test_offsets_units_and_noise(change, outcome, words, spacecraft):
    """A bias is no gap; another unit and something else than an accelerometer are told."""
    good = record(spacecraft)
    found = diagnose(spacecraft, Samples(change(good.values), 100.0, good.channels), SETTINGS,
                     effects=FEW)
    assert found.outcome == outcome and words in found.reason


@pytest.mark.slow
def test_a_long_gap_in_the_record_is_no_effect(spacecraft):
    """Forty seconds without a sample: their pieces are left out, nothing is blamed."""
    good = record(spacecraft)
    values = good.values.copy()
    values[5000:9000] = np.nan
    found = diagnose(spacecraft, Samples(values, 100.0, good.channels), SETTINGS, effects=FEW)
    assert found.outcome == 'WITHIN_FLOOR'
    with pytest.raises(ValueError, match='that is no acceleration'):
        values[10, 1] = 1e300
        diagnose(spacecraft, Samples(values, 100.0, good.channels), SETTINGS)


@pytest.mark.slow
def test_a_clock_beside_another_effect_is_tied_with_a_stiffness():
    """What an exact spectrum lost by chance on its own records parts them no more than alone."""
    effects = [parse_effect('clock_rate:ppm=827'),
               parse_effect('sensor_crosstalk:source=e1_a,channel=e2_b,gain=0.007')]
    samples = simulate_setup(inject(load_spacecraft(), effects, 600.0), 50805)
    found = diagnose(replace(load_spacecraft(), uncertainty=EXACT), samples)
    assert found.outcome == 'TIED'
    assert {'clock_rate', 'stiffness_scale', 'sensor_crosstalk'} <= set(found.verdict['class'])
    odds = [c.probability for c in found.candidates[:2]]
    assert odds[0] < 1.2 * odds[1]


@pytest.mark.slow
def test_a_slow_swing_is_held_against_its_own_halves():
    """A period and a half: the depth about its middle, and halves of other levels are no gap."""
    effect = parse_effect('nonstationary_excitation:depth=0.5,period_s=400')
    samples = simulate_setup(inject(load_spacecraft(), [effect], 600.0), 6)
    found = diagnose(replace(load_spacecraft(), uncertainty=EXACT), samples, pairs=False)
    assert found.outcome == 'EXPLAINED'
    depth = found.candidates[0].parameters['nonstationary_excitation.depth']
    assert depth.value == pytest.approx(0.5, abs=0.02)
