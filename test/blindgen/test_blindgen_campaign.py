"""Sealing, revealing, scoring; and that nothing but the samples tells the label."""
import json
from pathlib import Path
import subprocess
import sys
import time

from blindgen import record, verify
from blindgen.__main__ import main
from blindgen.answers import Answer, NO_ANSWER
from blindgen.bag import message, read_bag, START_NS, write_bag
from blindgen.campaign import answers_of, classes_in, labels_of, run
from blindgen.effects import EFFECTS
from blindgen.make import make
from blindgen.plan import kinds_of
from blindgen.report import BESIDE, report
from blindgen.score import score
from blindgen.seal import bag_name, merkle_root, read_json, seed_of, sha, write_json
from blindgen.spread import spread
from blindgen.tool import answer
from blindgen.wilson import wilson
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from sklearn.ensemble import RandomForestClassifier
from sklearn.model_selection import cross_val_score
import yaml

CASES, DURATION_S = 60, 4.0
# A tool that answers by one byte of the samples: it must score as chance does. What it finds in
# its folders, its home and its temporary folder goes into the answer.
TOOL = """
import json, os, pathlib, sys, tempfile
bag, out = map(pathlib.Path, sys.argv[1:])
around = sorted(p.name for d in (bag.parent, pathlib.Path.home(), tempfile.gettempdir())
                for p in pathlib.Path(d).iterdir())
(pathlib.Path.home() / 'state').write_text('left by a run')
odd = (bag / 'bag.mcap').read_bytes()[5000] % 2
json.dump({'schema': 'ssi_ros/diagnosis/1', 'outcome': 'EXPLAINED' if odd else 'WITHIN_FLOOR',
           'candidates': [], 'verdict': {'effects': ['sensor_gain'] if odd else [], 'class': [],
           'probability': 0.5}, 'where': {}, 'around': around, 'metadata':
           (bag / 'metadata.yaml').read_text()}, open(out, 'w'))
"""


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """
    Run a campaign of sixty short cases from the command line, in this process.

    It proves the machinery from seed to scores, not a diagnosis: 4 s tell nothing, and a start
    that has not settled does not matter. `test_blindgen_tool.py` runs on a Dask cluster.
    """
    base = tmp_path_factory.mktemp('blind')
    (base / 'tool.py').write_text(TOOL)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(record, 'SETTLE_S', 10.0)
        patch.setattr(record, 'LEAD_S', 5.0)
        code = main(['campaign', '--cases', str(CASES), '--duration', str(DURATION_S), '--nonce',
                     'a test', '--commit', '0' * 40, '--folder', str(base / 'public'),
                     '--workers', '0', '--rounds', '0', '--tool',
                     f'{sys.executable} {base / "tool.py"} {{bag}} {{json}}'])
        assert code == 0
        yield base / 'public'


def told_faults(folder, capsys):
    """Return what the verifier, run alone by its path, says of a folder."""
    told = subprocess.run([sys.executable, '-I', verify.__file__, str(folder)],
                          capture_output=True, text=True)
    return told.returncode, [x for x in told.stdout.splitlines() if x.startswith('FAULT')]


def test_every_hash_agrees_and_a_change_is_found(folder, capsys):
    """A label, a bag or an answer that changed after its commitment is a fault, one each."""
    assert told_faults(folder, capsys) == (0, [])
    name = sorted(read_json(folder / 'commitment.json')['bags'])[0]
    told = (folder / 'reveal.json').read_text()
    false = json.loads(told)
    false['labels'][name]['label']['kind'] = 'changed'
    for path, text, word in ((folder / 'reveal.json', json.dumps(false), 'labels are not'),
                             (folder / 'answers' / f'{name}.json', '{}', 'answer has changed'),
                             (folder / 'bags' / name / 'metadata.yaml', '', 'bag has changed')):
        before = path.read_text()
        path.write_text(text)
        code, found = told_faults(folder, capsys)
        path.write_text(before)
        assert code == 1 and len(found) == 1 and word in found[0]


def test_the_verifier_reads_in_one_sitting_and_stands_alone():
    """Sixty lines, of the standard library alone."""
    text = Path(verify.__file__).read_text()
    assert len(text.splitlines()) <= 60 and 'blindgen' not in text


def metadata_of(folder, labels):
    """Return what is seen of each bag without its samples, as numbers, and who lost scans."""
    seen, lost = [], []
    for name in sorted(labels):
        info = yaml.safe_load((folder / 'bags' / name / 'metadata.yaml').read_text())
        info = info['rosbag2_bagfile_information']
        seen.append([info['message_count'], info['duration']['nanoseconds'],
                     info['starting_time']['nanoseconds_since_epoch'],
                     (folder / 'bags' / name / f'{name}.mcap').stat().st_size,
                     int(name[4:], 16) % 2**31])
        lost.append('dropped_samples' in [e['name'] for e in labels[name]['effects']])
    return np.array(seen, dtype=float), np.array(lost)


def test_a_classifier_on_metadata_is_at_chance(folder):
    """
    A forest on counts, times, sizes and names tells no kind of case.

    A record with missing scans is the exception that its definition makes: its bag is shorter.
    """
    labels = labels_of(folder)
    seen, lost = metadata_of(folder, labels)
    kinds = np.array([labels[name]['kind'] for name in sorted(labels)])
    assert len(np.unique(seen[~lost, :4], axis=0)) == 1
    right = cross_val_score(RandomForestClassifier(100, random_state=0), seen[~lost],
                            kinds[~lost], cv=3)
    # the most frequent kind is 60 % of the cases; 0.15 is more than two sd of 58 cases
    assert np.mean(right) < 0.6 + 0.15


def test_a_tool_sees_one_bag_and_nothing_else(folder):
    """Beside each bag lie only its answer-to-be and its own output; nothing of another run."""
    for name in labels_of(folder):
        told = read_json(folder / 'answers' / f'{name}.json')
        assert set(told['around']) == {'bag', 'words.txt'}
        assert name not in told['metadata']
        run = read_json(folder / 'runs' / f'{name}.json')
        assert run['exit'] == 0 and 0 < run['seconds'] < 60 and 5 < run['peak_mb'] < 1000


def test_a_tool_that_never_ends_is_stopped(folder, tmp_path):
    """Its whole process group is killed and the bag has no answer."""
    name = sorted(labels_of(folder))[0]
    (tmp_path / 'bags').mkdir()
    (tmp_path / 'bags' / name).symlink_to(folder / 'bags' / name)
    told = answer(tmp_path, name, f'{sys.executable} -c "import time; time.sleep(99)"', 0.5)
    assert told == (name, 'no answer in 0 s')
    assert not (tmp_path / 'answers' / f'{name}.json').exists()


def test_a_killed_campaign_goes_on(tmp_path):
    """Killed with -9 in the midst of its tool, it ends with each bag answered once."""
    count = tmp_path / 'count'
    (tmp_path / 'tool.py').write_text(TOOL + f"""
import time
with open({str(count)!r}, 'a') as done: print(odd, file=done)
time.sleep(0.3)""")
    quick = ('import sys; from blindgen import record; from blindgen.__main__ import main; '
             'record.SETTLE_S, record.LEAD_S = 10.0, 5.0; sys.exit(main(sys.argv[1:]))')
    command = [sys.executable, '-c', quick, 'campaign', '--cases', '6', '--duration', '2',
               '--commit', 'c', '--folder', str(tmp_path / 'public'), '--workers', '0',
               '--rounds', '0', '--tool',
               f'{sys.executable} {tmp_path / "tool.py"} {{bag}} {{json}}']
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                               cwd=Path(verify.__file__).parent.parent)
    answers = tmp_path / 'public' / 'answers'
    while process.poll() is None and len(list(answers.glob('*.json'))) < 2:
        time.sleep(0.02)
    process.kill()
    process.wait()
    before = {p.name: p.stat().st_mtime_ns for p in answers.glob('*.json')}
    assert len(before) == 2 and not (tmp_path / 'public' / 'reveal.json').exists()
    assert main(command[3:]) == 0
    after = {p.name: p.stat().st_mtime_ns for p in answers.glob('*.json')}
    assert len(after) == 6 and before.items() <= after.items()
    # the one that was running when the kill came ran again; none that had answered did
    assert 6 <= len(count.read_text().split()) <= 7


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
    told = _write(tmp_path, name, labels[name]['label'], DURATION_S)
    assert told == (name, public['bags'][name])


def test_making_again_keeps_the_bags_and_refuses_another_campaign(folder):
    """A killed `make` goes on; another count with the same sealed file is told."""
    sealed = folder.with_name('public.sealed.json')
    before = read_json(folder / 'commitment.json')
    again = make(folder, sealed, CASES, 'a test', '0' * 40, DURATION_S, None, [])
    assert again == before
    with pytest.raises(ValueError, match='belongs to another campaign'):
        make(folder, sealed, CASES + 1, 'a test', '0' * 40, DURATION_S, None, [])


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
    told = read_bag(tmp_path / 'bag')
    assert np.array_equal(told[0], values) and np.array_equal(told[1], index)


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
             'detectability': 8.0, 'where': {
                 'site': EFFECTS[n].site, 'channels': ['e1_a'], 'arrays': ['E1'],
                 'bands': [0.5, 0.5] + 98 * [0.0], 'modes': [[0.361, 0.9], [31.0, 0.1]],
                 'times': [1.0] + 19 * [0.0]}} for n in name]}
        outcome = {'none': 'WITHIN_FLOOR', 'outside': 'UNEXPLAINED'}.get(kind, 'EXPLAINED')
        effects = frozenset(name) if kind == 'single' else frozenset()
        scale = f'{name[0]}.scale' if effects else ''
        answers[str(k)] = Answer(
            outcome, effects, effects, 0.97, (effects,), {scale: 1.11} if effects else {},
            {scale: (1.0, 1.2)} if effects else {}, 0.9, EFFECTS[name[0]].site if name else '',
            (('e1_a', 0.9), ('e2_a', 0.1)), ((0.1, 4.0, 0.8), (4.0, 50.0, 0.2)),
            ((0.36, 0.7), (30.9, 0.3)), ((0.0, 60.0, 0.9), (60.0, 600.0, 0.1)))
    return labels, answers


def test_right_answers_score_one_and_shuffled_ones_chance(rng):
    """Right answers are right everywhere; shuffled over 30 effects they are right by luck."""
    labels, answers = synthetic(rng)
    good = score(labels, answers)
    for key in ('top1_strict', 'top1_class', 'top3', 'outside_flagged', 'coverage90',
                'site_right', 'sensor_right', 'side_right', 'mode_right', 'band_right',
                'time_right'):
        assert good[key]['value'] == 1.0, key
    assert good['failures'] == [] and good['false_alarms']['value'] == 0.0
    assert good['calibration_error']['value'] == pytest.approx(0.03)
    # 1.11 for 1.1 is a tenth of the change too much
    assert all(v['median'] == pytest.approx(0.1) for v in good['parameter_error'].values())
    assert good['mode_right']['chance'] == 0.5
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
                                            'parameters': {}, 'detectability': 8.0, 'where': {
                                                'site': 'sensor', 'channels': [], 'arrays': [],
                                                'bands': [], 'modes': [], 'times': []}}]}
    told = frozenset({'sensor_crosstalk'})
    said = Answer('TIED', told, told | {'sensor_gain'}, 0.6, (told,))
    alone = score({'a': label}, {'a': said})
    declared = score({'a': label}, {'a': said}, [['sensor_gain', 'sensor_crosstalk']])
    assert (alone['top1_class']['hits'], declared['top1_class']['hits']) == (0, 1)
    assert declared['top1_strict']['hits'] == 0


def test_a_missing_answer_counts_as_wrong(folder):
    """A bag without a readable answer is a failure, not left out."""
    labels = labels_of(folder)
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
    assert main(['run', '--workers', '0', '--folder', str(tmp_path / 'nothing')]) == 2
    assert 'run the step that writes it first' in capsys.readouterr().err
    assert main(['make', '--folder', str(tmp_path / 'f'), '--cases', '3', '--nonce', 'n',
                 '--commit', 'c', '--workers', '0']) == 2
    assert 'ask for 6 or more' in capsys.readouterr().err
    with pytest.raises(ValueError, match='no list of lists of names'):
        classes_in({'classes': ['sensor_gain']})


def test_closed_by_the_truth_against_the_tools(rng):
    """The error is that of cases where both closed shares exist: 0.9 told against 1.0 true."""
    labels, answers = synthetic(rng, 60)
    some = [name for name, label in labels.items() if label['kind'] == 'single'][:10]
    truths = {name: {'closed': 1.0} for name in some}
    told = score(labels, answers, truths=truths)['closed_error']
    assert told['total'] == 10 and told['value'] == pytest.approx(0.1)


def fails_at(k):
    """Fail at two of the jobs, as a case that runs away does."""
    if k in (1, 3):
        raise ArithmeticError(f'job {k} ran away')
    return k


def test_a_case_that_fails_stops_no_other():
    """All others are done, then the failure is told, with what to do: nothing is lost quietly."""
    done = []
    with pytest.raises(RuntimeError, match='2 of 6 failed.*ArithmeticError.*job 1 ran away'
                                           '(?s:.*)same command again'):
        for k in spread(None, fails_at, [(k,) for k in range(6)], 'test'):
            done.append(k)
    assert done == [0, 2, 4, 5]


def test_the_report_lists_each_failure_once(rng, tmp_path):
    """Clear failures one a line, with their truth; missed weak effects together, by effect."""
    labels, answers = synthetic(rng, 60)
    singles = [name for name, label in labels.items() if label['kind'] == 'single']
    for name in singles[:5]:
        labels[name]['effects'][0]['detectability'] = 2.0
        answers[name] = Answer('WITHIN_FLOOR')
    for name in singles[5:8]:
        answers[name] = Answer('UNEXPLAINED', probability=0.7)
    scores = score(labels, answers)
    scores['baselines'] = {'by_chance': {key: scores[key] for key in BESIDE}}
    write_json(tmp_path / 'scores.json', scores)
    write_json(tmp_path / 'commitment.json',
               {'duration_s': 4.0, 'commit': '0' * 40, 'merkle_root': '0' * 64})
    lines = report(tmp_path)
    assert sum(line.endswith('| 8.0 | UNEXPLAINED | 0.70 |') for line in lines) == 3
    assert '8 answers are wrong. 5 of them' in '\n'.join(lines)
    assert sum(line.startswith('| by chance |') for line in lines) == 1
    weak = [line for line in lines if '2.0' in line.split('|')[-2:][0]]
    assert sum(line.count('2.0') for line in weak) == 5
    # 28 of 31 are right, 0.90, of an interval from 0.75 that holds the target, 0.85
    met = next(line for line in lines if line.startswith('| named strictly'))
    assert met.endswith(f'| {len(singles) - 5} | yes, open |')
