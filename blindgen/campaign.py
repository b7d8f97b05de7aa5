# Licensed under the Apache License, Version 2.0.
"""
Steps of a campaign after its bags are there: run the tool, lock the answers, reveal the labels.

What is done stays done: a campaign that was killed goes on with the bags that have no answer.
"""
from pathlib import Path

from blindgen.answers import NO_ANSWER, read_answer
from blindgen.seal import read_json, seed_of, sha, write_json
from blindgen.spread import spread
from blindgen.tool import answer, TOOL


def run(folder, tool=TOOL, client=None, timeout_s=600.0):
    """
    Answer every bag that has no answer yet; return {bag: '' or what went wrong}.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    tool : str
        Command with {bag} and {json} in it.
    client : distributed.Client
        Spreads the bags; None runs them here, one after the other.
    timeout_s : float
        A bag that takes longer has no answer.

    Raises
    ------
    ValueError
        If the command lacks {bag} or {json}, the answers are locked, or no bag is there.

    """
    if '{bag}' not in tool or '{json}' not in tool:
        raise ValueError(f'tool={tool!r} lacks {{bag}} or {{json}}; say where they go')
    folder = Path(folder).resolve()
    if (folder / 'answers.json').exists():
        raise ValueError(f'the answers in {folder} are locked; a new run needs a new campaign')
    names = sorted(read_json(folder / 'commitment.json').get('bags', {}))
    if not names:
        raise ValueError(f'{folder} has no finished bags; run `make` to its end')
    jobs = [(str(folder), name, tool, timeout_s) for name in names
            if not (folder / 'answers' / f'{name}.json').exists()]
    return {**dict.fromkeys(names, ''), **dict(spread(client, answer, jobs, 'tool'))}


def classes_in(told):
    """
    Return the equivalence classes, sorted lists of names, in JSON of a file or a command.

    Raises
    ------
    ValueError
        If it is neither a list of lists of names nor an object with such `classes`.

    """
    classes = told.get('classes') if isinstance(told, dict) else told
    if not isinstance(classes, list) or not all(
            isinstance(c, list) and all(isinstance(name, str) for name in c) for c in classes):
        raise ValueError('the classes are no list of lists of names; give [["sensor_gain", '
                         '"sensor_crosstalk"], ...], alone or under the key classes')
    return sorted(sorted(set(c)) for c in classes)


def lock(folder):
    """Hash the answers, before the reveal; return {bag: hash}."""
    folder = Path(folder)
    names = sorted(read_json(folder / 'commitment.json')['bags'])
    files = {name: folder / 'answers' / f'{name}.json' for name in names}
    hashes = {name: sha(f.read_bytes()) if f.exists() else 'no answer'
              for name, f in files.items()}
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
    told = {'nonce': secret['nonce'], 'seed': seed_of(public['commit'], secret['nonce']),
            'classes': secret['classes'], 'labels': secret['labels']}
    write_json(folder / 'reveal.json', told)
    return told


def answers_of(folder):
    """Return {bag: Answer}; a bag without an answer has NO_ANSWER, a false JSON too."""
    folder = Path(folder)
    told = {}
    for name in read_json(folder / 'commitment.json')['bags']:
        path = folder / 'answers' / f'{name}.json'
        try:
            told[name] = read_answer(path)
        except (ValueError, KeyError, TypeError, AttributeError):   # whatever shape it has
            told[name] = NO_ANSWER
    return told


def labels_of(folder):
    """Return {bag: label} of a revealed campaign."""
    told = read_json(Path(folder) / 'reveal.json')['labels']
    return {name: v['label'] for name, v in told.items()}
