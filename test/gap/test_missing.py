"""Records with gaps: what is missing is said, the rest is used, and no torque is blamed."""
from dataclasses import replace

import numpy as np
import pytest
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.gap.candidate import Candidate
from ssi_ros.gap.driver import diagnose
from ssi_ros.gap.nominal.model import ModelNominal
from ssi_ros.gap.nominal.recorded import RecordedNominal
from ssi_ros.gap.nominal.simulator import Simulator
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.gap.spectra.imputation import filled
from ssi_ros.gap.spectra.segmentation import make_frame
from ssi_ros.integrity.filling import filled_alike
from ssi_ros.integrity.missing import (
    best_channels, lost_at_random, missing_of, segment_rows, unusable)
from ssi_ros.model import load_spacecraft
from ssi_ros.model.channels import of_channels, with_channels
from ssi_ros.model.errors import Calibration
from ssi_ros.model.structure import assemble
from ssi_ros.model.uncertainty import EXACT

RATE_HZ, SECONDS = 100.0, 240.0
SETTINGS = DiagnosisSettings()
FEW = ['sensor_gain', 'hub_inertia', 'dropped_samples', 'sensor_drift', 'attitude_controller',
       'impulsive_events', 'harmonic_disturbance', 'nonstationary_excitation']


@pytest.fixture(scope='module')
def spacecraft():
    return replace(load_spacecraft(), uncertainty=EXACT)


def record(spacecraft, *texts, seed=3):
    return simulate_setup(inject(spacecraft, [parse_effect(t) for t in texts], SECONDS), seed)


def without(samples, *times, channels=slice(None)):
    """Return samples without those between pairs of times [s]."""
    values = samples.values.copy()
    for first, last in times:
        values[round(first * RATE_HZ):round(last * RATE_HZ), channels] = np.nan
    return replace(samples, values=values)


GAPS = tuple((t, t + 2.5) for t in (71.0, 140.0))


def test_what_is_missing_is_counted(spacecraft):
    """Share, number and longest of the gaps; a channel of the model that was not recorded."""
    samples = without(record(spacecraft), (10.0, 14.0))
    samples = without(samples, (100.0, 112.0), channels=[1])
    found = missing_of(samples)
    assert found.gaps == 2 and found.longest_of == ('e1_b',)
    assert (found.longest_s, found.longest_at_s) == (12.0, 100.0)
    assert found.share == pytest.approx((4 * 4.0 + 12.0) / 4 / SECONDS)
    assert found.channels['e1_a'] == pytest.approx(4.0 / SECONDS)
    assert found.text.endswith('the longest of 12 s from 100 s on e1_b, the other from 10 s')
    assert found.places == ((10.0, 14.0, samples.channels), (100.0, 112.0, ('e1_b',)))
    many = without(samples, *((t, t + 1.0) for t in range(20, 80, 10)))
    assert missing_of(many).text.endswith(', others from 10, 20, 30, 40 s and 3 more')
    assert missing_of(record(spacecraft)).text == 'no sample is missing'
    assert missing_of(samples, ('e1_a', 'e9'))
    assert missing_of(samples, ('e1_a', 'e9')).channels['e9'] == 1.0


def test_segments_lie_between_long_gaps():
    """None holds a row of a gap; a record without gaps is cut as it always was."""
    present = np.ones(60_000, bool)
    present[20_000:20_350] = present[41_000:47_000] = False
    present[3000:3290] = False                  # short enough to be filled
    frame = make_frame(60_000, RATE_HZ, SETTINGS, present)
    long_gaps = ~present
    long_gaps[3000:3290] = False
    inside = [long_gaps[b:b + frame.rows].any() for b in frame.begins]
    assert frame.segments >= SETTINGS.least_segments and not any(inside)
    assert frame.segments * frame.rows > 0.8 * present.sum()
    whole = make_frame(60_000, RATE_HZ, SETTINGS)
    assert whole.rows == 6000 and whole.begins == tuple(range(0, 60_000, 6000))
    present[::150] = False
    present[1::2] = False
    present[:59_800] = False
    with pytest.raises(ValueError, match='are needed for 8 segments'):
        make_frame(60_000, RATE_HZ, SETTINGS, present)


def test_the_length_of_segments_suits_the_parts():
    """Long parts keep long segments; many short parts have shorter ones, 0 if they cannot."""
    assert segment_rows(np.array([[0, 24_000], [24_100, 60_000]]), 6000, 100, 8) == 5983
    parts = np.array([[2000 * i, 2000 * i + 1800] for i in range(30)])
    assert segment_rows(parts, 6000, 100, 8) == 1800
    assert segment_rows(parts, 6000, 1900, 8) == 0


def test_a_channel_costs_the_time_or_is_left_out():
    """Whichever keeps more rows times channels."""
    present = np.ones((60_000, 4), bool)
    present[30_000:, 2] = False
    assert best_channels(present, RATE_HZ, 100) == [0, 1, 3]
    present[30_000:54_000, 2] = True
    assert best_channels(present, RATE_HZ, 100) == [0, 1, 2, 3]
    present[::7, 0] = False                     # can be filled, and costs nothing
    assert best_channels(present, RATE_HZ, 100) == [0, 1, 2, 3]


def test_only_rows_that_are_lost_one_by_one_are_lost_at_random():
    """Gaps are not; beside a long gap the share is of the rest."""
    rows = np.random.default_rng(2).random(20_000) < 0.03
    gaps = np.zeros(20_000, bool)
    gaps[5000:5060] = gaps[9000:9080] = True
    assert lost_at_random(gaps, 100) == 0.0
    assert lost_at_random(rows, 100) == pytest.approx(0.03, rel=0.1)
    rows[10_000:] = True
    assert lost_at_random(rows, 100) == pytest.approx(0.03, rel=0.1)


def test_an_end_or_a_few_rows_are_no_loss_at_random():
    """A channel that is sampled beside the others lacks a row at an end."""
    few = np.zeros(8000, bool)
    few[-1] = few[0] = True
    assert lost_at_random(few, 100) == 0.0
    few[[100, 2100]] = True
    assert lost_at_random(few, 100) == 0.0
    few[np.arange(500, 8000, 500)] = True
    assert lost_at_random(few, 100) == pytest.approx(17 / 8000, rel=0.01)


def test_a_model_without_a_channel_has_the_same_motion(spacecraft):
    """The others keep their rows and the errors of their calibration."""
    names = 'gain e1_a', 'frequency E1 1', 'gain e2_a'
    craft = replace(spacecraft, calibration=Calibration(names, (0.01, 0.002, 0.03), np.eye(3)))
    fewer = with_channels(craft, ('e1_a', 'e1_b', 'e2_b'))
    assert fewer.calibration.names == names[:2] and fewer.calibration.values == (0.01, 0.002)
    assert np.array_equal(fewer.calibration.covariance, np.eye(2))
    np.testing.assert_array_equal(assemble(fewer).sensor, assemble(craft).sensor[[0, 1, 3]])
    assert with_channels(craft, [s.name for s in craft.sensors]) is craft
    both = [parse_effect(t) for t in ('sensor_gain:channel=e2_a,scale=1.1',
                                      'hub_inertia:scale=1.1')]
    assert of_channels(both, ('e1_a', 'e2_b')) == (both[1],)


def test_a_gap_of_any_length_is_drawn_with_the_spectrum(spacecraft):
    """Twenty seconds: the quiet directions of the channels, 60 dB below, stay quiet."""
    samples = record(spacecraft)
    lost = without(samples, (60.0, 80.0))
    simulator = Simulator(spacecraft, make_frame(24_000, RATE_HZ, SETTINGS), SECONDS)
    for whole in (filled(simulator, lost).values,
                  filled_alike(lost.values, np.isnan(lost.values[:, 0]), 6000)):
        assert np.isfinite(whole).all()
        power = [np.abs(np.fft.rfft(v[5500:8500] * np.hanning(3000)[:, None], axis=0)) ** 2
                 for v in (samples.values, whole)]
        # between the modes, 25 to 30 Hz: a step at an edge of the gap would be far above
        quiet = [p[750:900].mean() for p in power]
        assert quiet[1] < 2.5 * quiet[0]
        assert whole[6000:8000].std() == pytest.approx(samples.values.std(), rel=0.5)


@pytest.mark.parametrize('gaps, channels', [
    pytest.param(GAPS, slice(None), marks=pytest.mark.slow), (((120.0, 240.0),), [2])])
def test_a_clean_record_with_gaps_is_clean(spacecraft, gaps, channels):
    """And the answer says what is missing and what was done about it."""
    samples = without(record(spacecraft), *gaps, channels=channels)
    found = diagnose(spacecraft, samples, SETTINGS, effects=FEW)
    assert found.outcome == 'WITHIN_FLOOR', found.signs
    plain = found.to_json()['missing']
    assert plain['gaps'] == len(gaps) and 'are missing' in plain['text']
    if len(gaps) == 1:
        assert any('left out' in s for s in found.signs)


@pytest.mark.slow
def test_gaps_are_filled_as_a_large_effect_has_them(spacecraft):
    """A colour beside gaps is found without bias, and leaves no jump or impulse at their ends."""
    effect = parse_effect('excitation_colour:corner_hz=3')
    samples = simulate_setup(inject(spacecraft, [effect], 100.0), 3)
    comparison = ModelNominal(spacecraft).compare(
        without(samples, (20.0, 22.5), (57.1, 57.4)), SETTINGS,
        ('excitation_colour', 'impulsive_events'), lambda share: None)
    found = comparison.fit(Candidate((effect,)), comparison.null)
    left = comparison.residual(found, simulated=False)
    assert left.p_value > 0.05
    away = np.log(found.candidate.effects[0].corner_hz / effect.corner_hz)
    assert abs(away) < 2.5 * np.sqrt(found.covariance[0, 0])


def test_an_absent_channel_is_said(spacecraft):
    """Three of four sensors of the model are diagnosed."""
    samples = record(spacecraft, 'sensor_gain:channel=e1_b,scale=1.05')
    three = replace(samples, values=samples.values[:, :3], channels=samples.channels[:3])
    found = diagnose(spacecraft, three, SETTINGS, effects=FEW)
    assert found.verdict['effects'] == ('sensor_gain',)
    assert any('e2_b of the model is not in the record' in s for s in found.signs)
    assert found.missing.channels == {'e2_b': 1.0}


@pytest.mark.slow
def test_an_effect_is_named_beside_gaps(spacecraft):
    """A gain, though a tenth of the rows is missing, and its interval covers it."""
    samples = without(record(spacecraft, 'sensor_gain:channel=e2_b,scale=1.04'), *GAPS,
                      (210.0, 225.0))
    found = diagnose(spacecraft, samples, SETTINGS, effects=FEW)
    assert found.verdict['effects'] == ('sensor_gain',)
    value = found.candidates[0].parameters['sensor_gain.scale']
    assert value.low90 < 1.04 < value.high90


def test_a_recording_as_nominal_takes_gaps_too(spacecraft):
    """Of the reference and of the record, in other places."""
    reference, samples = record(spacecraft, seed=4), record(spacecraft, seed=3)
    found = diagnose(RecordedNominal(without(reference, (100.0, 130.0))),
                     without(samples, *GAPS), SETTINGS, effects=FEW)
    assert found.outcome == 'WITHIN_FLOOR', found.signs
    assert any('in the reference' in s for s in found.signs)
    assert found.missing.gaps == 2


@pytest.mark.parametrize('text, named', [
    ('', []), pytest.param('dropped_samples:fraction=0.08', ['dropped_samples'],
                           marks=pytest.mark.slow),
    pytest.param('timestamp_jitter:rms_s=0.0005', ['timestamp_jitter'],
                 marks=pytest.mark.slow)])
def test_channels_that_are_read_one_beside_the_other(spacecraft, text, named):
    """They are compared as they were read: lost rows cost no more, jitter is of each instant."""
    late = (0.0, 0.31, -0.46, 0.12)
    setup = inject(spacecraft, [parse_effect(text)] if text else (), SECONDS)
    samples = replace(simulate_setup(replace(setup, late=late), 5), late=late)
    found = diagnose(spacecraft, samples, effects=[*FEW, 'timestamp_jitter'], pairs=False)
    assert found.outcome == ('EXPLAINED' if named else 'WITHIN_FLOOR'), found.candidates
    assert not named or list(found.candidates[0].effects) == named


def test_most_values_of_coarse_steps_may_be_zero():
    """Only what is far from all others is no acceleration."""
    steps = np.round(0.4 * np.random.default_rng(1).standard_normal(3000))
    assert np.median(np.abs(steps)) == 0.0
    assert unusable('a', steps, RATE_HZ, 10.0) == ''
    steps[700] = 1e30
    with pytest.raises(ValueError, match='shows 1e[+]30 m/s.2 at 7 s'):
        unusable('a', steps, RATE_HZ, 10.0)
