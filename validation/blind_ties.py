"""
Count the single effects of blind campaigns that were named, or tied with what was named.

    python -m validation.blind_ties tenth eleventh

A campaign's own score counts the first name of a tie alone. The names are those of campaigns in
docs/validation/blind, whose archived answers and labels are read.
"""
import argparse
import json
import lzma

from validation.gap_figures import interval
from validation.report import ROOT

FOLDER = ROOT / 'docs' / 'validation' / 'blind'
SMALLEST = 8.0, 4.0     # attainable d'


def main():
    """Print one row a campaign and smallest d'."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('names', nargs='+', help='of campaigns, such as eleventh')
    print("| campaign | d' | single effects | named first | named or tied with it | 95 % |\n"
          + '|---' * 6 + '|')
    for name in parser.parse_args().names:
        singles = [(label['effects'][0], json.loads(text)) for _, label, text in singles_of(name)]
        for smallest in SMALLEST:
            rows = [named(e, a) for e, a in singles if e['detectability'] >= smallest]
            first, tied = (sum(r[i] for r in rows) for i in (0, 1))
            low, high = interval(tied, len(rows))
            print(f'| {name} | >= {smallest:g} | {len(rows)} | {first} | {tied} | '
                  f'{low:.2f} to {high:.2f} |')


def singles_of(name):
    """Yield case, label and text of the answer of every single effect of a campaign."""
    labels, answers = json.loads(
        (FOLDER / f'{name}_labels.json').read_text())['labels'], answers_of(name)
    for case, value in labels.items():
        if value['label']['kind'] == 'single':
            yield case, value['label'], answers[case]


def answers_of(name):
    """Return the texts of all answers of a campaign by case."""
    answers = {}
    for path in sorted(FOLDER.glob(f'{name}_part*.json.xz')):
        answers |= json.loads(lzma.open(path).read())['answers']
    return answers


def named(effect, answer):
    """Return whether an answer names an effect or one of its class first, and in its tie."""
    verdict, same = answer['verdict'], {effect['name'], *effect['same']}
    said = answer['outcome'] in ('EXPLAINED', 'TIED') and len(verdict['effects']) == 1
    first = said and verdict['effects'][0] in same
    return first, first or said and bool(same & set(verdict['class']))


if __name__ == '__main__':
    main()
