# Licensed under the Apache License, Version 2.0.
"""Command line of the blind campaign: its steps, or all of them by `campaign`."""
import argparse
from contextlib import nullcontext
from pathlib import Path
import secrets
import shlex
import subprocess
import sys
import tempfile

from blindgen.campaign import classes_in, lock, reveal, run
from blindgen.make import make
from blindgen.results import lines, results
from blindgen.seal import read_json, write_json
from blindgen.spread import cluster
from blindgen.tool import TOOL
from blindgen.verify import main as verify


def parser():
    """Return the parser of all steps."""
    top = argparse.ArgumentParser(prog='python -m blindgen', description=__doc__)
    steps = top.add_subparsers(dest='step', required=True)
    for name, text in (('make', 'plan, seal and write the bags'),
                       ('run', 'run the tool on every bag without an answer'),
                       ('lock', 'hash the answers'),
                       ('reveal', 'publish the labels, once the answers are locked'),
                       ('verify', 'check every hash'),
                       ('score', 'score the answers, beside the baselines'),
                       ('campaign', 'all of these, resumable')):
        step = steps.add_parser(name, help=text)
        step.add_argument('--folder', type=Path, required=True, help='public folder')
        if name in ('make', 'reveal', 'campaign'):
            step.add_argument('--sealed', type=Path, help='default FOLDER.sealed.json, beside it')
        if name in ('make', 'campaign'):
            step.add_argument('--cases', type=int, required=True)
            step.add_argument('--duration', type=float, default=600.0, help='of a record [s]')
            step.add_argument('--nonce', help='secret; drawn by chance if left out')
            step.add_argument('--commit', help='of the frozen tool; default the commit at HEAD')
            step.add_argument('--classes', type=Path,
                              help='JSON of names that cannot be told apart: a list of lists, '
                                   'alone or under the key classes')
            step.add_argument('--classes-from', default='',
                              help='command that writes such a file to {json}')
        if name in ('make', 'run', 'score', 'campaign'):
            step.add_argument('--workers', type=int, default=2,
                              help='processes of the local Dask cluster; 0 uses none')
            step.add_argument('--scheduler', default='local',
                              help='of Dask: local, or tcp://HOST:PORT whose workers see FOLDER')
        if name in ('score', 'campaign'):
            step.add_argument('--rounds', type=int, default=2,
                              help='of training of the baselines, 120 records each; 0: none')
            step.add_argument('--cache', type=Path, default=Path('~/.cache/blindgen'),
                              help='keeps what the baselines learn from')
        if name in ('run', 'campaign'):
            step.add_argument('--tool', default=TOOL, help='command with {bag} and {json}')
            step.add_argument('--timeout', type=float, default=600.0, help='of a bag [s]')
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
    folder, whole = given.folder.resolve(), given.step == 'campaign'
    sealed = getattr(given, 'sealed', None) or folder.with_name(folder.name + '.sealed.json')
    spreads = hasattr(given, 'scheduler')
    with cluster(given.workers, given.scheduler) if spreads else nullcontext() as client:
        if given.step == 'make' or whole and not (folder / 'answers.json').exists():
            _make(given, folder, sealed, client)
        if given.step == 'run' or whole and not (folder / 'answers.json').exists():
            for name, trouble in run(folder, given.tool, client, given.timeout).items():
                if trouble:
                    print(f'{name}: {trouble}', file=sys.stderr)
        if given.step == 'lock' or whole and not (folder / 'answers.json').exists():
            print(f'{len(lock(folder))} answers locked')
        if given.step == 'reveal' or whole and not (folder / 'reveal.json').exists():
            print(f'{len(reveal(folder, sealed)["labels"])} labels revealed')
        code = verify(folder) if given.step == 'verify' or whole else 0
        if given.step == 'score' or whole:
            print(*lines(results(folder, client, given.rounds, given.cache.expanduser())),
                  sep='\n')
    return code


def _make(given, folder, sealed, client):
    """Make with the nonce and the commit of the sealed file when a killed campaign goes on."""
    before = read_json(sealed) if sealed.exists() else None
    begun = sealed.with_name(sealed.name + '.parts') / 'begun.json'
    earlier = ({'nonce': before['nonce'], 'commit': before['public']['commit'],
                'classes': before['classes']} if before
               else read_json(begun) if begun.exists() else {})
    nonce = given.nonce or earlier.get('nonce') or secrets.token_hex(32)
    commit = given.commit or earlier.get('commit') or _head()
    classes = _classes(given) or earlier.get('classes') or []
    if not before:
        write_json(begun, {'nonce': nonce, 'commit': commit, 'classes': classes})
    public = make(folder, sealed, given.cases, nonce, commit, given.duration, client, classes)
    print(f'{len(public["bags"])} bags in {folder / "bags"}, Merkle root '
          f'{public["merkle_root"]}; labels sealed in {sealed}')


def _classes(given):
    """Return the declared classes, from a file or from a command that writes {json}."""
    if given.classes:
        return classes_in(read_json(given.classes))
    if not given.classes_from:
        return []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'classes.json'
        command = [word.format(json=path) for word in shlex.split(given.classes_from)]
        told = subprocess.run(command, capture_output=True, text=True)
        if not path.exists():
            raise ValueError(f'--classes-from {given.classes_from!r} wrote no {{json}}: '
                             f'{told.stderr.strip()[-300:]}')
        return classes_in(read_json(path))


def _head():
    """Return the commit at HEAD of the repository that this file is in."""
    told = subprocess.run(['git', 'rev-parse', 'HEAD'], capture_output=True, text=True,
                          cwd=Path(__file__).parent)
    if told.returncode:
        raise ValueError('no git commit at hand; give that of the frozen tool by --commit')
    return told.stdout.strip()


if __name__ == '__main__':
    sys.exit(main())
