# Licensed under the Apache License, Version 2.0.
"""
Keep a campaign in the repository while it is answered, and make it again from there.

A campaign may take several evenings, and its folder may be lost between them. Beside the published
commitment lie its labels, veiled by the nonce, and parts of the answers so far, each bound to the
part before. With the nonce, which is in the sealed file and nowhere else, that is enough to go on.
"""
import hashlib
import json
import lzma
from pathlib import Path

from blindgen.proof.repository import commit, commit_of
from blindgen.proof.seal import (canonical, leaf, merkle_root, read_json, salt_of, seed_of, sha,
                                 write_json)
from blindgen.verify import parts_beside


def veil(data, nonce):
    """
    Return bytes that nobody reads without the nonce; of veiled bytes, the bytes.

    The stream is SHAKE-256 of the nonce and is used for the labels of its one campaign alone.
    """
    stream = hashlib.shake_256(f'labels || {nonce}'.encode()).digest(len(data))
    return bytes(a ^ b for a, b in zip(data, stream))


def labels_beside(path):
    """Return the path of the veiled labels that belong to the path of a commitment."""
    return f'{path.removesuffix(".json").removesuffix("_commitment")}_labels.veiled'


def keep_labels(sealed, repository, path):
    """Commit the labels of a campaign, veiled, beside its commitment at `path`."""
    secret = read_json(sealed)
    labels = {name: v['label'] for name, v in secret['labels'].items()}
    commit(repository, labels_beside(path),
           veil(lzma.compress(canonical(labels).encode()), secret['nonce']),
           'Keep the veiled labels of a blind campaign')


def archive(folder, repository):
    """
    Commit the answers that are new since the last part; return how many there are.

    Raises
    ------
    ValueError
        If the campaign is not published, or an archived answer has changed.

    """
    folder, repository = Path(folder), Path(repository)
    path = _published(folder)
    kept, before = archived(repository, path)
    part = {'answers': {}, 'runs': {}}
    for run in sorted((folder / 'runs').glob('*.json')):
        name, answer = run.stem, folder / 'answers' / run.name
        text = answer.read_text() if answer.exists() else None
        if (old := kept['answers'].get(name)) not in (None, text):
            raise ValueError(f'the answer of {name} is not the archived one; put that back from '
                             f'the parts beside {path}')
        if old is None and (text or name not in kept['runs']):
            part['runs'][name] = read_json(run)
            part['answers'].update({name: text} if text else {})
    if part['runs']:
        k = 1 + len(parts_beside(repository / path))
        commit(repository, f'{path.removesuffix(".json").removesuffix("_commitment")}'
                           f'_part{k:03d}.json.xz',
               lzma.compress(canonical({'before': before, **part}).encode(), preset=9),
               f'Archive {len(part["runs"])} more cases of a blind campaign')
    return len(part['runs'])


def archived(repository, path):
    """
    Return {'answers': {case: text}, 'runs': {case: run}} of all parts, and the hash of the last.

    Raises
    ------
    ValueError
        If a part does not follow the part before it.

    """
    data, before = {'answers': {}, 'runs': {}}, sha((Path(repository) / path).read_bytes())
    for part in parts_beside(Path(repository) / path):
        got = json.loads(lzma.decompress(part.read_bytes()))
        if got['before'] != before:
            raise ValueError(f'{part} does not follow the part before it; restore it from git')
        for key, more in data.items():
            more.update(got[key])
        before = sha(part.read_bytes())
    return data, before


def resume(folder, sealed, repository, path, nonce):
    """
    Make folder and sealed file of a published campaign again; return how many cases have run.

    The cases themselves are made when they are run.

    Parameters
    ----------
    folder, sealed : Path
        What was lost; neither may exist.
    repository : Path
        Working tree of git with the commitment, the veiled labels and the parts.
    path : str
        Of the commitment in it.
    nonce : str
        Of the campaign.

    Raises
    ------
    ValueError
        If the folder is there, the nonce is another, or the labels are not the committed ones.

    """
    folder, sealed, repository = Path(folder), Path(sealed), Path(repository)
    if (folder / 'commitment.json').exists():
        raise ValueError(f'{folder} has a campaign; `run` goes on with it')
    published = commit_of(repository, path)
    public = read_json(repository / path)
    if sha(nonce) != public['nonce_sha256']:
        raise ValueError('the nonce is not that of the commitment; give the one of its sealed '
                         'file')
    seed = seed_of(public['commit'], nonce)
    veiled = (repository / labels_beside(path)).read_bytes()
    labels = {name: {'salt': salt_of(seed, name), 'label': label} for name, label in
              json.loads(lzma.decompress(veil(veiled, nonce))).items()}
    if merkle_root([leaf(v['salt'], k, v['label']) for k, v in labels.items()]
                   ) != public['merkle_root']:
        raise ValueError(f'{labels_beside(path)} has other labels than the committed ones')
    kept, _ = archived(repository, path)
    head = {key: value for key, value in public.items() if key != 'cases'}
    write_json(sealed, {'public': head, 'nonce': nonce, 'labels': labels})
    write_json(folder / 'published.json', {'path': path, 'git_commit': published})
    for name, run in kept['runs'].items():
        write_json(folder / 'runs' / f'{name}.json', run)
    (folder / 'answers').mkdir(exist_ok=True)
    for name, text in kept['answers'].items():
        (folder / 'answers' / f'{name}.json').write_text(text)
    (folder / 'commitment.json').write_bytes((repository / path).read_bytes())
    return len(kept['runs'])


def _published(folder):
    if not (folder / 'published.json').exists():
        raise ValueError(f'the commitment of {folder} is no git commit yet; run `publish` first')
    return read_json(folder / 'published.json')['path']
