"""Sealing, publishing, archiving, revealing, scoring; and that only the samples say the label."""
import ast
import json
import lzma
from pathlib import Path
import shutil
import subprocess
import sys

from blindgen import verify
from blindgen.__main__ import main, SCOPES
from blindgen.cases.bag import message, read_bag, stamps, write_bag
from blindgen.cases.draw import draw_case, SMALL
from blindgen.cases.make import make, write_case
from blindgen.cases.plan import drafts
from blindgen.proof.register import enter, entries, open_campaigns
from blindgen.proof.seal import case_name, merkle_root, read_json, seed_of, sha
from blindgen.run.campaign import labels_of, Run, run
from blindgen.run.spread import spread
from blindgen.run.tool import answer
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
import yaml

CASES = 6
# of every kind; which effects and spacecraft does not matter here, so some that are soon made
PLAN = [('single', (('sensor_gain', 8.0),), 2),
        ('pair', (('dropped_samples', 5.0), ('harmonic_disturbance', 5.0)), 53),
        ('outside', (('extra_oscillator', 5.0),), 58), *(('none', (), k) for k in (4, 7, 10))]
# A tool that answers by one byte of the samples: it must score as chance does. What it finds in
# its folders, its home and its temporary folder goes into the answer.
TOOL = """
import json, os, pathlib, sys, tempfile
bag, out, model, *healthy = map(pathlib.Path, sys.argv[1:])
around = sorted(p.name for d in (bag.parent, pathlib.Path.home(), tempfile.gettempdir())
                for p in pathlib.Path(d).iterdir())
(pathlib.Path.home() / 'state').write_text('of a run')
odd = (bag / 'bag.mcap').read_bytes()[5000] % 2
json.dump({'schema': 'ssi_ros/diagnosis/1', 'outcome': 'EXPLAINED' if odd else 'WITHIN_FLOOR',
           'candidates': [], 'verdict': {'effects': ['sensor_gain'] if odd else [], 'class': [],
           'probability': 0.5}, 'where': {}, 'around': around, 'healthy': len(healthy),
           'model': model.read_text()}, open(out, 'w'))
"""


def git(repository, *words):
    """Run git in a working tree."""
    return subprocess.run(['git', '-C', str(repository), '-c', 'user.name=a', '-c',
                           'user.email=a@b', *words], check=True, capture_output=True, text=True)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Run a campaign of small cases from the command line, in this process."""
    base = tmp_path_factory.mktemp('blind')
    (base / 'tool.py').write_text(TOOL)
    (base / 'repository').mkdir()
    git(base / 'repository', 'init', '--quiet')
    for key, value in (('user.name', 'a'), ('user.email', 'a@b')):
        git(base / 'repository', 'config', key, value)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr('blindgen.cases.make.drafts', lambda count, seed, scope: PLAN[:count])
        code = main(['campaign', '--cases', str(CASES), '--scope', 'small', '--nonce', 'a test',
                     '--commit', '0' * 40, '--folder', str(base / 'public'), '--workers', '0',
                     '--register', str(base / 'register.jsonl'), '--repository',
                     str(base / 'repository'), '--tool', f'{sys.executable} '
                     f'{base / "tool.py"} {{bag}} {{json}} {{model}} {{healthy}}'])
    assert code == 0
    return base / 'public'


def faults(folder, *more):
    """Return what the verifier, run alone by its path, says of a folder."""
    what = subprocess.run([sys.executable, '-I', verify.__file__, str(folder), *more],
                          capture_output=True, text=True)
    return what.returncode, [x for x in what.stdout.splitlines() if x.startswith('FAULT')]


def test_every_hash_agrees_and_a_change_is_found(folder):
    """A label, a case, an answer or a score that changed after its commitment is a fault."""
    repository = ['--repository', str(folder.parent / 'repository')]
    assert faults(folder, *repository) == (0, [])
    name = sorted(read_json(folder / 'commitment.json')['cases'])[0]
    false = json.loads((folder / 'reveal.json').read_text())
    false['labels'][name]['label']['seed'] += 1
    scores = json.loads((folder / 'scores.json').read_text())
    scores['false_alarms']['hits'] += 1
    answers = json.loads(lzma.decompress((folder / 'answers.json.xz').read_bytes()))
    answers[name] += ' '
    for path, data, word in (
            (folder / 'reveal.json', json.dumps(false).encode(), 'labels are not'),
            (folder / 'scores.json', json.dumps(scores).encode(), 'another false_alarms'),
            (folder / 'answers.json.xz', lzma.compress(json.dumps(answers).encode()),
             'answer has changed'),
            (folder / 'cases' / name / 'model.yaml', b'', 'case has changed')):
        before = path.read_bytes()
        path.write_bytes(data)
        code, found = faults(folder, *repository)
        path.write_bytes(before)
        assert code == 1 and word in found[0]
        # a changed answer is not the one that was archived during the run either
        assert found[1:] == ([f'FAULT {name}: public_part001.json.xz has another answer']
                             if path.suffix == '.xz' else [])


def test_the_archive_is_enough(folder, tmp_path):
    """Without the cases and the single answers the verifier finds the same scores."""
    for name in ('commitment.json', 'answers.json', 'answers.json.xz', 'reveal.json',
                 'scores.json', 'closed.json'):
        shutil.copyfile(folder / name, tmp_path / name)
    assert faults(tmp_path) == (0, [])
    assert (tmp_path / 'answers.json.xz').stat().st_size < 40_000


def test_the_verifier_stands_alone():
    """One file under 300 lines, of the standard library alone."""
    text = Path(verify.__file__).read_text()
    names = {alias.name for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import)
             for alias in node.names}
    names |= {node.module for node in ast.walk(ast.parse(text))
              if isinstance(node, ast.ImportFrom)}
    assert names <= set(sys.stdlib_module_names) and len(text.splitlines()) < 300


def test_the_commitment_is_a_commit_of_its_own(folder, tmp_path):
    """It holds one file, before any answer; a run without it is refused, a later one too."""
    repository = folder.parent / 'repository'
    at = read_json(folder / 'published.json')
    changed = git(repository, 'show', '--name-only', '--format=', at['git_commit']).stdout.split()
    assert changed == ['docs/validation/blind/public_commitment.json']
    copy = tmp_path / 'other'
    shutil.copytree(folder, copy, ignore=shutil.ignore_patterns(
        'cases', 'answers.json*', 'published.json'))
    with pytest.raises(ValueError, match='no git commit yet; run `publish`'):
        run(copy, Run(('{bag} {json}',), repository=repository))
    assert main(['publish', '--folder', str(copy), '--repository', str(repository)]) == 2
    (copy / 'published.json').write_text(json.dumps({**at, 'git_commit': 'f' * 40}))
    with pytest.raises(ValueError, match='another commitment'):
        run(copy, Run(('{bag} {json}',), repository=repository))


def test_the_register_has_every_campaign_and_no_gap(folder, tmp_path):
    """Begun and scored stand there; a dropped one with its reason; a line taken out is noticed."""
    path = folder.parent / 'register.jsonl'
    assert [e['state'] for e in entries(path)] == ['begun', 'scored']
    assert entries(path)[0]['campaign'] == read_json(folder / 'commitment.json')['nonce_sha256']
    other = tmp_path / 'register.jsonl'
    for name in 'abc':
        assert enter(name, 'begun', other) and not enter(name, 'begun', other)
    enter('b', 'dropped', other, reason='the tool was changed')
    assert open_campaigns(other) == ['a', 'c']
    lines = other.read_text().splitlines()
    other.write_text('\n'.join(lines[:1] + lines[2:]) + '\n')
    with pytest.raises(ValueError, match='line 2 does not follow'):
        entries(other)
    with pytest.raises(ValueError, match="state='lost' is not known"):
        enter('a', 'lost', other)


def test_a_tool_gets_one_case_and_nothing_else(folder):
    """Beside each bag lie its healthy recordings, the model and its own output; no name."""
    for name in labels_of(folder):
        what = read_json(folder / 'answers' / f'{name}.json')
        healthy = [f'healthy_{k + 1}' for k in range(what['healthy'])]
        assert set(what['around']) == {'bag', 'model.yaml', 'words.txt', *healthy}
        model = yaml.safe_load(what['model'])
        assert model['uncertainty']['frequency'] > 0.01 and name not in what['model']
        took = read_json(folder / 'runs' / f'{name}.json')
        assert took['exit'] == 0 and 0 < took['seconds'] and 5 < took['peak_mb'] < 1000


def test_a_case_says_nothing_beside_its_samples(folder):
    """
    The model is that of the seed whatever the effect, and so are times and counts of the bags.

    A record with missing scans is the exception that its definition makes: its bag is shorter.
    """
    for name, label in labels_of(folder).items():
        draft = draw_case(label['seed'], SMALL)
        with AnyReader([folder / 'cases' / name / 'bag']) as reader:
            assert reader.start_time == stamps(draft.nominal, np.array([0])).min() or any(
                e['name'] == 'dropped_samples' for e in label['effects'])
            assert {c.topic for c in reader.connections} == {
                f'/accelerometer/{c}' for c in draft.nominal.channels}
    odd = [int(case_name(seed_of('commit', 'nonce'), k)[-1], 16) % 2 for k in range(2000)]
    for part in (odd[::2], odd[:1000]):
        # the parity of a name is independent of the case's number: 4 sd of a fair coin
        assert abs(sum(part) - 500) < 4 * np.sqrt(250)


def test_a_case_alone_is_the_same_case(folder, tmp_path):
    """The order and the number of cases are irrelevant: one made again alone is equal."""
    public, labels = read_json(folder / 'commitment.json'), labels_of(folder)
    name = sorted(labels)[-1]
    assert write_case(tmp_path, name, labels[name], SMALL) == (name, public['cases'][name])


def test_making_again_keeps_the_cases_and_refuses_another_campaign(folder, tmp_path):
    """A killed `make` goes on; another count with the same sealed file is refused."""
    sealed = folder.with_name('public.sealed.json')
    again = make(folder, sealed, CASES, 'a test', '0' * 40, SMALL)
    assert again == read_json(folder / 'commitment.json')
    with pytest.raises(ValueError, match='belongs to another campaign'):
        make(folder, sealed, CASES + 1, 'a test', '0' * 40, SMALL)
    with pytest.raises(ValueError, match='keep it apart'):
        make(tmp_path, tmp_path / 'sealed.json', CASES, 'n', 'c')
    with pytest.raises(ValueError, match='locked'):
        run(folder)


@pytest.mark.slow
def test_a_plan_that_is_drawn_is_made(tmp_path):
    """Whatever the seed draws: the sealed labels are those of the drafts, every case is hashed."""
    public = make(tmp_path / 'public', tmp_path / 'sealed.json', CASES, 'a test', '0' * 40,
                  SMALL, keep=False)
    labels = [v['label'] for v in read_json(tmp_path / 'sealed.json')['labels'].values()]
    planned = drafts(CASES, int(seed_of('0' * 40, 'a test'), 16), SMALL)
    assert sorted((v['seed'], v['kind'], len(v['effects'])) for v in labels) == sorted(
        (seed, kind, len(effects)) for kind, effects, seed in planned)
    assert len(set(public['cases'].values())) == CASES


def test_a_tool_that_never_ends_is_stopped(folder, tmp_path):
    """Its whole process group is killed and the case has no answer."""
    name = sorted(labels_of(folder))[0]
    (tmp_path / 'cases').mkdir()
    (tmp_path / 'cases' / name).symlink_to(folder / 'cases' / name)
    python = sys.executable
    what = answer(tmp_path, name, (f'{python} -c "import time; time.sleep(99)"',), 0.5)
    assert what == (name, 'no answer in 0.5 s')
    what = answer(tmp_path, name, (f'{python} -c "raise SystemExit(3)"', f'{python} -c ""'), 9.0)
    assert what[1].startswith('exit 3, 0, no answer')
    assert not (tmp_path / 'answers' / f'{name}.json').exists()
    # `calibrate` says by its code that the model does not explain all, and has written it
    python += ' -c "import pathlib, sys; pathlib.Path(sys.argv[1]).write_text(sys.argv[2])'
    what = answer(tmp_path, name, (f'{python}; raise SystemExit(1)" {{calibrated}} mended',
                                   f'{sys.executable} -c "import shutil, sys; '
                                   'shutil.copyfile(*sys.argv[1:])" {calibrated} {json}'), 9.0)
    assert what == (name, '')
    assert (tmp_path / 'answers' / f'{name}.json').read_text() == 'mended'


def test_a_written_bag_reads_back(tmp_path, rng):
    """Values and stamps are exact, and the patched bytes are what the library serialises."""
    craft = draw_case(1, SMALL).nominal
    values, index = rng.standard_normal((5, len(craft.sensors))), np.array([0, 1, 2, 4, 250])
    write_bag(tmp_path / 'bag', craft, values, index)
    got = {c: [] for c in craft.channels}
    with AnyReader([tmp_path / 'bag']) as reader:
        for connection, stamp, raw in reader.messages():
            z = reader.deserialize(raw, connection.msgtype).accel.linear.z
            assert raw == message(channel := connection.topic.split('/')[-1], stamp, z)
            got[channel].append((stamp, z))
    want = stamps(craft, index)
    for c, channel in enumerate(craft.channels):
        assert got[channel] == list(zip(want[:, c].tolist(), values[:, c].tolist()))
    what = read_bag(tmp_path / 'bag', craft)
    assert np.array_equal(what[0], values) and np.array_equal(what[1], index)


def test_no_two_plans_have_the_same_shares():
    """Shares, sizes and how often an effect comes are drawn for each campaign."""
    shares, sizes = set(), []
    for seed in range(6):
        plan = drafts(300, seed)
        kinds = [kind for kind, *_ in plan]
        shares.add(tuple(kinds.count(k) for k in ('none', 'single', 'pair', 'outside')))
        assert 36 <= kinds.count('outside') <= 75 and 45 <= kinds.count('none') <= 90
        sizes.append(np.median([t for _, effects, _ in plan for _, t in effects]))
    assert len(shares) == 6 and max(sizes) > 1.1 * min(sizes)


def test_merkle_root_of_three_leaves():
    """The root is the one computed by hand, and every leaf counts."""
    a, b, c = (sha('leaf', x) for x in 'abc')
    assert merkle_root(['a', 'b', 'c']) == sha('node', sha('node', a, b), c)
    assert merkle_root(['a', 'b', 'd']) != merkle_root(['a', 'b', 'c'])


def test_errors_are_sentences(tmp_path, capsys):
    """A user's mistake gives one line and exit code 2, never a traceback."""
    register = ['--register', str(tmp_path / 'register.jsonl')]
    assert main(['run', '--workers', '0', '--folder', str(tmp_path / 'nothing'), *register]) == 2
    assert 'run the step that writes it first' in capsys.readouterr().err
    assert main(['make', '--folder', str(tmp_path / 'f'), '--cases', '3', '--nonce', 'n',
                 '--commit', 'c', '--workers', '0', *register]) == 2
    assert 'ask for 6 or more' in capsys.readouterr().err
    assert sorted(SCOPES) == ['full', 'large', 'pairs', 'small']


def fails_at(k):
    """Fail at two of the jobs, as a case that runs away does."""
    if k in (1, 3):
        raise ArithmeticError(f'job {k} ran away')
    return k


def test_a_case_that_fails_stops_no_other():
    """All others are done, then the failure is raised, with what to do: nothing is lost."""
    done = []
    with pytest.raises(RuntimeError, match='2 of 6 failed.*ArithmeticError.*job 1 ran away'
                                           '(?s:.*)same command again'):
        for k in spread(None, fails_at, [(k,) for k in range(6)], 'test'):
            done.append(k)
    assert done == [0, 2, 4, 5]
