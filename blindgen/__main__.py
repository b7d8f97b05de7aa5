# Licensed under the Apache License, Version 2.0.
"""Command line of the blind campaign: make, run, lock, reveal, verify, or all by `campaign`."""
import argparse
from pathlib import Path
import secrets
import subprocess
import sys

from blindgen.campaign import lock, reveal, run, TOOL
from blindgen.make import make
from blindgen.seal import read_json
from blindgen.verify import main as verify


def parser():
    """Return the parser of all steps."""
    top = argparse.ArgumentParser(prog='python -m blindgen', description=__doc__)
    steps = top.add_subparsers(dest='step', required=True)
    for name, text in (('make', 'plan, seal and write the bags'),
                       ('run', 'run the tool on every bag without an answer'),
                       ('lock', 'hash the answers'),
                       ('reveal', 'publish the labels, once the answers are locked'),
                       ('verify', 'check every hash and score'),
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
                              help='JSON list of lists of names that cannot be told apart')
        if name in ('make', 'run', 'campaign'):
            step.add_argument('--workers', type=int, default=1)
        if name in ('run', 'campaign'):
            step.add_argument('--tool', default=TOOL, help='command with {bag} and {json}')
            step.add_argument('--scheduler', default='', help="'local' or tcp://..., needs dask")
            step.add_argument('--timeout', type=float, default=600.0, help='of a bag [s]')
    return top


def main(arguments=None):
    """Run the step; return the exit code."""
    given = parser().parse_args(arguments)
    try:
        return _do(given)
    except ValueError as error:
        print(f'blindgen: {error}', file=sys.stderr)
        return 2


def _do(given):
    folder, whole = given.folder, given.step == 'campaign'
    sealed = getattr(given, 'sealed', None) or folder.with_name(folder.name + '.sealed.json')
    if whole and (folder / 'reveal.json').exists():
        return verify(folder)
    if given.step == 'make' or whole and not (folder / 'answers.json').exists():
        _make(given, folder, sealed)
    if given.step == 'run' or whole and not (folder / 'answers.json').exists():
        troubles = {k: v for k, v in run(folder, given.tool, given.workers, given.scheduler,
                                         given.timeout).items() if v}
        for name, trouble in troubles.items():
            print(f'{name}: {trouble}', file=sys.stderr)
    if given.step == 'lock' or whole and not (folder / 'answers.json').exists():
        print(f'{len(lock(folder))} answers locked')
    if given.step == 'reveal' or whole:
        print(f'{len(reveal(folder, sealed)["labels"])} labels revealed')
    if given.step == 'verify' or whole:
        return verify(folder)
    return 0


def _make(given, folder, sealed):
    """Make with the nonce and the commit of the sealed file when a killed campaign goes on."""
    before = read_json(sealed) if sealed.exists() else None
    nonce = given.nonce or (before['nonce'] if before else secrets.token_hex(32))
    commit = given.commit or (before['public']['commit'] if before else _head())
    classes = read_json(given.classes) if given.classes else before['classes'] if before else []
    public = make(folder, sealed, given.cases, nonce, commit, given.duration, given.workers,
                  classes)
    print(f'{len(public["bags"])} bags in {folder / "bags"}, Merkle root '
          f'{public["merkle_root"]}; labels sealed in {sealed}')


def _head():
    """Return the commit at HEAD of the repository that this file is in."""
    told = subprocess.run(['git', 'rev-parse', 'HEAD'], capture_output=True, text=True,
                          cwd=Path(__file__).parent)
    if told.returncode:
        raise ValueError('no git commit at hand; give that of the frozen tool by --commit')
    return told.stdout.strip()


if __name__ == '__main__':
    sys.exit(main())
