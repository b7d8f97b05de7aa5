# Licensed under the Apache License, Version 2.0.
"""Make a campaign: plan it, seal its labels, write its bags; goes on where it was stopped."""
from pathlib import Path
import shutil

from blindgen.bag import write_bag
from blindgen.plan import Case, case_of, drafts, scenario_of
from blindgen.record import simulate
from blindgen.seal import (bag_name, canonical, hash_of_folder, leaf, merkle_root, read_json,
                           salt_of, SCHEMA, seed_of, sha, write_json)
from blindgen.spread import spread


def make(folder, sealed, count, nonce, commit, duration_s=600.0, client=None, classes=()):
    """
    Write the bags of a campaign, its public commitment and, apart from them, its sealed labels.

    Parameters
    ----------
    folder : Path
        Gets `bags/` and `commitment.json`.
    sealed : Path
        Gets labels, salts and nonce; it must not lie inside the folder.
    count : int
        Number of cases.
    nonce : str
        Secret until the reveal.
    commit : str
        Of the frozen tool.
    duration_s : float
        Of each record [s].
    client : distributed.Client
        Spreads the work; None does it here.
    classes : list of lists of str
        Equivalence classes declared before the run.

    Raises
    ------
    ValueError
        If the sealed file would lie with the bags, or belongs to another campaign.

    """
    folder, sealed = Path(folder).resolve(), Path(sealed).resolve()
    if folder == sealed.parent or folder in sealed.parents:
        raise ValueError(f'sealed file {sealed} lies inside {folder}; keep it apart')
    seed = seed_of(commit, nonce)
    head = {'schema': SCHEMA, 'commit': commit, 'nonce_sha256': sha(nonce), 'count': count,
            'duration_s': duration_s, 'classes_sha256': sha(canonical(classes))}
    if sealed.exists():
        secret = read_json(sealed)
        if {k: secret['public'].get(k) for k in head} != head:
            raise ValueError(f'{sealed} belongs to another campaign; name another file')
    else:
        kept = sealed.with_name(sealed.name + '.parts')
        jobs = [(kept, k, *draft, duration_s, head) for k, draft in
                enumerate(drafts(count, int(seed, 16)))]
        named = {bag_name(seed, k): label for k, label in spread(client, _label, jobs, 'plan')}
        labels = {name: {'salt': salt_of(seed, name), 'label': label}
                  for name, label in sorted(named.items())}
        head['merkle_root'] = merkle_root([leaf(v['salt'], name, v['label'])
                                           for name, v in labels.items()])
        secret = {'public': head, 'nonce': nonce, 'classes': classes, 'labels': labels}
        write_json(sealed, secret)
        shutil.rmtree(kept)
    write_json(folder / 'commitment.json', secret['public'])
    jobs = [(folder, name, v['label'], duration_s) for name, v in secret['labels'].items()]
    hashes = dict(spread(client, _write, jobs, 'bags'))
    public = {**secret['public'], 'bags': dict(sorted(hashes.items()))}
    write_json(folder / 'commitment.json', public)
    return public


def _label(kept, k, kind, effects, seed, duration_s, head):
    """Return the number and the label of a case, kept so that a killed plan goes on."""
    path = Path(kept) / f'{k}.json'
    if path.exists() and (before := read_json(path))['head'] == head:
        return k, before['label']
    # through JSON, so that what is sealed, hashed and simulated is the same to the last digit
    write_json(path, {'head': head, 'label': case_of(kind, effects, seed, duration_s).label()})
    return k, read_json(path)['label']


def _write(folder, name, label, duration_s):
    """Write one bag unless it is there; return its name and hash."""
    bag = Path(folder) / 'bags' / name
    if not bag.exists():
        part = Path(folder) / '.part' / name      # renamed when whole: a kill leaves no half bag
        shutil.rmtree(part, ignore_errors=True)
        part.parent.mkdir(parents=True, exist_ok=True)
        case = Case(**{**label, 'effects': tuple(label['effects'])})
        write_bag(part, *simulate(scenario_of(case), duration_s, case.seed))
        bag.parent.mkdir(parents=True, exist_ok=True)
        part.rename(bag)
    return name, hash_of_folder(bag)
