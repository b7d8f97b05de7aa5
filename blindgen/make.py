# Licensed under the Apache License, Version 2.0.
"""Make a campaign: plan it, seal its labels, write its bags; goes on where it was stopped."""
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
import shutil

from blindgen.bag import write_bag
from blindgen.plan import Case, plan, scenario_of
from blindgen.record import simulate
from blindgen.seal import (bag_name, canonical, hash_of_folder, leaf, merkle_root, read_json,
                           salt_of, SCHEMA, seed_of, sha, write_json)
from tqdm import tqdm


def make(folder, sealed, count, nonce, commit, duration_s=600.0, workers=1, classes=()):
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
    workers : int
        Processes that write bags.
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
        with tqdm(total=count, desc='plan') as bar:
            cases = plan(count, duration_s, int(seed, 16), lambda done: bar.update(1))
        named = {bag_name(seed, k): case.label() for k, case in enumerate(cases)}
        labels = {name: {'salt': salt_of(seed, name), 'label': label}
                  for name, label in sorted(named.items())}
        head['merkle_root'] = merkle_root([leaf(v['salt'], name, v['label'])
                                           for name, v in labels.items()])
        secret = {'public': head, 'nonce': nonce, 'classes': classes, 'labels': labels}
        write_json(sealed, secret)
    write_json(folder / 'commitment.json', secret['public'])
    jobs = [(str(folder), name, v['label'], duration_s) for name, v in secret['labels'].items()]
    with ProcessPoolExecutor(workers) as pool:
        hashes = dict(tqdm(pool.map(_write, jobs), total=count, desc='bags'))
    public = {**secret['public'], 'bags': dict(sorted(hashes.items()))}
    write_json(folder / 'commitment.json', public)
    return public


def _write(job):
    """Write one bag unless it is there; return its name and hash."""
    folder, name, label, duration_s = job
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
