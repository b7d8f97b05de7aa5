# Licensed under the Apache License, Version 2.0.
"""
Commit and reveal: what is published before the run binds what is data after it.

seed = SHA-256(commit || nonce); a leaf is SHA-256(salt || label), its salt HMAC-SHA-256 of the
name under the seed; the Merkle root of the leaves, the hash of the nonce and the hashes of the
cases are published, the nonce and the labels are not. So nobody can pick the cases after the tool
is frozen, and nobody can change them after the answers are in.
"""
import hashlib
import hmac
import json
from pathlib import Path

SCHEMA = 'blindgen/2'


def sha(*parts):
    """Return the SHA-256 of texts and bytes one after the other, as hex."""
    return hashlib.sha256(b''.join(p.encode() if isinstance(p, str) else p
                                   for p in parts)).hexdigest()


def canonical(value):
    """Return plain data as the one JSON text that is hashed."""
    return json.dumps(value, sort_keys=True, separators=(',', ':'))


def seed_of(commit, nonce):
    """Return the seed of a campaign, 64 hex digits."""
    return sha(commit, '||', nonce)


def case_name(seed, k):
    """Return the random name of case k."""
    return 'case_' + sha(seed, 'name', str(k))[:12]


def salt_of(seed, name):
    """Return the salt of a case's label."""
    return hmac.new(bytes.fromhex(seed), name.encode(), hashlib.sha256).hexdigest()


def leaf(salt, name, label):
    """Return the salted hash of one label."""
    return sha(salt, name, canonical(label))


def merkle_root(leaves):
    """
    Return the root of a Merkle tree over hex leaves; an odd last one moves up unchanged.

    Leaves and nodes are hashed with different prefixes, so that a node cannot pose as a leaf.

    Raises
    ------
    ValueError
        If there is no leaf.

    """
    if not leaves:
        raise ValueError('no leaves; a campaign has at least one case')
    level = [sha('leaf', x) for x in leaves]
    while len(level) > 1:
        pairs = [sha('node', a, b) for a, b in zip(level[::2], level[1::2])]
        level = pairs + level[len(pairs) * 2:]
    return level[0]


def hash_of_folder(folder):
    """Return one hash over the names and bytes of all files of a folder."""
    files = sorted(p for p in Path(folder).rglob('*') if p.is_file())
    return sha(*(part for p in files
                 for part in (str(p.relative_to(folder)), '\0', sha(p.read_bytes()))))


def write_json(path, value):
    """Write plain data whole or not at all, readable by people."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + '.part')
    part.write_text(json.dumps(value, indent=1, sort_keys=True) + '\n')
    part.replace(path)


def read_json(path):
    """
    Read plain data.

    Raises
    ------
    ValueError
        If there is no such file or it is not JSON.

    """
    try:
        return json.loads(Path(path).read_text())
    except FileNotFoundError:
        raise ValueError(f'{path} does not exist; run the step that writes it first') from None
    except json.JSONDecodeError as error:
        raise ValueError(f'{path} is not JSON ({error}); make it again') from None
