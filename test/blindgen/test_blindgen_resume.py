"""A campaign over several evenings: its folder is lost, and made again from the repository."""
from dataclasses import replace
from itertools import count
import json
import lzma
import os
import platform
import shutil
import subprocess
import sys

from blindgen import verify
from blindgen.__main__ import main
from blindgen.arithmetic import CHOSEN, ONE_THREAD, without
from blindgen.cases.draw import SMALL
from blindgen.cases.make import at_hand
from blindgen.proof.repository import refuse_changed
from blindgen.proof.seal import read_json
from blindgen.run.archive import archive, archived, veil
from blindgen.run.campaign import Run, run
import pytest

CASES, NONCE = 6, 'a nonce of this test'
PATH = 'docs/validation/blind/lost_commitment.json'
# It answers by the size of the model's file alone, and fails at the third case that it is given.
TOOL = """
import json, pathlib, sys
bag, out, model, state = map(pathlib.Path, sys.argv[1:])
count = int(state.read_text()) + 1 if state.exists() else 1
state.write_text(str(count))
if count == 3:
    raise SystemExit('a crash of the tool')
json.dump({'schema': 'ssi_ros/diagnosis/1', 'outcome': 'WITHIN_FLOOR', 'candidates': [],
           'verdict': {'effects': [], 'class': [], 'probability': 0.5}, 'where': {},
           'size': model.stat().st_size}, open(out, 'w'))
"""


def git(repository, *words):
    """Run git in a working tree; return what it prints."""
    return subprocess.run(['git', '-C', str(repository), *words], check=True, capture_output=True,
                          text=True).stdout


@pytest.fixture(scope='module')
def evening(tmp_path_factory):
    """Run a published campaign of transient cases to its end but for two cases; lose it."""
    base = tmp_path_factory.mktemp('evening')
    (base / 'tool.py').write_text(TOOL)
    repository = base / 'repository'
    repository.mkdir()
    git(repository, 'init', '--quiet')
    for key, value in (('user.name', 'a'), ('user.email', 'a@b')):
        git(repository, 'config', key, value)
    folder, common = base / 'lost', ['--workers', '0', '--register', str(base / 'register.jsonl')]
    with pytest.MonkeyPatch.context() as patch:
        # planned in no time: what is planned does not matter here; seeds of one healthy recording
        patch.setattr('blindgen.cases.make.drafts', lambda count, seed, sizes: [
            ('single', (('dropped_samples', 5.0),), 7),
            *(('none', (), k) for k in (2, 53, 58, 19, 30))])
        assert main(['make', '--cases', str(CASES), '--scope', 'small', '--nonce', NONCE,
                     '--commit', '0' * 40, '--folder', str(folder), '--transient', *common]) == 0
    assert not list((folder / 'cases').iterdir())
    assert main(['publish', '--folder', str(folder), '--repository', str(repository)]) == 0
    tool = f'{sys.executable} {base / "tool.py"} {{bag}} {{json}} {{model}} {base / "count"}'
    how = Run((tool,), 60.0, repository, base / 'lost.sealed.json', part=3)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr('blindgen.run.campaign.time', count(0, 3600).__next__)
        # an hour a case: the evening of four and a half hours ends after four
        failures = run(folder, replace(how, hours=4.5))
    before = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob('*.json'))}
    before['sealed'] = (base / 'lost.sealed.json').read_bytes()
    shutil.rmtree(folder)
    (base / 'lost.sealed.json').unlink()
    return base, how, before, failures


def resumed(base, to):
    """Make the lost campaign again in a folder."""
    return main(['resume', '--folder', str(to), '--nonce', NONCE, '--path', PATH,
                 '--repository', str(base / 'repository'),
                 '--register', str(base / 'register.jsonl')])


@pytest.mark.slow
def test_a_lost_campaign_is_made_again_from_the_repository(evening, tmp_path):
    """Labels, commitment, answers and records of runs are those that were lost, to the byte."""
    base, _, before, failures = evening
    assert resumed(base, folder := tmp_path / 'again') == 0
    after = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob('*.json'))}
    after['sealed'] = (tmp_path / 'again.sealed.json').read_bytes()
    assert after == before
    assert sum(name.startswith('runs/') for name in after) == 4
    # three answers: the tool crashed at the third case, which has a record and no answer
    assert sum(name.startswith('answers/') for name in after) == 3
    assert sum(map(bool, failures.values())) == 1
    assert resumed(base, folder) == 2            # over a campaign that is there: refused


@pytest.mark.slow
def test_it_goes_on_with_the_cases_that_were_not_run(evening, tmp_path):
    """
    The next evening runs the two that are left, made anew with the committed hash, and no other.

    The case at which the tool crashed has no second try; all is archived, locked and verified.
    """
    base, how, before, _ = evening
    repository = tmp_path / 'repository'
    shutil.copytree(base / 'repository', repository)
    folder, sealed = tmp_path / 'lost', tmp_path / 'lost.sealed.json'
    common = ['--register', str(tmp_path / 'register.jsonl')]
    assert main(['resume', '--folder', str(folder), '--nonce', NONCE, '--repository',
                 str(repository), *common]) == 0
    given = int((base / 'count').read_text())
    failures = run(folder, replace(how, repository=repository, sealed=sealed))
    assert int((base / 'count').read_text()) == given + 2 and not any(failures.values())
    assert len(list((folder / 'answers').iterdir())) == 5
    assert len(archived(repository, PATH)[0]['runs']) == 6
    for step in ('lock', 'reveal', 'score'):
        assert main([step, '--folder', str(folder), *common, *(
            ['--workers', '0'] if step == 'score' else [])]) == 0
    assert main(['verify', '--folder', str(folder), '--repository', str(repository)]) == 0
    part = verify.parts_beside(repository / PATH)[0]
    data = json.loads(lzma.decompress(part.read_bytes()))
    name = sorted(data['answers'])[0]
    data['answers'][name] += ' '
    part.write_bytes(lzma.compress(json.dumps(data).encode()))
    found = list(verify.otherwise_archived(repository / PATH, json.loads(lzma.decompress(
        (folder / 'answers.json.xz').read_bytes()))))
    # the part itself, and the one after it, which is bound to what it was
    assert len(found) == 2 and name in found[0] and 'does not follow' in found[1]


@pytest.mark.slow
def test_an_archived_answer_is_not_replaced(evening, tmp_path):
    """Another answer to an archived case is refused, and nothing is committed."""
    base, *_ = evening
    assert resumed(base, folder := tmp_path / 'again') == 0
    head = git(base / 'repository', 'rev-parse', 'HEAD')
    assert archive(folder, base / 'repository') == 0
    answer = sorted((folder / 'answers').iterdir())[0]
    answer.write_text(answer.read_text() + ' ')
    with pytest.raises(ValueError, match=f'answer of {answer.stem} is not the archived one'):
        archive(folder, base / 'repository')
    assert git(base / 'repository', 'rev-parse', 'HEAD') == head


@pytest.mark.slow
def test_a_second_try_is_on_record(evening, tmp_path):
    """Where it is asked for, the crashed case is run again, and its record says so."""
    base, how, before, failures = evening
    repository = tmp_path / 'repository'
    shutil.copytree(base / 'repository', repository)
    assert resumed(base, folder := tmp_path / 'again') == 0
    run(folder, replace(how, repository=repository, sealed=tmp_path / 'again.sealed.json',
                        retry=True))
    crashed = next(name for name, trouble in failures.items() if trouble)
    took = read_json(folder / 'runs' / f'{crashed}.json')
    assert took['trouble'] == '' and 'a crash of the tool' in took['earlier'][0]
    assert crashed in archived(repository, PATH)[0]['answers']


@pytest.mark.slow
def test_nobody_reads_the_labels_without_the_nonce(evening, tmp_path, capsys):
    """The veiled file holds no name of an effect; another nonce is refused."""
    base, _, before, _ = evening
    veiled = (base / 'repository' / 'docs/validation/blind/lost_labels.veiled').read_bytes()
    assert b'effects' not in veiled and veil(veiled, 'other')[:6] != b'\xfd7zXZ\x00'
    assert b'effects' in lzma.decompress(veil(veiled, NONCE))
    assert main(['resume', '--folder', str(tmp_path / 'a'), '--nonce', 'other', '--path', PATH,
                 '--repository', str(base / 'repository')]) == 2
    assert 'nonce is not that of the commitment' in capsys.readouterr().err


@pytest.mark.slow
def test_a_case_made_otherwise_is_refused(evening, tmp_path):
    """A generator or a library that makes other samples does not go on unnoticed."""
    base, *_ = evening
    assert resumed(base, folder := tmp_path / 'again') == 0
    secret = read_json(tmp_path / 'again.sealed.json')['labels']
    one, other = sorted(secret)[:2]
    with at_hand(folder, one, secret[one]['label'], SMALL) as case:
        assert (case / 'bag').is_dir()
    assert not case.exists()
    with pytest.raises(ValueError, match='is not the committed case'):
        with at_hand(folder, one, secret[other]['label'], SMALL):
            pass
    assert not case.exists()


def test_a_tool_that_was_changed_is_refused(tmp_path):
    """Since its commit no file of the tool may differ, committed or not; others may."""
    git(tmp_path, 'init', '--quiet')
    for name in ('tool', 'page'):
        (tmp_path / name).write_text('one')
    git(tmp_path, 'add', '.')
    git(tmp_path, '-c', 'user.name=a', '-c', 'user.email=a@b', 'commit', '-qm', 'one')
    since = git(tmp_path, 'rev-parse', 'HEAD').strip()
    (tmp_path / 'page').write_text('two')
    refuse_changed(tmp_path, since, ['tool'])
    (tmp_path / 'tool').write_text('two')
    with pytest.raises(ValueError, match='1 files differ, the first tool'):
        refuse_changed(tmp_path, since, ['tool'])


@pytest.mark.skipif(platform.machine() != 'x86_64', reason='instructions of x86-64')
def test_the_chosen_instructions_are_used_and_hidden_from_the_tool():
    """Another processor has no other kernels to choose from; a tool chooses its own."""
    said = subprocess.run(
        [sys.executable, '-c', 'import numpy, scipy.linalg, numba, threadpoolctl as t;'
         'from numpy._core._multiarray_umath import __cpu_features__ as f;'
         'print({i["architecture"] for i in t.threadpool_info()}, numba.config.CPU_NAME,'
         '      f["X86_V4"] if "X86_V4" in f else f["AVX512_SKX"])'],
        env={**os.environ, **CHOSEN, **ONE_THREAD}, capture_output=True, text=True, check=True)
    assert said.stdout.split() == ["{'Haswell'}", 'haswell', 'False']
    assert without({**CHOSEN, 'PATH': 'p'}) == {'PATH': 'p'}
