# Licensed under the Apache License, Version 2.0.
"""Check every hash of a revealed campaign, then score it: python -m blindgen.verify FOLDER."""
from pathlib import Path
import sys

from blindgen.campaign import answers_of
from blindgen.score import score
from blindgen.seal import (bag_name, canonical, hash_of_folder, leaf, merkle_root, read_json,
                           salt_of, seed_of, sha, write_json)


def faults(folder):
    """Return what does not agree between commitment, bags, answers and reveal, as sentences."""
    folder = Path(folder)
    public, told = read_json(folder / 'commitment.json'), read_json(folder / 'reveal.json')
    locked, labels = read_json(folder / 'answers.json'), told['labels']
    found = []

    def check(fine, sentence):
        if not fine:
            found.append(sentence)

    seed = seed_of(public['commit'], told['nonce'])
    check(sha(told['nonce']) == public['nonce_sha256'], 'the nonce is not the committed one')
    check(told['seed'] == seed, 'the seed is not SHA-256(commit || nonce)')
    check(sha(canonical(told['classes'])) == public['classes_sha256'],
          'the equivalence classes are not the committed ones')
    check(len(labels) == public['count'], 'there are more or fewer labels than cases')
    check(set(labels) == {bag_name(seed, k) for k in range(public['count'])} == set(locked)
          == set(public['bags']), 'the names are not those of the seed, the bags and the answers')
    check(merkle_root([leaf(v['salt'], name, v['label']) for name, v in sorted(labels.items())])
          == public['merkle_root'], 'the labels are not the committed ones')
    for name, v in labels.items():
        check(v['salt'] == salt_of(seed, name), f'{name}: its salt does not follow from the seed')
    for name, value in public['bags'].items():
        check(hash_of_folder(folder / 'bags' / name) == value, f'{name}: the bag has changed')
    for name, value in locked.items():
        path = folder / 'answers' / f'{name}.json'
        now = sha(path.read_bytes()) if path.exists() else 'no answer'
        check(now == value, f'{name}: the answer has changed since it was locked')
    return found


def main(folder):
    """Print the faults and the main scores; return 1 when there is a fault."""
    found = faults(folder)
    for sentence in found:
        print('FAULT', sentence)
    told = read_json(Path(folder) / 'reveal.json')
    scores = score({name: v['label'] for name, v in told['labels'].items()}, answers_of(folder),
                   told['classes'])
    write_json(Path(folder) / 'scores.json', scores)
    for key, value in scores.items():
        if isinstance(value, dict) and value.get('value') is not None:
            print(f'{key:24s} {value["value"]:.3f}  [{value["low95"]:.3f}, {value["high95"]:.3f}]'
                  f'  of {value["total"]}')
    print(f'{len(found)} faults, {len(scores["failures"])} wrong answers; see scores.json')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))
