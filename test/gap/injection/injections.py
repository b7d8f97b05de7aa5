"""
One injection of every effect of the library, and what is pinned of its diagnosis.

    python test/gap/injection/injections.py --write [EFFECT ...]

writes the answers of today into answers.json; sizes.json has the effects (make_sizes.py), at
d' = 16 against the model and larger against a healthy recording. An answer is 'strict' where the
effect alone is the verdict, 'class' where it is one of those that the diagnosis calls
indistinguishable, 'undetected' where no gap is found, and 'wrong' otherwise, also where the effect
is named as the nearest of a gap that is called unexplained.
"""
import argparse
from dataclasses import replace
import json
from pathlib import Path
import sys
import time

from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.model import load_spacecraft
from ssi_ros.model.uncertainty import EXACT

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / 'golden'))
from cases import diagnose, diagnose_reference, summary     # noqa: E402, I100

SIZES = json.loads((HERE / 'sizes.json').read_text())
ANSWERS = HERE / 'answers.json'
HEALTHY_SEED = 4_000    # of the recording that stands in for a model


def exact_spacecraft():
    """Return the packaged spacecraft as a model that is declared exact."""
    return replace(load_spacecraft(), uncertainty=EXACT)


def record(name, text):
    """Return the record of the default spacecraft with an effect at the seed of its name."""
    setup = inject(load_spacecraft(), [parse_effect(text)], SIZES['seconds'])
    return simulate_setup(setup, SIZES['effects'][name]['seed'])


def against_model(name):
    """Return the diagnosis of an injection against the model."""
    return diagnose(exact_spacecraft(), record(name, SIZES['effects'][name]['text']))


def against_recording(name):
    """Return the diagnosis of a larger injection against a healthy recording."""
    healthy = simulate_setup(inject(load_spacecraft(), (), SIZES['seconds']), HEALTHY_SEED)
    return diagnose_reference(healthy, record(name, SIZES['effects'][name]['large']))


KINDS = {'model': against_model, 'recording': against_recording}


def answer(kind, name):
    """Return what is pinned of an injection."""
    found = summary(KINDS[kind](name))
    return {'answer': judged(name, found), **{
        k: found[k] for k in ('outcome', 'effects', 'class', 'probability')}}


def judged(name, found):
    """Return 'strict', 'class', 'undetected' or 'wrong'."""
    if found['outcome'] == 'WITHIN_FLOOR':
        return 'undetected'
    if found['outcome'] not in ('EXPLAINED', 'TIED') or len(found['effects']) != 1:
        return 'wrong'
    if found['effects'] == [name]:
        return 'strict'
    return 'class' if name in found['class'] else 'wrong'


def main():
    """Run the injections; write their answers if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--write', action='store_true', help='write the answers as JSON')
    parser.add_argument('names', nargs='*', metavar='EFFECT', help='all by default')
    args = parser.parse_args()
    pinned = json.loads(ANSWERS.read_text()) if ANSWERS.is_file() else {k: {} for k in KINDS}
    for kind in KINDS:
        for name in args.names or SIZES['effects']:
            begin = time.perf_counter()
            found = pinned[kind][name] = answer(kind, name)
            print(f'{kind} {name}: {time.perf_counter() - begin:.1f} s, {found["answer"]}: '
                  f'{found["outcome"]} {" + ".join(found["effects"])} '
                  f'{found["probability"]:.3f}, class {", ".join(found["class"])}', flush=True)
    if args.write:
        ANSWERS.write_text(json.dumps(pinned, indent=1, allow_nan=False) + '\n')


if __name__ == '__main__':
    main()
