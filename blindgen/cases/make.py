# Licensed under the Apache License, Version 2.0.
"""Make a campaign: plan it, seal its labels, write its cases; goes on where it was stopped."""
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
import shutil

from blindgen.cases.bag import write_bag
from blindgen.cases.draw import draw_case, healthy, Scope, SCOPES, stream
from blindgen.cases.nominal import nominal_yaml
from blindgen.cases.plan import Case, case_of, drafts, scenario_of
from blindgen.physics.record import simulate
from blindgen.proof.seal import (canonical, case_name, hash_of_folder, leaf, merkle_root,
                                 read_json, salt_of, SCHEMA, seed_of, sha, write_json)
from blindgen.run.spread import spread
import numpy as np


def make(folder, sealed, count, nonce, commit, scope=Scope(), client=None, keep=True):
    """
    Write the cases of a campaign, its public commitment and, apart from them, its sealed labels.

    Parameters
    ----------
    folder : Path
        Gets `cases/` and `commitment.json`.
    sealed : Path
        Gets labels, salts and nonce; it must not lie inside the folder.
    count : int
        Number of cases.
    nonce : str
        Secret until the reveal.
    commit : str
        Of the frozen tool.
    scope : Scope
        How far the spacecraft and records range.
    client : distributed.Client
        Spreads the work; None does it here.
    keep : bool
        False takes each case away once it is hashed; it is made again when it is run.

    Raises
    ------
    ValueError
        If the sealed file would lie with the cases, or belongs to another campaign.

    """
    folder, sealed = Path(folder).resolve(), Path(sealed).resolve()
    if folder == sealed.parent or folder in sealed.parents:
        raise ValueError(f'sealed file {sealed} lies inside {folder}; keep it apart')
    seed = seed_of(commit, nonce)
    head = {'schema': SCHEMA, 'commit': commit, 'nonce_sha256': sha(nonce), 'count': count,
            'scope_sha256': hash_of_scope(scope)}
    if sealed.exists():
        secret = read_json(sealed)
        if {k: secret['public'].get(k) for k in head} != head:
            raise ValueError(f'{sealed} belongs to another campaign; name another file')
    else:
        secret = _plan(sealed, count, nonce, seed, scope, client, head)
    if (folder / 'commitment.json').exists():
        before = read_json(folder / 'commitment.json')
        if before['merkle_root'] == secret['public']['merkle_root']:
            return before                        # it is whole: published, perhaps
    jobs = [(folder, name, v['label'], scope, keep) for name, v in secret['labels'].items()]
    hashes = dict(spread(client, write_case, jobs, 'cases'))
    public = {**secret['public'], 'cases': dict(sorted(hashes.items()))}
    write_json(folder / 'commitment.json', public)
    return public


def _plan(sealed, count, nonce, seed, scope, client, head):
    """Plan and seal; what is planned is kept, so that a killed plan goes on."""
    kept = sealed.with_name(sealed.name + '.parts')
    planned = drafts(count, int(seed, 16), scope)
    jobs = [(kept, k, *draft, scope, head) for k, draft in enumerate(planned)]
    named = {case_name(seed, k): label for k, label in spread(client, _label, jobs, 'plan')}
    labels = {name: {'salt': salt_of(seed, name), 'label': label}
              for name, label in sorted(named.items())}
    root = merkle_root([leaf(v['salt'], name, v['label']) for name, v in labels.items()])
    secret = {'public': {**head, 'merkle_root': root}, 'nonce': nonce, 'labels': labels}
    write_json(sealed, secret)
    shutil.rmtree(kept)
    return secret


def _label(kept, k, kind, effects, seed, scope, head):
    """Return the number and the label of a case, kept so that a killed plan goes on."""
    path = Path(kept) / f'{k}.json'
    if path.exists() and (before := read_json(path))['head'] == head:
        return k, before['label']
    # through JSON, so that what is sealed, hashed and simulated is the same to the last digit
    write_json(path, {'head': head, 'label': case_of(kind, effects, seed, scope).label()})
    return k, read_json(path)['label']


def hash_of_scope(scope):
    """Return the hash of a scope, which names it in a commitment."""
    return sha(canonical(asdict(scope)))


def scope_of(public):
    """
    Return the scope of a commitment.

    Raises
    ------
    ValueError
        If it is none of this generator's.

    """
    for scope in SCOPES.values():
        if hash_of_scope(scope) == public['scope_sha256']:
            return scope
    raise ValueError('the scope of the commitment is none of this generator; take the commit of '
                     'the generator that made the campaign')


@contextmanager
def at_hand(folder, name, label, scope):
    """
    Yield the folder of a case; one that is not there is made, compared and taken away again.

    Raises
    ------
    ValueError
        If what is made again is not what was committed.

    """
    case = Path(folder) / 'cases' / name
    if case.exists():
        yield case
        return
    try:
        _, now = write_case(folder, name, label, scope)
        if now != read_json(Path(folder) / 'commitment.json')['cases'][name]:
            raise ValueError(f'{name} made again is not the committed case; use the commit of the '
                             'generator and the versions of requirements.lock that made it')
        yield case
    finally:
        shutil.rmtree(case, ignore_errors=True)


def write_case(folder, name, label, scope, keep=True):
    """Write the bags and the model of one case unless it is there; return its name and hash."""
    case = Path(folder) / 'cases' / name
    if not case.exists():
        part = Path(folder) / '.part' / name      # renamed when whole: a kill leaves no half case
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
        one = Case(**{**label, 'effects': tuple(label['effects'])})
        draft, rng = draw_case(one.seed, scope), stream(one.seed, 97)
        mesh = int(rng.integers(8, 17)), int(rng.integers(3, 6))
        (part / 'model.yaml').write_text(nominal_yaml(draft.nominal, mesh))
        records = [('bag', scenario_of(one, draft), draft.duration_s)]
        records += [(f'healthy_{k}', *each) for k, each in enumerate(healthy(one.seed, draft), 1)]
        for k, (at, scenario, duration) in enumerate(records):
            seed = np.random.SeedSequence(one.seed, spawn_key=(k,))
            write_bag(part / at, draft.nominal, *simulate(scenario, duration, seed))
        case.parent.mkdir(parents=True, exist_ok=True)
        part.rename(case)
    hashed = hash_of_folder(case)
    if not keep:
        shutil.rmtree(case)
    return name, hashed
