"""
Score withheld single effects by classes that are judged at one size.

    python -m validation.blind_classes NAME ...

Up to the fourteenth campaign the change of a rival was taken at d' = 5, whatever the size of the
effect. The labels stay as they were sealed; this judges again, by the generator alone, whether an
effect that was named counts as one with the true one.
"""
import argparse
import json
import lzma
from pathlib import Path

from blindgen.cases.draw import SCOPES
from blindgen.cases.plan import knowledge_of
from blindgen.sizes.classes import rivals, same
from blindgen.verify import read_answer, row

KEPT = Path('docs/validation/blind')
SIZES = 8.0, 4.0        # least d'


def rows_of(name):
    """Yield label and row of every single effect of a campaign that raised an alarm or should."""
    answers = {}
    for path in sorted(KEPT.glob(f'{name}_part*.json.xz')):
        answers.update(json.loads(lzma.decompress(path.read_bytes()))['answers'])
    labels = json.loads((KEPT / f'{name}_labels.json').read_text())['labels']
    for case, value in sorted(labels.items()):
        label, text = value['label'], answers.get(case)
        if label['kind'] == 'single':
            answer = read_answer(text if isinstance(text, str) else json.dumps(text))
            yield case, label, row(case, label, answer), answer


def judged(label, answer):
    """Return whether the one effect named counts as one with the true one at its size."""
    effect, = label['effects']
    found = rivals(knowledge_of(label['seed'], SCOPES['small']), effect['name'],
                   effect['parameters'], effect['alone'], label['seed'] % 2 ** 32)
    return answer['effects'][0] in same(found), found.get(answer['effects'][0], 0.0)


def main(names):
    """Print every answer that is judged anew, and the scores."""
    for name in names:
        rows = []
        for case, label, said, answer in rows_of(name):
            right = said['right']
            if said['d'] >= min(SIZES) and not said['strict'] and len(answer['effects']) == 1:
                right, cosine = judged(label, answer)
                print(case, said['true'][0], "d' =", round(said['d'], 1), 'named',
                      answer['effects'][0], 'cosine', round(cosine, 4), 'as sealed',
                      'right' if said['right'] else 'wrong', flush=True)
            rows.append((said['d'], said['right'], right))
        for least in SIZES:
            some = [r for r in rows if r[0] >= least]
            print(f"{name}, d' >= {least:g}:", sum(r[1] for r in some), 'of', len(some),
                  'as sealed,', sum(r[2] for r in some), 'with classes at one size')


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('names', nargs='+', metavar='NAME', help='such as fourteenth')
    main(parser.parse_args().names)
