"""Recovery: what parts two recordings is named; nothing is named where nothing does."""
import json
import os
from pathlib import Path

import numpy as np
import pytest
from reference_records import chain, diagnose_reference, RATE_HZ, slipping
from scipy.io import loadmat
from ssi_ros.bag import write_samples
from ssi_ros.cli.main import main
from ssi_ros.records import Samples

DATA = Path(os.environ.get('SSI_ROS_DATA',
                           Path(__file__).resolve().parents[3].parent / 'shared' / 'data'))
measured = pytest.mark.skipif(not (DATA / 'f16_level1.npz').is_file(),
                              reason='the measured records are not here (SSI_ROS_DATA)')


def changed(samples, change):
    values = samples.values.copy()
    return Samples(change(values), samples.rate_hz, samples.channels)


def bridge_halves():
    rows = np.asarray(loadmat(DATA / 'BridgeData.mat')['rz'], float)
    rows = rows.T if rows.shape[0] < rows.shape[1] else rows
    return [Samples(r, 15.0, tuple('abcde')) for r in np.array_split(rows, 2)]


@pytest.mark.parametrize('level', [1.0, 1.4])
def test_another_record_of_the_same_structure_is_quiet(level):
    """Other seed, other level: no gap."""
    found = diagnose_reference(chain(21), chain(22, level=level))
    assert found.outcome == 'WITHIN_FLOOR'
    assert found.verdict['effects'] == ()


@pytest.mark.parametrize('seed', [34, 68])
def test_an_offset_of_narrowband_motion_is_no_drift(seed):
    """The median of a few modes is far from their mean; what it leaves is nothing slow."""
    one, two = chain(seed), chain(seed + 1)
    assert np.abs(np.median(two.values, axis=0)).max() > 0.02
    assert diagnose_reference(one, two).outcome == 'WITHIN_FLOOR'
    offset = changed(two, lambda v: v + [9.8, 0.0, -3.0])
    assert diagnose_reference(one, offset).outcome == 'WITHIN_FLOOR'


def test_a_gain_is_named_with_its_channel_and_size():
    """Channel b times 1.05."""
    found = diagnose_reference(chain(23), changed(chain(24), lambda v: v * [1.0, 1.05, 1.0]))
    top = found.candidates[0]
    assert top.effects == ('sensor_gain',)
    assert 'sensor_gain.channel.b' in top.parameters
    value = top.parameters['sensor_gain.scale']
    assert abs(value.value - 1.05) < 4 * value.std       # 4 of its own standard deviations
    assert max(found.where.site, key=found.where.site.get) == 'sensor'


@pytest.mark.parametrize('scale, level', [
    pytest.param(1.5, 1.0, marks=pytest.mark.slow), (0.7, 2.0)])
def test_a_large_gain_needs_no_forces_of_other_levels(scale, level):
    """The noise of the samples is scaled as well; what one level explains frees no others."""
    found = diagnose_reference(chain(23), changed(chain(24, level=level),
                                                  lambda v: v * [1.0, scale, 1.0]))
    assert (found.outcome, found.verdict['effects']) == ('EXPLAINED', ('sensor_gain',))
    value = found.candidates[0].parameters['sensor_gain.scale'].value
    # forces whose levels are free take up a little of it
    assert value == pytest.approx(scale, rel=0.01 if level == 1.0 else 0.03)


def test_one_softer_mode_is_told_as_structure_and_as_that_mode():
    """The second mode is 4 % softer."""
    found = diagnose_reference(chain(25), chain(26, scale=(1.0, 0.96, 1.0)))
    assert found.verdict['effects'] == ('stiffness_scale',)
    assert found.where.modes[0]['frequency_hz'] == pytest.approx(5.3, rel=0.02)
    assert 'hinge_compliance' in found.verdict['class']     # geometry would have to part them


def test_all_frequencies_alike_are_tied_with_the_clock():
    """2 % of stiffness everywhere: no output-only record can tell it from a clock."""
    found = diagnose_reference(chain(27), chain(28, scale=(0.98, 0.98, 0.98)))
    assert found.outcome == 'TIED'
    assert set(found.verdict['class']) >= {'stiffness_scale', 'clock_rate'}
    assert any('clock' in s for s in found.separate_by)


@pytest.mark.slow
def test_modes_that_moved_far_are_followed():
    """A third less stiffness everywhere: modes lie where the reference has none."""
    found = diagnose_reference(chain(27), chain(28, scale=(0.67, 0.67, 0.67)))
    top = found.candidates[0]
    assert top.effects == ('stiffness_scale',)
    values = [v.value for v in top.parameters.values()]
    assert values == pytest.approx([0.67] * len(values), rel=0.04)
    assert top.closed > 0.7         # 0.31 by what follows no move


def test_thirty_seconds_of_one_channel_work():
    """Quiet with itself, and a strong line is found at its frequency."""
    one, two = chain(29, 30.0, channels=1), chain(30, 30.0, channels=1)
    assert diagnose_reference(one, two).outcome == 'WITHIN_FLOOR'
    t = np.arange(len(two.values)) / RATE_HZ
    line = changed(two, lambda v: v + 3.0 * np.sin(2 * np.pi * 13.1 * t)[:, None])
    found = diagnose_reference(one, line)
    assert 'harmonic_disturbance' in found.verdict['effects']
    top = found.candidates[0]
    # the grid of 1 / 30 s; 20 % for the amplitude between two of its lines
    frequency, size = (top.parameters[f'harmonic_disturbance.{n}'].value
                       for n in ('frequency_hz', 'acceleration_m_s2'))
    assert frequency == pytest.approx(13.1, abs=0.04)
    assert size == pytest.approx(3.0, rel=0.2)


def test_rounding_that_the_reference_has_too_is_no_gap():
    """What both recordings show is no difference; what only the record shows is one."""
    coarse = [changed(chain(s), lambda v: np.rint(v / 0.2) * 0.2) for s in (31, 32)]
    assert diagnose_reference(*coarse).outcome == 'WITHIN_FLOOR'
    found = diagnose_reference(chain(31), coarse[1])
    assert found.verdict['effects'] == ('quantisation',)
    value = found.candidates[0].parameters['quantisation.step_m_s2'].value
    assert value == pytest.approx(0.2, rel=1e-6)            # it is read off exactly


@pytest.mark.parametrize('effect', ['quantisation', 'stiffness_drift'])
def test_effects_without_a_modal_form_can_be_asked_for_alone(effect):
    """A rounded record: its own effect explains it, another leaves it unexplained or unnoticed."""
    coarse = changed(chain(32), lambda v: np.rint(v / 0.2) * 0.2)
    found = diagnose_reference(chain(31), coarse, effects=(effect,))
    assert (found.outcome == 'EXPLAINED') == (effect == 'quantisation')


def test_a_slipping_joint_at_a_higher_level_is_structure_and_may_depend_on_amplitude():
    """A Jenkins joint three times above its yield force: tied with a plain loss of stiffness."""
    found = diagnose_reference(slipping(33, 0.1), slipping(34, 0.3))
    assert max(found.where.site, key=found.where.site.get) == 'structure'
    assert set(found.verdict['class']) >= {'hinge_friction', 'hinge_freeplay'}
    assert any('another level' in s for s in found.separate_by)


def test_too_little_data_says_how_much():
    """An outcome with the length needed, no verdict."""
    found = diagnose_reference(chain(35, 2.0), chain(36, 2.0))
    assert found.outcome == 'TOO_LITTLE_DATA'
    assert 'are needed' in found.reason


def test_an_unknown_effect_is_refused_with_the_near_ones():
    """As everywhere."""
    with pytest.raises(ValueError, match='did you mean sensor_gain'):
        diagnose_reference(chain(1, 30.0), chain(2, 30.0), effects=['sensor_gian'])


def test_the_verb_takes_two_bags_and_writes_the_fixed_schema(tmp_path, capsys):
    """Two bags, one with a gain; JSON keys, and probabilities that sum to 1."""
    loud = changed(chain(38, 120.0), lambda v: v * [1.0, 1.0, 1.2])
    for name, samples in (('before', chain(37, 120.0)), ('after', loud)):
        write_samples(tmp_path / name, Samples(samples.values, RATE_HZ, samples.channels, 10 ** 9))
    out = tmp_path / 'diagnosis.json'
    words = ['diagnose', str(tmp_path / 'after'), '--reference', str(tmp_path / 'before')]
    assert main([*words, '--json', str(out)]) in (0, 1)
    plain = json.loads(out.read_text())
    assert plain['schema'] == 'ssi_ros/diagnosis/1'
    assert set(plain['where']) >= {'site', 'sensors', 'bands', 'modes', 'times'}
    assert plain['verdict']['effects'] == ['sensor_gain']
    # 1e-9: a softmax, so only round-off
    assert sum(c['probability'] for c in plain['candidates']) == pytest.approx(1.0, abs=1e-9)
    assert main([*words, '--apply', str(tmp_path / 'x.yaml')]) == 2
    assert 'give --model as well' in capsys.readouterr().err


@pytest.mark.slow
@measured
def test_f16_the_joint_opens_with_level():
    """Noel and Schoukens 2017: level 1 is linear; at level 5 clearance and friction open."""
    one, five = (Samples(np.load(DATA / f'f16_level{k}.npz')['acceleration'].astype(float), 400.0,
                         ('shaker', 'wing', 'payload')) for k in (1, 5))
    halves = [one.between(0, 92.16), one.between(92.16, 184.32)]
    assert diagnose_reference(*halves).outcome == 'WITHIN_FLOOR'
    found = diagnose_reference(one, five)
    # a joint that opens is in the class, or nothing is named and the place is right
    assert found.outcome == 'UNEXPLAINED' or (
        set(found.verdict['class']) & {'hinge_friction', 'hinge_freeplay'})
    assert max(found.where.site, key=found.where.site.get) == 'structure'
    # either side of the joint moves otherwise, not what the shaker drives
    assert max(found.where.sensors, key=lambda s: s['share'])['name'] in ('wing', 'payload')
    # the torsion mode that the authors name is among the three that changed most
    assert any(abs(m['frequency_hz'] - 7.35) < 0.1 for m in found.where.modes[:3])


@measured
def test_bridge_halves_have_no_gap():
    """E. Cheynet's simulated bridge, 5 channels at 15 Hz, against itself."""
    assert diagnose_reference(*bridge_halves()).outcome == 'WITHIN_FLOOR'


@measured
def test_one_sample_late_on_the_bridge_is_a_delay():
    """The second half with one channel a sample late, 67 ms: within 5 %, and it is explained."""
    one, two = bridge_halves()

    def late(values):
        values[1:, 1] = values[:-1, 1].copy()
        return values
    found = diagnose_reference(one, changed(two, late))
    assert found.outcome == 'EXPLAINED' and found.verdict['effects'] == ('channel_delay',)
    delay = found.candidates[0].parameters['channel_delay.delay_s']
    assert abs(delay.value - 1 / 15.0) < 0.05 / 15.0
