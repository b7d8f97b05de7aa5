"""
Score withheld single effects by classes whose rivals are of the size that comes nearest.

    python -m validation.blind_classes NAME ...

Up to the fifteenth campaign the change of a rival was taken at d' = 5, whatever the size of the
effect. Up to the twentieth a rival was as large as the effect, not of the size that comes nearest,
and a linear hinge was compared by its whole spectrum with what simulations show of another one.
The labels stay as they were sealed; this judges again, by the generator alone, whether an effect
that was named counts as one with the true one.
"""
import argparse

from blindgen.cases.make import scope_of
from blindgen.cases.plan import knowledge_of
from blindgen.proof.seal import read_json
from blindgen.sizes.classes import rivals, same
from blindgen.verify import read_answer, row

from validation.blind_ties import FOLDER, singles_of, SMALLEST


def judged(label, answer, scope):
    """Return whether the one effect named counts as one with the true one, and their cosine."""
    effect, = label['effects']
    found = rivals(knowledge_of(label['seed'], scope), effect['name'], effect['parameters'],
                   effect['alone'], label['seed'] % 2 ** 32)
    return answer['effects'][0] in same(found), found.get(answer['effects'][0], 0.0)


def main(names):
    """Print every answer that is judged anew, and the scores."""
    for name in names:
        rows, scope = [], scope_of(read_json(FOLDER / f'{name}_commitment.json'))
        for case, label, text in singles_of(name):
            answer = read_answer(text)
            said = row(case, label, answer)
            right = said['right']
            if said['d'] >= min(SMALLEST) and not said['strict'] and len(answer['effects']) == 1:
                right, cosine = judged(label, answer, scope)
                print(case, said['true'][0], "d' =", round(said['d'], 1), 'named',
                      answer['effects'][0], 'cosine', round(cosine, 4), 'as sealed',
                      'right' if said['right'] else 'wrong', flush=True)
            rows.append((said['d'], said['right'], right))
        for least in SMALLEST:
            some = [r for r in rows if r[0] >= least]
            print(f"{name}, d' >= {least:g}:", sum(r[1] for r in some), 'of', len(some),
                  'as sealed,', sum(r[2] for r in some), 'with rivals that come nearest')


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('names', nargs='+', metavar='NAME', help='such as fourteenth')
    main(parser.parse_args().names)
