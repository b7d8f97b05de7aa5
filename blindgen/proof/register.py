# Licensed under the Apache License, Version 2.0.
"""
Register of all campaigns that were begun, a chain of lines that is only ever added to.

A campaign enters before its first case is made, and again when it is dropped, with the reason, or
scored. Each line holds the hash of the line before, so that none can be taken out unnoticed.
"""
from datetime import datetime, timezone
import fcntl
import json
from pathlib import Path

from blindgen.proof.seal import canonical, sha

REGISTER = Path(__file__).parent / 'register.jsonl'
STATES = ('begun', 'dropped', 'scored')


def entries(path=REGISTER):
    """
    Return the entries of a register.

    Raises
    ------
    ValueError
        If a line was changed, added or taken out elsewhere than at the end.

    """
    data, before = [], ''
    for k, line in enumerate(Path(path).read_text().splitlines() if Path(path).exists() else []):
        data.append(json.loads(line))
        if data[-1]['before'] != before:
            raise ValueError(f'{path}: line {k + 1} does not follow the line before; restore the '
                             'file from git, a register is only ever added to')
        before = sha(line)
    return data


def enter(campaign, state, path=REGISTER, **more):
    """
    Add an entry unless the campaign has that state already; return whether it was added.

    Parameters
    ----------
    campaign : str
        Hash of its nonce, which is published at once and names it.
    state : str
        begun, dropped or scored.
    path : Path
        Of the register.
    more : dict
        What else is worth keeping: commit, count, reason, hash of the scores.

    """
    if state not in STATES:
        raise ValueError(f'state={state!r} is not known; give one of {", ".join(STATES)}')
    with open(path, 'a+') as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        data = entries(path)
        if any(e['campaign'] == campaign and e['state'] == state for e in data):
            return False
        lines = Path(path).read_text().splitlines()
        file.write(canonical({
            'campaign': campaign, 'state': state,
            'time': datetime.now(timezone.utc).isoformat(timespec='seconds'),
            'before': sha(lines[-1]) if lines else '', **more}) + '\n')
    return True


def open_campaigns(path=REGISTER):
    """Return the campaigns that were begun and neither dropped nor scored."""
    data = entries(path)
    ended = {e['campaign'] for e in data if e['state'] != 'begun'}
    return sorted({e['campaign'] for e in data if e['state'] == 'begun'} - ended)
