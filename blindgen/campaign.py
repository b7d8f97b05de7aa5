# Licensed under the Apache License, Version 2.0.
"""
Run a tool over the bags of a campaign: one bag in, one JSON out, in a fresh process each.

The tool is a command line, never an import. What is done stays done: an answer is written under
another name and renamed when whole, so a killed campaign goes on with the next bag. With dask
`distributed` installed, a scheduler's address spreads the bags over its workers.
"""
from concurrent.futures import as_completed, ThreadPoolExecutor
from pathlib import Path
import shlex
import subprocess

from blindgen.answers import NO_ANSWER, read_answer
from blindgen.seal import read_json, seed_of, sha, write_json
from tqdm import tqdm

TOOL = 'ssi_ros diagnose {bag} --model config/spacecraft.yaml --json {json}'


def run(folder, tool=TOOL, workers=2, scheduler='', timeout_s=600.0):
    """
    Answer every bag that has no answer yet; return {bag: '' or what went wrong}.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    tool : str
        Command with {bag} and {json} in it.
    workers : int
        Processes at a time, when no scheduler is given.
    scheduler : str
        Address of a Dask scheduler that sees the same folder, 'local' for a Dask cluster of this
        machine, or '' for a pool without Dask.
    timeout_s : float
        A bag that takes longer has no answer.

    Raises
    ------
    ValueError
        If the command lacks {bag} or {json}, Dask is asked for but absent, or no bag is there.

    """
    if '{bag}' not in tool or '{json}' not in tool:
        raise ValueError(f'tool={tool!r} lacks {{bag}} or {{json}}; say where they go')
    folder = Path(folder).resolve()
    if (folder / 'answers.json').exists():
        raise ValueError(f'the answers in {folder} are locked; a new run needs a new campaign')
    names = sorted(read_json(folder / 'commitment.json').get('bags', {}))
    if not names:
        raise ValueError(f'{folder} has no finished bags; run `make` to its end')
    jobs = [(str(folder), name, tool, timeout_s) for name in names]
    if scheduler:
        return _with_dask(jobs, workers, scheduler)
    with ThreadPoolExecutor(workers) as pool:
        futures = [pool.submit(answer, *job) for job in jobs]
        return dict(f.result() for f in tqdm(as_completed(futures), total=len(jobs), desc='tool'))


def answer(folder, name, tool, timeout_s):
    """Run the tool on one bag unless its answer is there; return its name and any failure."""
    done = Path(folder) / 'answers' / f'{name}.json'
    if done.exists():
        return name, ''
    done.parent.mkdir(exist_ok=True)
    part = done.with_suffix('.part')
    part.unlink(missing_ok=True)
    command = [word.format(bag=Path(folder) / 'bags' / name, json=part)
               for word in shlex.split(tool)]
    try:
        told = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s)
        trouble = '' if part.exists() else f'exit {told.returncode}: {told.stderr.strip()[-300:]}'
    except subprocess.TimeoutExpired:
        trouble = f'no answer in {timeout_s:.0f} s'
    except FileNotFoundError:
        raise ValueError(f'command {command[0]!r} is not found; give its path in --tool') from None
    if trouble:
        part.unlink(missing_ok=True)
    else:
        part.replace(done)
    return name, trouble


def _with_dask(jobs, workers, scheduler):
    try:
        from distributed import Client, LocalCluster, as_completed as dask_completed
    except ImportError:
        raise ValueError('a scheduler needs dask: pip install distributed, or leave --scheduler '
                         'out to use a pool') from None
    where = (LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
             if scheduler == 'local' else scheduler)
    with Client(where) as client:
        futures = [client.submit(answer, *job, pure=False) for job in jobs]
        told = dict(f.result() for f in tqdm(dask_completed(futures), total=len(jobs),
                                             desc='tool'))
    if scheduler == 'local':
        where.close()
    return told


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
