# Licensed under the Apache License, Version 2.0.
"""Check every hash of a revealed campaign and score it, alone: python3 verify.py FOLDER."""
import hashlib
import json
from pathlib import Path
import sys


def sha(*parts):
    """Return SHA-256 of bytes, texts and plain data in a row, hex."""
    texts = (p if isinstance(p, (bytes, str)) else
             json.dumps(p, sort_keys=True, separators=(',', ':')) for p in parts)
    return hashlib.sha256(b''.join(t if isinstance(t, bytes) else t.encode() for t in texts)
                          ).hexdigest()


def faults(folder, public, locked, told):
    """Yield what disagrees between commitment, bags, answers and reveal."""
    labels, seed = told['labels'], sha(public['commit'], '||', told['nonce'])
    level = [sha('leaf', sha(v['salt'], k, v['label'])) for k, v in labels.items()]
    while len(level) > 1:
        level = [sha('node', *pair) if pair[1:] else pair[0]
                 for pair in (level[k:k + 2] for k in range(0, len(level), 2))]
    names = {f'bag_{sha(seed, "name", str(k))[:12]}' for k in range(public['count'])}
    yield from (text for fine, text in (
        (sha(told['nonce']) == public['nonce_sha256'], 'the nonce is not the committed one'),
        (told['seed'] == seed, 'the seed is not SHA-256(commit || nonce)'),
        (sha(told['classes']) == public['classes_sha256'], 'the classes are others'),
        (names == set(labels) == set(locked) == set(public['bags']), 'the names are others'),
        (level == [public['merkle_root']], 'the labels are not the committed ones')) if not fine)
    for k, v in labels.items():
        bag, answer = folder / 'bags' / k, folder / 'answers' / f'{k}.json'
        files = sorted(p for p in bag.rglob('*') if p.is_file())
        parts = [(str(p.relative_to(bag)), '\0', sha(p.read_bytes())) for p in files]
        if public['bags'].get(k) != sha(*sum(parts, ())):
            yield f'{k}: the bag has changed'
        if locked.get(k) != (sha(answer.read_bytes()) if answer.exists() else 'no answer'):
            yield f'{k}: the answer has changed since it was locked'


def main(folder):
    """Print faults and, by kind of case, how many answers are strictly right; 1 for a fault."""
    told = [json.loads((folder / f'{name}.json').read_text())
            for name in ('commitment', 'answers', 'reveal')]
    found, right = list(faults(folder, *told)), {}
    for name, v in told[2]['labels'].items():
        path, kind = folder / 'answers' / f'{name}.json', v['label']['kind']
        a = json.loads(path.read_text()) if path.exists() else {}
        named = a.get('outcome') in ('EXPLAINED', 'TIED')
        said = sorted(a['verdict']['effects']) if named else a.get('outcome')
        right.setdefault(kind, []).append(said == {
            'none': 'WITHIN_FLOOR', 'outside': 'UNEXPLAINED'}.get(
                kind, sorted(e['name'] for e in v['label']['effects'])))
    print(*(f'FAULT {text}' for text in found), f'{len(found)} faults', *(
        f'{kind:8s} {sum(v)} of {len(v)} strictly right' for kind, v in right.items()), sep='\n')
    return bool(found)


if __name__ == '__main__':
    sys.exit(main(Path(sys.argv[1])))
