# Licensed under the Apache License, Version 2.0.
"""Command line of the blind campaign: its steps, or all of them by `campaign`."""
import argparse
from contextlib import nullcontext
from math import inf
from pathlib import Path
import secrets
import subprocess
import sys

from blindgen.arithmetic import start_again
from blindgen.cases.draw import SCOPES
from blindgen.cases.make import make
from blindgen.proof.register import enter, entries, open_campaigns, REGISTER
from blindgen.proof.seal import read_json, sha, write_json
from blindgen.run.archive import keep_labels, resume
from blindgen.run.campaign import lock, publish, reveal, Run, run
from blindgen.run.spread import cluster
from blindgen.run.tool import TOOL
from blindgen.scoring.results import lines, results
from blindgen.verify import main as verify

STEPS = (('make', 'plan, seal and write the cases'),
         ('publish', 'make the commitment a git commit of its own, then keep its veiled labels'),
         ('run', 'run the tool on every case that was not run, and archive the answers in git'),
         ('resume', 'make a lost folder again from the repository and the nonce; then `run`'),
         ('lock', 'hash and archive the answers'),
         ('reveal', 'publish the labels, once the answers are locked'),
         ('verify', 'check every hash and score, by verify.py alone'),
         ('score', 'score the answers, beside the baselines, and report'),
         ('drop', 'enter in the register that a campaign is dropped, and why'),
         ('register', 'print the register of all campaigns'),
         ('campaign', 'make, publish, run, lock, reveal, score, verify; resumable'))


def parser():
    """Return the parser of all steps."""
    top = argparse.ArgumentParser(prog='python -m blindgen', description=__doc__)
    steps = top.add_subparsers(dest='step', required=True)
    for name, text in STEPS:
        step = steps.add_parser(name, help=text)
        if name != 'register':
            step.add_argument('--folder', type=Path, required=True, help='public folder')
        step.add_argument('--register', type=Path, default=REGISTER, help='of all campaigns')
        if name in ('make', 'reveal', 'campaign', 'publish', 'run', 'resume'):
            step.add_argument('--sealed', type=Path, help='default FOLDER.sealed.json, beside it')
        if name in ('make', 'campaign'):
            step.add_argument('--scope', choices=sorted(SCOPES), default='full',
                              help='how far spacecraft and records range')
        if name in ('make', 'campaign'):
            step.add_argument('--cases', type=int, required=True)
            step.add_argument('--nonce', help='secret; drawn by chance if left out')
            step.add_argument('--transient', action='store_true',
                              help='keep no case: each is made again when it is run')
            step.add_argument('--commit', help='of the frozen tool; default the commit at HEAD')
        if name in ('make', 'run', 'score', 'campaign'):
            step.add_argument('--workers', type=int, default=2,
                              help='processes of the local Dask cluster; 0 uses none')
            step.add_argument('--scheduler', default='local',
                              help='of Dask: local, or tcp://HOST:PORT whose workers see FOLDER')
        if name in ('score', 'campaign'):
            step.add_argument('--rounds', type=int, default=0,
                              help='of training of the baselines, 30 cases each; 0: none')
            step.add_argument('--cache', type=Path, default=Path('~/.cache/blindgen'),
                              help='keeps what the baselines learn from')
        if name in ('publish', 'run', 'campaign', 'verify', 'resume'):
            step.add_argument('--repository', type=Path, default=Path('.'),
                              help='git working tree that gets the commitment')
        if name == 'resume':
            step.add_argument('--nonce', required=True, help='of the sealed file that was lost')
        if name in ('publish', 'campaign', 'resume'):
            step.add_argument('--path', help='of the commitment in the repository; default '
                                             'docs/validation/blind/NAME_commitment.json')
        if name in ('run', 'campaign'):
            step.add_argument('--unpublished', action='store_true',
                              help='run without a published commitment: it proves nothing')
            step.add_argument('--tool', action='append',
                              help='command with {bag} {json} {model} {healthy} {calibrated}; '
                                   'several are run in turn')
            step.add_argument('--timeout', type=float, default=900.0, help='of a case [s]')
            step.add_argument('--hours', type=float, default=inf,
                              help='begin no case after so long; `run` goes on another day')
            step.add_argument('--retry', action='store_true',
                              help='run again what ended without an answer; its record says so')
        if name == 'drop':
            step.add_argument('--reason', required=True)
    return top


def main(arguments=None):
    """Run the step; return the exit code."""
    given = parser().parse_args(arguments)
    try:
        return _do(given)
    except (ValueError, RuntimeError) as error:
        print(f'blindgen: {error}', file=sys.stderr)
        return 2


def _do(given):
    if given.step == 'register':
        for entry in entries(given.register):
            print(*(f'{k}={v}' for k, v in entry.items() if k != 'before'))
        print(f'{len(open_campaigns(given.register))} campaigns are begun and not ended')
        return 0
    folder, whole = given.folder.resolve(), given.step == 'campaign'
    if given.step == 'drop':
        enter(read_json(folder / 'commitment.json')['nonce_sha256'], 'dropped', given.register,
              reason=given.reason)
        return 0
    sealed = getattr(given, 'sealed', None) or folder.with_name(folder.name + '.sealed.json')
    if given.step == 'resume':
        count = resume(folder, sealed, given.repository, _path(given, folder), given.nonce)
        print(f'{folder} is made again, {count} cases have run; `run` goes on')
        return 0
    spreads = hasattr(given, 'scheduler')
    with cluster(given.workers, given.scheduler) if spreads else nullcontext() as client:
        open_ = whole and not (folder / 'answers.json').exists()
        if given.step == 'make' or open_:
            _make(given, folder, sealed, client)
        if given.step == 'publish' or open_ and not given.unpublished:
            _publish(given, folder, sealed)
        if (given.step == 'run' or open_) and (left := _run(given, folder, sealed, client)):
            print(f'{left} cases are left; the same command goes on')
            return 0
        if given.step == 'lock' or open_:
            print(f'{len(lock(folder))} answers locked')
        if given.step == 'reveal' or whole and not (folder / 'reveal.json').exists():
            print(f'{len(reveal(folder, sealed)["labels"])} labels revealed')
        if given.step == 'score' or whole:
            scores = results(folder, client, given.rounds, given.cache.expanduser())
            print(*lines(scores), sep='\n')
            enter(read_json(folder / 'commitment.json')['nonce_sha256'], 'scored',
                  given.register, scores=sha((folder / 'scores.json').read_bytes()))
    if given.step == 'verify' or whole:
        return verify(folder, given.repository)
    return 0


def _make(given, folder, sealed, client):
    """Make with the nonce and the commit of the sealed file when a killed campaign goes on."""
    begun = sealed.with_name(sealed.name + '.parts') / 'begun.json'
    earlier = ({'nonce': (before := read_json(sealed))['nonce'],
                'commit': before['public']['commit']} if sealed.exists()
               else read_json(begun) if begun.exists() else {})
    nonce = given.nonce or earlier.get('nonce') or secrets.token_hex(32)
    commit = given.commit or earlier.get('commit') or _head()
    if not sealed.exists():
        write_json(begun, {'nonce': nonce, 'commit': commit})
    enter(sha(nonce), 'begun', given.register, commit=commit, count=given.cases,
          scope=given.scope, folder=folder.name)
    public = make(folder, sealed, given.cases, nonce, commit, SCOPES[given.scope], client,
                  not given.transient)
    print(f'{len(public["cases"])} cases in {folder / "cases"}, Merkle root '
          f'{public["merkle_root"]}; labels sealed in {sealed}')


def _path(given, folder):
    return given.path or f'docs/validation/blind/{folder.name}_commitment.json'


def _publish(given, folder, sealed):
    """Publish the commitment unless it is, and keep the labels beside it."""
    if not (folder / 'published.json').exists():
        path = _path(given, folder)
        print(f'commitment published by git commit {publish(folder, given.repository, path)}')
        keep_labels(sealed, given.repository, path)


def _run(given, folder, sealed, client):
    """Run the tool, print what went wrong, and return how many cases are left."""
    how = Run(tuple(given.tool or TOOL), given.timeout,
              None if given.unpublished else given.repository, sealed, given.hours, given.retry)
    failures = run(folder, how, client)
    for name, trouble in failures.items():
        if trouble:
            print(f'{name}: {trouble}', file=sys.stderr)
    return sum(not (folder / 'runs' / f'{name}.json').exists() for name in failures)


def _head():
    """Return the commit at HEAD of the repository that this file is in."""
    data = subprocess.run(['git', 'rev-parse', 'HEAD'], capture_output=True, text=True,
                          cwd=Path(__file__).parent)
    if data.returncode:
        raise ValueError('no git commit at hand; give that of the frozen tool by --commit')
    return data.stdout.strip()


if __name__ == '__main__':
    start_again()
    sys.exit(main())
