"""Sealing, revealing, scoring; and that nothing but the samples tells the label."""
import json
import sys

from blindgen.__main__ import main
from blindgen.answers import Answer, NO_ANSWER
from blindgen.bag import message, START_NS, write_bag
from blindgen.campaign import answers_of, run
from blindgen.effects import EFFECTS
from blindgen.make import make
from blindgen.plan import kinds_of
from blindgen.score import score, wilson
from blindgen.seal import bag_name, merkle_root, read_json, seed_of, sha
from blindgen.verify import faults
import numpy as np
import pytest
from rosbags.highlevel import AnyReader

CASES, DURATION_S = 10, 10.0
# A tool that answers by the parity of the bag's name: it must score as chance does.
TOOL = """
import json, sys
odd = int(sys.argv[1][-1], 16) % 2
json.dump({'schema': 'ssi_ros/diagnosis/1', 'outcome': 'EXPLAINED' if odd else 'WITHIN_FLOOR',
           'candidates': [], 'verdict': {'effects': ['sensor_gain'] if odd else [], 'class': [],
           'probability': 0.5}, 'where': {}}, open(sys.argv[2], 'w'))
"""


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Run a campaign of ten short cases from the command line."""
    base = tmp_path_factory.mktemp('blind')
    (base / 'tool.py').write_text(TOOL)
    code = main(['campaign', '--cases', str(CASES), '--duration', str(DURATION_S), '--nonce',
                 'a test', '--commit', '0' * 40, '--folder', str(base / 'public'), '--tool',
                 f'{sys.executable} {base / "tool.py"} {{bag}} {{json}}'])
    assert code == 0
    return base / 'public'


def test_every_hash_agrees_and_a_change_is_found(folder):
    """A label, a bag or an answer that changed after its commitment is a fault, one each."""
    assert faults(folder) == []
    name = sorted(read_json(folder / 'commitment.json')['bags'])[0]
    told = (folder / 'reveal.json').read_text()
    false = json.loads(told)
    false['labels'][name]['label']['kind'] = 'changed'
    for path, text, word in ((folder / 'reveal.json', json.dumps(false), 'labels are not'),
                             (folder / 'answers' / f'{name}.json', '{}', 'answer has changed'),
                             (folder / 'bags' / name / 'metadata.yaml', '', 'bag has changed')):
        before = path.read_text()
        path.write_text(text)
        found = faults(folder)
        path.write_text(before)
        assert len(found) == 1 and word in found[0]


def test_metadata_tells_nothing(folder):
    """
    All bags have one metadata but for their name, so a classifier on metadata is at chance.

    A record with missing samples is the exception that its definition makes.
    """
    labels = read_json(folder / 'reveal.json')['labels']
    seen = set()
    for name, v in labels.items():
        if 'dropped_samples' not in [e['name'] for e in v['label']['effects']]:
            text = (folder / 'bags' / name / 'metadata.yaml').read_text().replace(name, '')
            seen.add((text, (folder / 'bags' / name / f'{name}.mcap').stat().st_size))
    assert len(seen) == 1


def test_names_tell_nothing():
    """The parity of a name is independent of the case's number: 4 sd of a fair coin."""
    odd = [int(bag_name(seed_of('commit', 'nonce'), k)[-1], 16) % 2 for k in range(2000)]
    for part in (odd[::2], odd[:1000]):
        assert abs(sum(part) - 500) < 4 * np.sqrt(250)


def test_a_bag_alone_is_the_same_bag(folder, tmp_path):
    """The order and the number of bags are irrelevant: one made again alone is equal."""
    from blindgen.make import _write
    public = read_json(folder / 'commitment.json')
    labels = read_json(folder / 'reveal.json')['labels']
    name = sorted(labels)[-1]
    told = _write((str(tmp_path), name, labels[name]['label'], DURATION_S))
    assert told == (name, public['bags'][name])


def test_making_again_keeps_the_bags_and_refuses_another_campaign(folder):
    """A killed `make` goes on; another count with the same sealed file is told."""
    sealed = folder.with_name('public.sealed.json')
    before = read_json(folder / 'commitment.json')
    again = make(folder, sealed, CASES, 'a test', '0' * 40, DURATION_S, 1, [])
    assert again == before
    with pytest.raises(ValueError, match='belongs to another campaign'):
        make(folder, sealed, CASES + 1, 'a test', '0' * 40, DURATION_S, 1, [])


def test_locked_answers_stay(folder):
    """After the answers are hashed nothing runs again."""
    with pytest.raises(ValueError, match='locked'):
        run(folder)


def test_the_sealed_file_may_not_lie_with_the_bags(tmp_path):
    """A tool that is given the folder must not find the labels there."""
    with pytest.raises(ValueError, match='keep it apart'):
        make(tmp_path, tmp_path / 'sealed.json', CASES, 'n', 'c')


def test_a_written_bag_reads_back(tmp_path, rng):
    """Values and stamps are exact, and the patched bytes are what the library serialises."""
    values, index = rng.standard_normal((5, 4)), np.array([0, 1, 2, 4, 250])
    write_bag(tmp_path / 'bag', values, index)
    got = []
    with AnyReader([tmp_path / 'bag']) as reader:
        for connection, stamp, raw in reader.messages():
            z = reader.deserialize(raw, connection.msgtype).accel.linear.z
            assert raw == message(connection.topic.split('/')[-1], stamp, z)
            got.append((stamp, z))
    assert [g[0] for g in got] == list(np.repeat(START_NS + index * 10_000_000, 4))
    assert [g[1] for g in got] == list(values.ravel())


def synthetic(rng, count=600):
    """Return labels of all library effects and the answers that are right."""
    library = sorted(n for n, e in EFFECTS.items() if e.library)
    labels, answers = {}, {}
    for k in range(count):
        kind = ('none', 'single', 'single', 'single', 'outside')[k % 5]
        name = {'none': [], 'outside': ['telegraph_torque']}.get(kind) or [
            library[int(rng.integers(len(library)))]]
        name = [] if kind == 'none' else name
        labels[str(k)] = {'kind': kind, 'effects': [
            {'name': n, 'site': EFFECTS[n].site, 'parameters': {'scale': 1.1}, 'target': 8.0,
             'detectability': 8.0} for n in name]}
        outcome = {'none': 'WITHIN_FLOOR', 'outside': 'UNEXPLAINED'}.get(kind, 'EXPLAINED')
        effects = frozenset(name) if kind == 'single' else frozenset()
        answers[str(k)] = Answer(outcome, effects, effects, 0.97, (effects,),
                                 {f'{name[0]}.scale': (1.0, 1.2)} if effects else {},
                                 EFFECTS[name[0]].site if name else '', '')
    return labels, answers


def test_right_answers_score_one_and_shuffled_ones_chance(rng):
    """Right answers are right everywhere; shuffled over 30 effects they are right by luck."""
    labels, answers = synthetic(rng)
    good = score(labels, answers)
    for key in ('top1_strict', 'top1_class', 'top3', 'outside_flagged', 'coverage90',
                'site_right'):
        assert good[key]['value'] == 1.0, key
    assert good['failures'] == [] and good['false_alarms']['value'] == 0.0
    assert good['calibration_error']['value'] == pytest.approx(0.03)
    names = list(answers)
    bad = score(labels, dict(zip(names, [answers[k] for k in rng.permutation(names)])))
    # 360 cases, 60 % of the shuffled answers name one of 30: 2 % expected, 5 % is 4 sd
    assert bad['top1_strict']['value'] < 0.05
    # a fifth of the shuffled answers is quiet: 0.8 expected, sd 0.037
    assert bad['false_alarms']['value'] == pytest.approx(0.8, abs=0.15)


def test_the_order_of_the_bags_is_irrelevant(rng):
    """Scores of the same answers in another order are the same."""
    labels, answers = synthetic(rng, 60)
    turned = {k: answers[k] for k in reversed(list(answers))}
    assert score(labels, turned) == score(labels, answers)


def test_a_declared_class_counts_and_the_tools_own_does_not(rng):
    """Only classes declared before the run soften the strict score."""
    label = {'kind': 'single', 'effects': [{'name': 'sensor_gain', 'site': 'sensor', 'target': 8.0,
                                            'parameters': {}, 'detectability': 8.0}]}
    told = frozenset({'sensor_crosstalk'})
    answer = Answer('TIED', told, told | {'sensor_gain'}, 0.6, (told,), {}, 'sensor', '')
    alone = score({'a': label}, {'a': answer})
    declared = score({'a': label}, {'a': answer}, [['sensor_gain', 'sensor_crosstalk']])
    assert (alone['top1_class']['hits'], declared['top1_class']['hits']) == (0, 1)
    assert declared['top1_strict']['hits'] == 0


def test_a_missing_answer_counts_as_wrong(folder):
    """A bag without a readable answer is a failure, not left out."""
    labels = {name: v['label'] for name, v in read_json(folder / 'reveal.json')['labels'].items()}
    scores = score(labels, dict.fromkeys(labels, NO_ANSWER))
    assert len(scores['failures']) == CASES and scores['answered']['value'] == 0.0
    assert set(answers_of(folder)) == set(labels)


def test_wilson_published():
    """Wilson's interval for 0 of 10 and 5 of 10 as tabulated: 0-0.278, 0.237-0.763."""
    assert wilson(0, 10)['high95'] == pytest.approx(0.2775, abs=1e-4)
    assert wilson(5, 10)['low95'] == pytest.approx(0.2366, abs=1e-4)


def test_shares_of_the_plan():
    """A fifth without effect, a tenth pairs, a tenth outside the library."""
    assert kinds_of(300) == {'none': 60, 'pair': 30, 'outside': 30, 'single': 180}


def test_merkle_root_of_three_leaves():
    """The root is the one computed by hand, and every leaf counts."""
    a, b, c = (sha('leaf', x) for x in 'abc')
    assert merkle_root(['a', 'b', 'c']) == sha('node', sha('node', a, b), c)
    assert merkle_root(['a', 'b', 'd']) != merkle_root(['a', 'b', 'c'])


def test_errors_are_sentences(tmp_path, capsys):
    """A user's mistake gives one line and exit code 2, never a traceback."""
    assert main(['run', '--folder', str(tmp_path / 'nothing')]) == 2
    assert 'run the step that writes it first' in capsys.readouterr().err
    assert main(['make', '--folder', str(tmp_path / 'f'), '--cases', '3', '--nonce', 'n',
                 '--commit', 'c']) == 2
    assert 'ask for 10 or more' in capsys.readouterr().err
