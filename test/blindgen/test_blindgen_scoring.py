"""Scores of made-up answers, places, the gap meter, baselines and the one-page report."""
from dataclasses import replace
import json

from blindgen.effects import library, sensing  # noqa: F401  (declare the effects)
from blindgen.effects.base import EFFECTS
from blindgen.physics.record import simulate
from blindgen.physics.scenario import Scenario
from blindgen.proof.seal import write_json
from blindgen.scoring import baselines, meter
from blindgen.scoring.features import features
from blindgen.scoring.places import places
from blindgen.scoring.report import report
from blindgen.scoring.score import score
from blindgen.verify import read_answer, row, scores, wilson
import numpy as np
import pytest

WHERE = {'site': 'sensor', 'channels': ['e1_a'], 'arrays': ['E1'], 'half_rate_hz': 50.0,
         'bands': [0.5, 0.5] + 98 * [0.0], 'modes': [[0.361, 0.9], [31.0, 0.1]],
         'times': [1.0] + 19 * [0.0]}
SAID = {'site': {'sensor': 1.0}, 'sensors': [{'name': 'e1_a', 'share': 1.0}],
        'bands': [{'low_hz': 0.0, 'high_hz': 1.0, 'share': 0.8},
                  {'low_hz': 1.0, 'high_hz': 50.0, 'share': 0.2}],
        'modes': [{'frequency_hz': 0.36, 'share': 0.7}, {'frequency_hz': 30.9, 'share': 0.3}],
        'times': [{'start_s': 0.0, 'end_s': 30.0, 'share': 0.9},
                  {'start_s': 30.0, 'end_s': 600.0, 'share': 0.1}]}


def said(outcome, effects=(), probability=0.97, **values):
    """Return the text of an answer."""
    parameters = {f'{effects[0]}.scale': {'value': 1.11, 'low90': 1.0, 'high90': 1.2}} \
        if effects else {}
    return json.dumps({
        'schema': 'ssi_ros/diagnosis/1', 'outcome': outcome, 'where': SAID,
        'verdict': {'effects': list(effects), 'class': [], 'probability': probability},
        'candidates': [{'effects': list(effects), 'parameters': parameters, 'closed': 0.9}]})


def synthetic(rng, count=300):
    """Return labels of all library effects and the answers that are right."""
    names = sorted(n for n, e in EFFECTS.items() if e.library)
    labels, texts = {}, {}
    for k in range(count):
        kind = ('none', 'single', 'single', 'single', 'outside')[k % 5]
        name = {'none': '', 'outside': 'random_filter'}.get(kind, str(rng.choice(names)))
        labels[str(k)] = {'kind': kind, 'seed': k, 'effects': [
            {'name': name, 'parameters': {'scale': 1.1}, 'target': 9.0, 'detectability': 9.0,
             'same': [], 'where': WHERE}] if name else []}
        texts[str(k)] = said({'none': 'WITHIN_FLOOR', 'outside': 'UNEXPLAINED'}.get(
            kind, 'EXPLAINED'), (name,) if kind == 'single' else ())
    return labels, texts


def test_right_answers_score_one_and_shuffled_ones_chance(rng):
    """Right answers are right everywhere; shuffled over 30 effects they are right by luck."""
    labels, texts = synthetic(rng)
    good = score(labels, texts)
    for key in ('class_8', 'strict_4', 'top3_8', 'unknown_8', 'coverage90', 'site_right',
                'sensor_right', 'side_right', 'mode_right', 'band_right', 'time_right'):
        assert good[key]['value'] == 1.0, key
    assert good['failures'] == [] and good['false_alarms']['value'] == 0.0
    assert good['calibration']['value'] == pytest.approx(0.03)
    # 1.11 for 1.1 is a tenth of the change too much
    assert all(v['median'] == pytest.approx(0.1) for v in good['parameter_error'].values())
    names = list(texts)
    bad = score(labels, dict(zip(names, [texts[k] for k in rng.permutation(names)])))
    # 180 cases, 60 % of the shuffled answers name one of 30: 2 % expected, 7 % is 4 sd
    assert bad['strict_8']['value'] < 0.07
    # a fifth of the shuffled answers is quiet: 0.8 expected, sd 0.05
    assert bad['false_alarms']['value'] == pytest.approx(0.8, abs=0.2)
    turned = {k: texts[k] for k in reversed(names)}
    assert score(labels, turned) == good


def test_a_class_of_the_label_counts_and_the_tools_own_does_not():
    """Only what the generator's information could not separate softens the strict score."""
    effect = {'name': 'sensor_gain', 'parameters': {}, 'target': 9.0, 'detectability': 9.0}
    text = json.loads(said('TIED', ('sensor_crosstalk',)))
    text['verdict']['class'] = ['sensor_gain', 'sensor_crosstalk']
    a = read_answer(json.dumps(text))
    for same, right in (([], False), (['sensor_crosstalk'], True)):
        got = row('a', {'kind': 'single', 'effects': [{**effect, 'same': same}]}, a)
        assert (got['strict'], got['right']) == (False, right)
    both = [{**effect, 'same': ['sensor_crosstalk']}, {**effect, 'name': 'clock_rate'}]
    assert not row('a', {'kind': 'pair', 'effects': both}, a)['right']


def test_a_pair_in_a_tie_counts_by_itself():
    """Two pairs tied, the second one true: not named, but tied with what is named first."""
    effect = {'parameters': {}, 'target': 9.0, 'detectability': 9.0}
    text = json.loads(said('TIED', ('sensor_gain', 'clock_rate')))
    text['verdict']['class'] = ['sensor_gain', 'clock_rate', 'stiffness_scale']
    text['candidates'] += [{'effects': e} for e in (['sensor_gain', 'stiffness_scale'],
                                                    ['sensor_gain', 'added_mass'])]
    for second, tied in (('stiffness_scale', True), ('added_mass', False)):
        got = row('a', {'kind': 'pair', 'effects': [
            {**effect, 'name': n} for n in ('sensor_gain', second)]}, read_answer(
                json.dumps(text)))
        assert (got['right'], got['tied_pair']) == (False, tied)


def test_no_answer_and_a_false_one_are_wrong(rng):
    """A case without a readable answer is a failure, not taken out."""
    labels, _ = synthetic(rng, 20)
    got = score(labels, {'0': 'nothing', '1': '{"schema": 1}', '2': '[]'})
    assert len(got['failures']) == 20 and got['answered']['value'] == 0.0
    with pytest.raises(ValueError, match='belong to no case'):
        score(labels, {'other': ''})


def test_the_error_of_the_reduction():
    """0.9 said against 1.0 and 0.6 true: the median of the differences."""
    effect = {'name': 'sensor_gain', 'parameters': {}, 'target': 9.0, 'detectability': 9.0}
    rows = [row(n, {'kind': 'single', 'effects': [effect]},
                read_answer(said('EXPLAINED', ('sensor_gain',)))) for n in 'abc']
    got = scores(rows, {'a': {'closed': 1.0}, 'b': {'closed': 0.6}, 'c': {'closed': None}})
    assert got['closed_error']['total'] == 2
    assert got['closed_error']['value'] == pytest.approx(0.2)


def test_wilson_published():
    """Wilson's interval for 0 of 10 and 5 of 10 as tabulated: 0-0.278, 0.237-0.763."""
    assert wilson(0, 10)['high95'] == pytest.approx(0.2775, abs=1e-4)
    assert wilson(5, 10)['low95'] == pytest.approx(0.2366, abs=1e-4)


def test_places_are_judged_by_what_they_hold():
    """The band named first must hold half of the best; a place that is not named is not judged."""
    true = {**WHERE, 'channels': ['e1_b'], 'bands': 50 * [0.02] + 50 * [0.0], 'modes': [],
            'times': []}
    answer = {'site': 'structure', 'sensors': (('e2_a', 1.0),), 'modes': (), 'times': (),
              'bands': ((0.1, 25.0, 0.3), (25.0, 50.0, 0.7))}
    assert places(true, {'sensor_gain.channel': 'e1_b'}, answer, 600.0) == {
        'sensor': (True, 0.25), 'side': (True, 0.5), 'site': (False, 0.25), 'band': (False, 0.5)}


@pytest.mark.parametrize('name, parameters', [
    ('sensor_gain', {'channel': 'e2_a', 'scale': 1.2}),
    pytest.param('array_asymmetry', {'array': 'E1', 'scale': 0.8}, marks=pytest.mark.slow)])
def test_the_true_effect_closes_its_own_gap(monkeypatch, name, parameters):
    """At its true size an effect leaves the floor: 1 within 0.1; without it there is no gap."""
    monkeypatch.setattr(meter, 'RECORDS', 4)
    plain = Scenario(levels=23 * (1.2,), gaps=((0.1, 0.12),))
    scenario = EFFECTS[name].apply(plain, parameters)
    got = meter.closed_by_truth(plain, scenario, *simulate(scenario, 80.0, 5))
    assert got['before'] > got['floor'] + 3 * got['floor_std']
    assert got['closed'] == pytest.approx(1.0, abs=0.1)
    assert meter.closed_by_truth(plain, scenario, *simulate(plain, 80.0, 6))['closed'] is None


def test_features_are_of_the_difference():
    """A level alone changes nothing; a filter shows in the spectrum, a gap in the samples."""
    healthy = simulate(Scenario(), 60.0, 1)
    loud = (2.0 * healthy[0], healthy[1])
    same = features(loud, healthy)
    # up to rounding, but for its step, which is relative
    assert np.abs(same['spectrum']).max() < 1e-9 and np.abs(same['shifts']).max() < 1e-9
    low = simulate(replace(Scenario(), low_pass=((0, 20.0),)), 60.0, 1)
    assert np.abs(features(low, healthy)['spectrum']).max() > 0.5
    lost = simulate(replace(Scenario(), dropped=0.05), 60.0, 1)
    assert features(lost, healthy)['samples'][0] > 0.03


def test_baselines_learn_and_their_nulls_are_quiet(rng):
    """Of three effects that stand out all four ways detect most, and name what they can."""
    labels = np.array(3 * ['none'] + ['a', 'b', 'c'] * 2)
    labels = np.tile(labels, 12)

    def drawn(labels):
        got = {kind: rng.standard_normal((len(labels), 12)) for kind in baselines.KINDS}
        for j, name in enumerate('abc'):
            for values in got.values():
                values[labels == name, j] += 8.0
        return got

    old, new = drawn(labels), drawn(labels)
    for way in (baselines.random_forest, baselines.neural_posterior, baselines.shift_table):
        got = [read_answer(text) for text in way(labels, old, new)]
        right = [a['effects'] == ([n] if n != 'none' else []) for a, n in zip(got, labels)]
        assert np.mean(right) > 0.8, way.__name__
    got = [read_answer(text)['outcome'] for text in baselines.two_sample(labels, old, new)]
    assert np.mean([o == 'UNEXPLAINED' for o, n in zip(got, labels) if n != 'none']) > 0.9
    assert np.mean([o == 'UNEXPLAINED' for o, n in zip(got, labels) if n == 'none']) < 0.2


def test_the_report_is_one_page(rng, tmp_path):
    """What was hidden, what came out, what is still wrong: under 60 lines for 300 cases."""
    labels, texts = synthetic(rng)
    singles = [name for name, label in labels.items() if label['kind'] == 'single']
    for name in singles[:5]:
        labels[name]['effects'][0]['detectability'] = 2.0
        texts[name] = said('WITHIN_FLOOR')
    for name in singles[5:60]:
        texts[name] = said('UNEXPLAINED', probability=0.7)
    got = score(labels, texts)
    got['baselines'] = {'by_chance': dict(got)}
    write_json(tmp_path / 'scores.json', got)
    write_json(tmp_path / 'commitment.json', {'commit': '0' * 40, 'merkle_root': '0' * 64})
    write_json(tmp_path / 'reveal.json', {'labels': {k: {'label': v} for k, v in labels.items()}})
    lines = report(tmp_path)
    assert len(lines) < 60 and 'not published before its run' in lines[2]
    assert '60 of 300 answers are wrong' in lines[-1]
    assert sum(line.startswith('| by chance |') for line in lines) == 1
    assert [line for line in lines if "d' = 4 | WITHIN_FLOOR | 5 | 2.0" in line]
    # 120 of 175 are named, whose interval lies below 0.9
    named = next(line for line in lines if line.startswith("| single effects named, d' >= 8"))
    assert named.endswith('| 175 | no |')
