# Licensed under the Apache License, Version 2.0.
"""
Steps of a campaign after its cases are there: run the tool, lock the answers, reveal the labels.

What is done stays done: a campaign that was killed goes on with the cases that have no answer.
"""
import json
import lzma
from pathlib import Path
import subprocess

from blindgen.proof.seal import canonical, read_json, seed_of, sha, write_json
from blindgen.run.spread import spread
from blindgen.run.tool import answer, TOOL
from blindgen.verify import read_answer, unpublished


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
    folder, repository = Path(folder), Path(repository)
    if list((folder / 'answers').glob('*.json')):
        raise ValueError(f'{folder} has answers already; a commitment comes before the first')
    to = repository / path
    to.parent.mkdir(parents=True, exist_ok=True)
    to.write_bytes((folder / 'commitment.json').read_bytes())
    for words in (['add', '--', path], ['commit', '--quiet', '--only', '-m',
                                        'Commit to a blind campaign before its first answer',
                                        '--', path]):
        done = subprocess.run(['git', '-C', str(repository), *words], capture_output=True,
                              text=True)
        if done.returncode:
            raise ValueError(f'git {words[0]} of {path}: {done.stderr.strip()[-300:]}')
    head = subprocess.run(['git', '-C', str(repository), 'rev-parse', 'HEAD'], text=True,
                          capture_output=True).stdout.strip()
    write_json(folder / 'published.json', {'path': path, 'git_commit': head})
    return head


def run(folder, tool=TOOL, client=None, timeout_s=900.0, repository=None):
    """
    Answer every case that has no answer yet; return {case: '' or what went wrong}.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    tool : sequence of str
        Commands; {bag} {healthy} {model} {calibrated} {json} in them are places.
    client : distributed.Client
        Spreads the cases; None runs them here, one after the other.
    timeout_s : float
        A case that takes longer has no answer.
    repository : Path
        Git working tree whose history has the commitment; None runs without that proof.

    Raises
    ------
    ValueError
        If no command has {bag} or {json}, the answers are locked, no case is there, or the
        commitment is not published.

    """
    if not all(any(word in command for command in tool) for word in ('{bag}', '{json}')):
        raise ValueError(f'tool={list(tool)!r} lacks {{bag}} or {{json}}; say where they go')
    folder = Path(folder).resolve()
    if (folder / 'answers.json').exists():
        raise ValueError(f'the answers in {folder} are locked; a new run needs a new campaign')
    names = sorted(read_json(folder / 'commitment.json').get('cases', {}))
    if not names:
        raise ValueError(f'{folder} has no finished cases; run `make` to its end')
    if repository:
        if not (folder / 'published.json').exists():
            raise ValueError(f'the commitment of {folder} is no git commit yet; run `publish` '
                             'first, or give --unpublished for a run that proves nothing')
        if wrong := unpublished(folder, repository):
            raise ValueError(wrong)
    jobs = [(str(folder), name, tuple(tool), timeout_s) for name in names
            if not (folder / 'answers' / f'{name}.json').exists()]
    return {**dict.fromkeys(names, ''), **dict(spread(client, answer, jobs, 'tool'))}


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
