# Licensed under the Apache License, Version 2.0.
"""What a campaign asks of git: commits of named files alone, and whether a frozen tool changed."""
from pathlib import Path
import subprocess


def git(repository, *words):
    """
    Return what a git command prints, bytes.

    Raises
    ------
    ValueError
        If git refuses.

    """
    done = subprocess.run(['git', '-C', str(repository), *words], capture_output=True)
    if done.returncode:
        raise ValueError(f'git {words[0]} in {repository}: '
                         f'{done.stderr.decode(errors="replace").strip()[-300:]}')
    return done.stdout


def commit(repository, path, data, message):
    """Write data to a path of the working tree, commit that file alone, return the commit."""
    to = Path(repository) / path
    to.parent.mkdir(parents=True, exist_ok=True)
    to.write_bytes(data)
    git(repository, 'add', '--', path)
    git(repository, 'commit', '--quiet', '--only', '-m', message, '--', path)
    return git(repository, 'rev-parse', 'HEAD').decode().strip()


def commit_of(repository, path):
    """
    Return the commit that added a file, as it is now, to the history.

    Raises
    ------
    ValueError
        If no commit added it, or the file was changed since.

    """
    added = git(repository, 'log', '--diff-filter=A', '--format=%H', '--', path).decode().split()
    if not added:
        raise ValueError(f'no commit added {path}; give the path of a published commitment')
    if git(repository, 'show', f'{added[0]}:{path}') != (Path(repository) / path).read_bytes():
        raise ValueError(f'{path} is not what commit {added[0]} added; restore it from there')
    return added[0]


def refuse_changed(repository, since, paths):
    """Raise a ValueError if a file of the frozen tool is not what it was at its commit."""
    changed = git(repository, 'diff', '--name-only', since, '--', *paths).decode().split()
    if changed:
        raise ValueError(f'the tool is not that of commit {since[:12]}, to which the campaign is '
                         f'bound: {len(changed)} files differ, the first {changed[0]}; answer '
                         'from a working tree of that commit')
