# Licensed under the Apache License, Version 2.0.
"""
Steps of a campaign after its cases are there: run the tool, lock the answers, reveal the labels.

What is done stays done: a campaign that was killed goes on with the cases that have no answer.
"""
from dataclasses import dataclass
import json
import lzma
from math import inf
from pathlib import Path
from time import time

from blindgen.cases.make import at_hand, scope_of
from blindgen.proof.repository import commit, refuse_changed
from blindgen.proof.seal import canonical, read_json, seed_of, sha, write_json
from blindgen.run.archive import archive
from blindgen.run.spread import spread
from blindgen.run.tool import answer, TOOL
from blindgen.verify import read_answer, unpublished

FROZEN = ('ssi_ros', 'config')     # what the default tool is made of, as paths of the repository


def publish(folder, repository, path):
    """
    Make the commitment a git commit of its own; return its hash.

    Parameters
    ----------
    folder : Path
        Of the campaign, its cases made and no answer there yet.
    repository : Path
        Working tree of git.
    path : str
        In it, where the commitment goes.

    Raises
    ------
    ValueError
        If an answer is there already, or git refuses.

    """
    folder = Path(folder)
    if list((folder / 'answers').glob('*.json')):
        raise ValueError(f'{folder} has answers already; a commitment comes before the first')
    head = commit(repository, path, (folder / 'commitment.json').read_bytes(),
                  'Commit to a blind campaign before its first answer')
    write_json(folder / 'published.json', {'path': path, 'git_commit': head})
    return head


@dataclass(frozen=True)
class Run:
    """How a tool is run on the cases of a campaign."""

    tool: tuple = TOOL             # {bag} {healthy} {model} {calibrated} {json} are places in it
    timeout_s: float = 900.0       # a case that takes longer has no answer
    repository: Path = None        # git working tree with the commitment; None: without that proof
    sealed: Path = None            # labels, from which cases that are not there are made
    hours: float = inf             # no case is begun after so long
    retry: bool = False            # what ended without an answer is run again
    part: int = 20                 # answers are archived in the repository by so many


def run(folder, how=Run(), client=None):
    """
    Answer every case that was not run yet; return {case: '' or what went wrong}.

    A case that ended without an answer counts as run: a tool has one try at each case, and a
    second one only where `retry` asks for it, which its record keeps.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    how : Run
        Tool, proof and limits.
    client : distributed.Client
        Spreads the cases; None runs them here, one after the other.

    Raises
    ------
    ValueError
        If no command has {bag} or {json}, the answers are locked, no case is there, the
        commitment is not published, or the tool is not that of its commit.

    """
    if not all(any(word in command for command in how.tool) for word in ('{bag}', '{json}')):
        raise ValueError(f'tool={list(how.tool)!r} lacks {{bag}} or {{json}}; say where they go')
    folder = Path(folder).resolve()
    if (folder / 'answers.json').exists():
        raise ValueError(f'the answers in {folder} are locked; a new run needs a new campaign')
    public = read_json(folder / 'commitment.json')
    names = sorted(public.get('cases', {}))
    if not names:
        raise ValueError(f'{folder} has no finished cases; run `make` to its end')
    if how.repository:
        _refuse_unproven(folder, how, public)
    until = time() + 3600 * how.hours
    jobs = [(str(folder), name, tuple(how.tool), how.timeout_s, label, scope, until)
            for name, label, scope in _to_run(folder, names, public, how)]
    failures, new = dict.fromkeys(names, ''), 0
    try:
        for name, trouble in spread(client, _answer, jobs, 'tool'):
            failures[name], new = trouble, new + 1
            if how.repository and new % how.part == 0:
                archive(folder, how.repository)
    finally:
        if how.repository:
            archive(folder, how.repository)
    return failures


def _refuse_unproven(folder, how, public):
    """Raise a ValueError for a run that would prove nothing."""
    if not (folder / 'published.json').exists():
        raise ValueError(f'the commitment of {folder} is no git commit yet; run `publish` '
                         'first, or give --unpublished for a run that proves nothing')
    if wrong := unpublished(folder, how.repository):
        raise ValueError(wrong)
    if how.tool == TOOL:
        refuse_changed(how.repository, public['commit'], FROZEN)


def _to_run(folder, names, public, how):
    """Yield name, label and scope of the cases to run; label and scope None for one at hand."""
    secret = None
    for name in names:
        tried = (folder / 'runs' / f'{name}.json').exists()
        if (folder / 'answers' / f'{name}.json').exists() or tried and not how.retry:
            continue
        if (folder / 'cases' / name).exists():
            yield name, None, None
            continue
        if not (how.sealed and Path(how.sealed).exists()):
            raise ValueError(f'{name} is not in {folder / "cases"}, and no sealed file is there '
                             'to make it again; give --sealed')
        secret = secret or read_json(how.sealed)
        yield name, secret['labels'][name]['label'], scope_of(public)


def _answer(folder, name, tool, timeout_s, label, scope, until):
    """Answer a case unless it is too late to begin one."""
    if time() > until:
        return name, ''
    with at_hand(folder, name, label, scope):
        return answer(folder, name, tool, timeout_s)


def lock(folder):
    """Hash and archive the answers, before the reveal; return {case: hash}."""
    folder = Path(folder)
    names = sorted(read_json(folder / 'commitment.json')['cases'])
    texts = {name: path.read_text() for name in names
             if (path := folder / 'answers' / f'{name}.json').exists()}
    (folder / 'answers.json.xz').write_bytes(lzma.compress(canonical(texts).encode(), preset=9))
    hashes = {name: sha(texts[name]) if name in texts else 'no answer' for name in names}
    write_json(folder / 'answers.json', hashes)
    return hashes


def reveal(folder, sealed):
    """
    Publish labels, salts and nonce, once the answers are locked.

    Raises
    ------
    ValueError
        If the answers are not locked or the sealed file is another campaign's.

    """
    folder = Path(folder)
    public, secret = read_json(folder / 'commitment.json'), read_json(sealed)
    if not (folder / 'answers.json').exists():
        raise ValueError(f'the answers in {folder} are not locked; run `lock` first')
    if secret['public']['merkle_root'] != public['merkle_root']:
        raise ValueError(f'{sealed} belongs to another campaign; give its own sealed file')
    data = {'nonce': secret['nonce'], 'seed': seed_of(public['commit'], secret['nonce']),
            'labels': secret['labels']}
    write_json(folder / 'reveal.json', data)
    return data


def texts_of(folder):
    """Return {case: text of its answer} from the archive of locked answers."""
    return json.loads(lzma.decompress((Path(folder) / 'answers.json.xz').read_bytes()))


def answers_of(folder):
    """Return {case: answer} as the verifier reads them."""
    texts = texts_of(folder)
    return {name: read_answer(texts.get(name))
            for name in read_json(Path(folder) / 'commitment.json')['cases']}


def labels_of(folder):
    """Return {case: label} of a revealed campaign."""
    data = read_json(Path(folder) / 'reveal.json')['labels']
    return {name: v['label'] for name, v in data.items()}
